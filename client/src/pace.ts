// How fast pictures follow each other, and what is left out where that is too slow.

/** `sharp`: pixels of the picture for each one of the page; `taps`: how soft the edges of shadows are. */
export interface Quality { sharp: number; coarse: boolean; shadows: boolean; taps: number }

const SLOW = 160; // [ms] between two pictures; a person sees single pictures from about there
const FAST = 25; // [ms]; then all that a still picture has is drawn while something moves, too
const NOTES = ["", "", "slow renderer: lighter skins", "slow renderer: lighter skins, no shadows"];

/** Measures how long a picture takes, and goes to lighter ones where that is long: from plain ones, as software needs two
 * seconds for the finest. */
export class Pace {
  private level = 1;
  private wasSlow = false;
  private costs: number[] = [];
  private drawn: number[] = [];
  private readonly levels: Quality[];

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
    return NOTES[this.level];
  }

  /** Pictures in a second, of those of the last two; 0 where there are none. */
  rate(now: number): number {
    this.drawn = this.drawn.filter((time) => now - time < 2000);
    return this.drawn.length > 1 ? (1000 * (this.drawn.length - 1)) / (this.drawn.at(-1)! - this.drawn[0]) : 0;
  }

  /** A picture was asked of the browser at a time, and ready for the next one after `cost` [ms]. True where the quality
   * has changed. */
  picture(now: number, cost: number): boolean {
    this.drawn.push(now);
    this.costs = [...this.costs, cost].slice(-8);
    const known = this.costs.slice(1).sort((a, b) => a - b); // the first one has programs to compile
    const middle = known[known.length >> 1], { level } = this;
    if (middle > 3 * SLOW) this.level += 2;
    else if (middle > SLOW && known.length >= 4) this.level += 1;
    else if (middle < FAST && known.length === 7 && level === 1 && !this.wasSlow) this.level = 0;
    this.level = Math.min(this.level, this.levels.length - 1);
    this.wasSlow ||= this.level > level;
    if (this.level !== level) this.costs = [];
    return this.level !== level;
  }
}
