// Plots of what was measured over time: of a recording with a line at the time that is shown, of a simulation as it runs.

import uPlot from "uplot";
import type { Block, Numbers } from "./data.ts";
import { find } from "./panel.ts";

const COLORS = ["#e65c3c", "#409ce1", "#34ac78", "#ce70b2", "#f5b324", "#78c8eb", "#a07850"];
const MOST = 4000; // times of a simulation that are kept: then every second one goes
const HEIGHT = 170;

export class Plots {
  private plot: uPlot | null = null;
  private time = 0;
  private readonly times: number[];
  private shown = -1;
  private readonly names: { title: string; series: { name: string }[] }[];
  private readonly values: (number | null)[][][];
  private readonly seek: (time: number) => void;

  constructor(block: Block, seek: (time: number) => void) {
    const { times, plots } = block.description;
    [this.names, this.seek] = [plots, seek];
    this.times = plots[0]?.series[0]?.values ? Array.from(block.array(times)) : [];
    this.values = plots.map(({ series }) => series.map(({ values }) => (values ? Array.from(block.array(values), known) : [])));
  }

  /** Appends what a simulation measured, rows of times and values; begins anew where they end before the last one. */
  append(rows: Numbers): void {
    const flat = this.values.flat(), width = 1 + flat.length, end = rows[rows.length - width];
    const thin = end >= (this.times.at(-1) ?? end);
    if (!thin || this.times.length > MOST)
      for (const all of [this.times, ...flat]) all.splice(0, all.length, ...all.filter((_, k) => thin && k % 2 === 0));
    const last = this.times.at(-1) ?? -Infinity;
    for (let i = 0; i < rows.length; i += width) {
      if (rows[i] <= last) continue;
      this.times.push(rows[i]);
      flat.forEach((all, k) => all.push(known(rows[i + 1 + k])));
    }
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
        ({ label: name, stroke: COLORS[k % COLORS.length], width: 1.5, points: { show: false } }))],
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
