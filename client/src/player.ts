// Time: plays, stops, goes to a frame; the bar below the picture.

import type { Motion } from "./decode.ts";

export const SPEEDS = [1 / 16, 1 / 8, 1 / 4, 1 / 2, 1, 2, 4];

export class Player {
  playing: boolean;
  /** between frames, such as 3.5 */
  place = 0;
  private speed = 1;
  private last = 0;
  private readonly motion: Motion;
  private readonly changed: () => void;
  private readonly button = document.querySelector<HTMLButtonElement>("#play")!;
  private readonly slider = document.querySelector<HTMLInputElement>("#time")!;
  private readonly label = document.querySelector<HTMLElement>("#now")!;

  constructor(motion: Motion, changed: () => void) {
    [this.motion, this.changed] = [motion, changed];
    this.playing = motion.count > 1;
    document.querySelector<HTMLElement>("#bar")!.hidden = motion.count < 2;
    this.slider.max = String(motion.count - 1);
    this.button.onclick = () => this.play(!this.playing);
    this.slider.oninput = () => this.seek(Number(this.slider.value));
    const speeds = document.querySelector<HTMLSelectElement>("#speed")!;
    for (const speed of SPEEDS) speeds.add(new Option(speed < 1 ? `1/${1 / speed} ×` : `${speed} ×`, String(speed)));
    // What is over in less than a second is played slowly.
    const length = motion.times[motion.count - 1] - motion.times[0];
    if (length < 1) this.speed = SPEEDS.findLast((speed) => length / speed >= 2) ?? SPEEDS[0];
    speeds.value = String(this.speed);
    speeds.onchange = () => (this.speed = Number(speeds.value));
    addEventListener("keydown", (event) => this.key(event));
    // A choice is made; the next keys are for the player.
    addEventListener("change", ({ target }) => target instanceof HTMLSelectElement && target.blur());
    this.show();
  }

  get time(): number {
    const { times, count } = this.motion;
    const first = Math.min(Math.floor(this.place), count - 1);
    const next = times[Math.min(first + 1, count - 1)];
    return times[first] + (this.place - first) * (next - times[first]);
  }

  play(playing: boolean): void {
    this.playing = playing && this.motion.count > 1;
    this.last = 0;
    if (!playing) this.place = Math.round(this.place);
    this.show();
    this.changed();
  }

  seek(place: number): void {
    this.playing = false;
    this.place = Math.min(Math.max(place, 0), this.motion.count - 1);
    this.show();
    this.changed();
  }

  /** To the frame that is nearest to a time [s]. */
  seekTime(time: number): void {
    this.seek(Math.round(this.placeOf(time)));
  }

  /** Lets the time pass that has passed outside [ms]; starts again after the end. */
  advance(now: number): void {
    const { times, count } = this.motion;
    const seconds = this.last ? Math.min((now - this.last) / 1000, 0.5) * this.speed : 0;
    this.last = now;
    if (!this.playing) return;
    const time = this.time + seconds;
    this.place = time >= times[count - 1] ? 0 : this.placeOf(time);
    this.show();
  }

  private placeOf(time: number): number {
    const { times, count } = this.motion;
    let low = 0, high = count - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle;
      else high = middle;
    }
    const share = (time - times[low]) / (times[high] - times[low] || 1);
    return low + Math.min(Math.max(share, 0), 1) * (high - low);
  }

  private key(event: KeyboardEvent): void {
    if (event.target instanceof HTMLInputElement && event.target.type !== "range") return;
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (event.key === " ") this.play(!this.playing);
    else if (step) this.seek(Math.round(this.place) + step);
    else return;
    event.preventDefault();
  }

  private show(): void {
    this.button.textContent = this.playing ? "❚❚" : "▶";
    this.button.title = this.playing ? "pause (space)" : "play (space)";
    this.slider.value = String(Math.round(this.place));
    this.label.textContent = `${this.time.toFixed(3)} s`;
  }
}
