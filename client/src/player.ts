// The time of a recording: plays, stops, goes to a frame.

import type { Motion } from "./data.ts";
import { addBar, type Clock, find, showTime } from "./panel.ts";

const SPEEDS = [0.01, 0.03, 0.1, 0.25, 0.5, 1, 2, 4];

export class Player implements Clock {
  playing: boolean;
  place = 0; // between frames, such as 3.5
  private factor = 1;
  private last = 0;
  private readonly motion: Motion;
  private readonly changed: () => void;
  private readonly slider = find<HTMLInputElement>("#time");

  constructor(motion: Motion, changed: () => void, signal: AbortSignal) {
    [this.motion, this.changed, this.playing] = [motion, changed, motion.count > 1];
    const length = motion.times[motion.count - 1] - motion.times[0];
    // What is over in less than a second is played slowly.
    if (length < 1) this.factor = SPEEDS.findLast((speed) => length / speed >= 2) ?? SPEEDS[0];
    if (motion.count > 1) addBar(this, SPEEDS, signal);
    this.slider.hidden = false;
    this.slider.max = `${motion.count - 1}`;
    this.slider.oninput = () => this.seek(Number(this.slider.value));
    this.show();
  }

  get time(): number {
    const { times, count } = this.motion, first = Math.min(Math.floor(this.place), count - 1);
    return times[first] + (this.place - first) * (times[Math.min(first + 1, count - 1)] - times[first]);
  }

  toggle = () => {
    this.playing = !this.playing && this.motion.count > 1;
    this.last = 0;
    if (!this.playing) this.place = Math.round(this.place);
    this.show();
  };

  step(by: number): void {
    this.seek(Math.round(this.place) + by);
  }

  reset = () => this.seek(0);

  speed(factor: number): void {
    this.factor = factor;
  }

  seek(place: number): void {
    this.playing = false;
    this.place = Math.min(Math.max(place, 0), this.motion.count - 1);
    this.show();
  }

  /** To the frame that is nearest to a time [s]. */
  seekTime(time: number): void {
    this.seek(Math.round(this.placeOf(time)));
  }

  /** Lets the time pass that has passed outside [ms]; starts again after the end. */
  advance(now: number): void {
    const seconds = this.last ? Math.min((now - this.last) / 1000, 0.5) * this.factor : 0, time = this.time + seconds;
    this.last = now;
    this.place = time >= this.motion.times[this.motion.count - 1] ? 0 : this.placeOf(time);
    this.show();
  }

  private placeOf(time: number): number {
    const { times, count } = this.motion;
    let low = 0;
    for (let high = count - 1; high - low > 1; ) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle;
      else high = middle;
    }
    const share = (time - times[low]) / (times[Math.min(low + 1, count - 1)] - times[low] || 1);
    return low + Math.min(Math.max(share, 0), 1);
  }

  private show(): void {
    showTime(this.playing, this.time, this.factor);
    this.slider.value = `${Math.round(this.place)}`;
    this.changed();
  }
}
