// How fast pictures follow each other, and what is left out where that is too slow.

export interface Quality {
  /** pixels of the picture for each one of the page */
  sharp: number;
  coarse: boolean;
  shadows: boolean;
  taps: number;
}

const SLOW = 160; // [ms] between two pictures; a person sees single pictures from about there

/** Measures the time from picture to picture, and goes to lighter ones where it is long. */
export class Pace {
  private level = 0;
  private last = 0;
  private gaps: number[] = [];
  private readonly levels: Quality[];
  private readonly notes = ["", "", "slow renderer: lighter skins", "slow renderer: lighter skins, no shadows"];

  constructor(ratio: number) {
    const plain = Math.min(ratio, 1);
    this.levels = [
      { sharp: Math.max(ratio, 2), coarse: false, shadows: true, taps: 1 },
      { sharp: plain, coarse: false, shadows: true, taps: 0 },
      { sharp: 0.75 * plain, coarse: true, shadows: true, taps: 0 },
      { sharp: 0.75 * plain, coarse: true, shadows: false, taps: 0 },
    ];
  }

  get quality(): Quality {
    return this.levels[this.level];
  }

  /** of a picture that stands still */
  get best(): Quality {
    return this.levels[0];
  }

  get note(): string {
    return this.notes[this.level];
  }

  /** Pictures in a second, of the last ones in a row; 0 where there are none. */
  get rate(): number {
    return this.gaps.length ? (1000 * this.gaps.length) / this.gaps.reduce((a, b) => a + b, 0) : 0;
  }

  /** Called for each picture in a row of them, with the time [ms]. True where the quality has changed. */
  picture(now: number): boolean {
    if (this.last) this.gaps.push(now - this.last);
    this.last = now;
    if (this.gaps.length > 8) this.gaps.shift();
    const known = this.gaps.slice(1).sort((a, b) => a - b); // the first one has programs to compile
    const middle = known[known.length >> 1];
    if (known.length < (middle > 3 * SLOW ? 2 : 4) || middle < SLOW || this.level === this.levels.length - 1) return false;
    this.level = Math.min(this.level + (middle > 3 * SLOW ? 2 : 1), this.levels.length - 1);
    this.pause();
    return true;
  }

  /** The row of pictures ends. */
  pause(): void {
    this.gaps = [];
    this.last = 0;
  }
}
