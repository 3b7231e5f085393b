// Plots of what was measured over time, with a line at the time that is shown.

import uPlot from "uplot";
import type { Block } from "./decode.ts";

const COLORS = ["#e65c3c", "#409ce1", "#34ac78", "#ce70b2", "#f5b324", "#78c8eb", "#a07850"];

export class Plots {
  private plot: uPlot | null = null;
  private time = 0;
  private readonly block: Block;
  private readonly seek: (time: number) => void;

  constructor(block: Block, seek: (time: number) => void) {
    this.block = block;
    this.seek = seek;
  }

  /** Draws one of the plots; none for -1. */
  show(number: number): void {
    const element = document.querySelector<HTMLElement>("#plot")!;
    this.plot?.destroy();
    this.plot = null;
    element.hidden = number < 0;
    if (number < 0) return;
    const { title, series } = this.block.description.plots[number];
    const ink = getComputedStyle(document.body).color, lines = "#8884";
    const axis = { stroke: ink, grid: { stroke: lines }, ticks: { stroke: lines }, font: "11px sans-serif" };
    const x = Array.from(this.block.array(this.block.description.times));
    const data = [x, ...series.map(({ values }) => Array.from(this.block.array(values), known))];
    this.plot = new uPlot({
      width: element.clientWidth, height: 170, title,
      scales: { x: { time: false } },
      axes: [axis, { ...axis, size: 58 }],
      cursor: { drag: { x: false, y: false }, y: false },
      series: [{ label: "time [s]" }, ...series.map(({ name }, k) => ({
        label: name, stroke: COLORS[k % COLORS.length], width: 1.5,
      }))],
      hooks: {
        draw: [(plot) => {
          const place = plot.valToPos(this.time, "x", true);
          plot.ctx.fillStyle = ink;
          plot.ctx.fillRect(place, plot.bbox.top, devicePixelRatio, plot.bbox.height);
        }],
      },
    }, data as uPlot.AlignedData, element);
    this.plot.over.addEventListener("click", (event) => this.seek(this.plot!.posToVal(event.offsetX, "x")));
  }

  /** The time that is shown [s]. */
  move(time: number): void {
    this.time = time;
    this.plot?.redraw(false);
  }

  resize(): void {
    this.plot?.setSize({ width: document.querySelector("#plot")!.clientWidth, height: 170 });
  }
}

function known(value: number): number | null {
  return Number.isFinite(value) ? value : null;
}
