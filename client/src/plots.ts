// Plots of what was measured over time: of a recording with a line at the time that is shown, of a simulation as it runs.

import uPlot from "uplot";
import type { Block } from "./data.ts";
import { find } from "./panel.ts";

const COLORS = ["#e65c3c", "#409ce1", "#34ac78", "#ce70b2", "#f5b324", "#78c8eb", "#a07850"];
const MOST = 4000; // times of a simulation that are kept: then every second one goes
const HEIGHT = 170;

export class Plots {
  private plot: uPlot | null = null;
  private time = 0;
  private times: number[];
  private shown = -1;
  private readonly names: { title: string; series: { name: string }[] }[];
  private values: (number | null)[][][];
  private readonly seek: (time: number) => void;

  constructor(block: Block, seek: (time: number) => void) {
    const { times, plots } = block.description;
    [this.names, this.seek] = [plots, seek];
    this.times = plots[0]?.series[0]?.values ? Array.from(block.array(times)) : [];
    this.values = plots.map(({ series }) => series.map(({ values }) => (values ? Array.from(block.array(values), known) : [])));
  }

  /** Appends what a simulation measured at a time; begins anew where that is before the last one. */
  append(time: number, numbers: number[][]): void {
    const last = this.times.at(-1) ?? -Infinity, keep = time < last ? () => false : (_: unknown, k: number) => k % 2 === 0;
    if (time === last) return;
    if (time < last || this.times.length > MOST) {
      this.times = this.times.filter(keep);
      this.values = this.values.map((series) => series.map((all) => all.filter(keep)));
    }
    this.times.push(time);
    this.values.forEach((series, k) => series.forEach((all, j) => all.push(known(numbers[k]?.[j] ?? NaN))));
  }

  /** Draws one of the plots; none for -1. */
  show(number = this.shown): void {
    const element = find("#plot");
    this.plot?.destroy();
    [this.plot, this.shown, element.hidden] = [null, number, number < 0];
    if (number < 0) return;
    const { title, series } = this.names[number], ink = getComputedStyle(document.body).color, lines = "#8884";
    const axis = { stroke: ink, grid: { stroke: lines }, ticks: { stroke: lines }, font: "11px sans-serif" };
    this.plot = new uPlot({
      width: element.clientWidth, height: HEIGHT, title,
      scales: { x: { time: false } },
      axes: [axis, { ...axis, size: 58 }],
      cursor: { drag: { x: false, y: false }, y: false },
      series: [{ label: "time [s]" }, ...series.map(({ name }, k) =>
        ({ label: name, stroke: COLORS[k % COLORS.length], width: 1.5 }))],
      hooks: {
        draw: [({ ctx, bbox, valToPos }) => {
          ctx.fillStyle = ink;
          ctx.fillRect(valToPos(this.time, "x", true), bbox.top, devicePixelRatio, bbox.height);
        }],
      },
    }, this.data(), element);
    this.plot.over.addEventListener("click", (event) => this.seek(this.plot!.posToVal(event.offsetX, "x")));
  }

  /** The time that is shown [s]. */
  move(time: number): void {
    this.time = time;
    if (this.plot && this.plot.data[0].length !== this.times.length) this.plot.setData(this.data());
    else this.plot?.redraw(false);
  }

  resize(): void {
    this.plot?.setSize({ width: find("#plot").clientWidth, height: HEIGHT });
  }

  private data(): uPlot.AlignedData {
    return [this.times, ...this.values[this.shown]];
  }
}

function known(value: number): number | null {
  return Number.isFinite(value) ? value : null;
}
