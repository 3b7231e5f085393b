// The page: reads what it is to show, and draws when something has changed.

import type GUI from "lil-gui";
import { WebGLRenderer } from "three";
import { View } from "./camera.ts";
import { Block, inflated, Motion } from "./decode.ts";
import { Look } from "./look.ts";
import { Pace, type Quality } from "./pace.ts";
import { addPanel } from "./panel.ts";
import { Player } from "./player.ts";
import { Plots } from "./plots.ts";
import { type Shown, Stage } from "./scene.ts";

const STILL = 400; // [ms] after which a picture that stands still is drawn with all that was left out

class Page {
  private readonly renderer: WebGLRenderer;
  private readonly view: View;
  private readonly stage: Stage;
  private readonly player: Player;
  private readonly plots: Plots;
  private readonly look: Look;
  readonly gui: GUI;
  private readonly pace = new Pace(devicePixelRatio);
  private readonly shown: Shown = { surface: "skin", field: null, explode: 0, cut: 0, axis: 0, stitches: true };
  private asked = 0;
  private refine = 0; // the timer of a better picture
  private place = -1; // that the scene shows
  private sharp = 0;
  pictures = 0;

  constructor(block: Block, motion: Motion) {
    const canvas = document.querySelector("canvas")!;
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    this.renderer = new WebGLRenderer({ canvas, antialias: false, powerPreference: "high-performance" });
    this.renderer.autoClear = false;
    this.look = new Look(block.description, dark);
    this.stage = new Stage(block, motion, this.look, this.shown);
    this.view = new View(block, canvas, () => this.draw());
    this.player = new Player(motion, () => this.draw());
    this.plots = new Plots(block, (time) => this.player.seekTime(time));
    this.gui = addPanel(block.description, this.shown, {
      changed: () => this.again(),
      plotted: (plot) => this.plots.show(plot),
      fit: () => {
        this.view.fit();
        this.draw();
      },
    });
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement!);
    canvas.addEventListener("webglcontextrestored", () => this.again());
  }

  /** Asks for a picture. */
  draw(): void {
    clearTimeout(this.refine);
    this.refine = 0;
    if (!this.asked) this.asked = requestAnimationFrame((now) => this.picture(now));
  }

  /** Asks for one in which something else is shown. */
  private again(): void {
    this.place = -1;
    this.draw();
  }

  private picture(now: number): void {
    this.asked = 0;
    this.player.advance(now);
    if (this.player.playing && this.pace.picture(now)) this.place = -1;
    this.render(this.pace.quality);
    if (this.player.playing) this.draw();
    else this.rest();
    this.report();
  }

  private rest(): void {
    this.pace.pause();
    const { quality, best } = this.pace;
    if (quality === best) return;
    this.refine = setTimeout(() => {
      this.place = -1;
      this.refine = 0;
      this.render(best);
      this.place = -1; // the next one is drawn as the measured rate allows
    }, STILL);
  }

  private render(quality: Quality): void {
    if (quality.sharp !== this.sharp) {
      this.sharp = quality.sharp;
      this.renderer.setPixelRatio(quality.sharp);
    }
    this.look.setQuality(quality);
    if (this.place !== this.player.place) {
      this.place = this.player.place;
      this.stage.show(this.shown, quality.coarse);
      this.stage.move(this.place);
      this.look.cast(this.renderer, this.stage.scene);
      this.plots.move(this.player.time);
    }
    this.renderer.clear();
    this.renderer.render(this.stage.scene, this.view.camera);
    this.pictures += 1;
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.renderer.domElement.parentElement!;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.view.resize(clientWidth, clientHeight);
    this.plots.resize();
    this.draw();
  }

  private report(): void {
    const rate = this.pace.rate, element = document.querySelector<HTMLElement>("#rate")!;
    element.textContent = this.player.playing && rate ? `${rate.toFixed(rate < 10 ? 1 : 0)} pictures/s` : "";
    document.querySelector<HTMLElement>("#note")!.textContent = this.pace.note;
  }
}

function say(text: string): void {
  const element = document.querySelector<HTMLElement>("#message")!;
  element.textContent = text;
  element.hidden = false;
}

async function start(): Promise<void> {
  const data = document.querySelector("#data")!.textContent!;
  let block: Block, motion: Motion;
  try {
    block = new Block(await inflated(data));
    motion = new Motion(block);
  } catch {
    return say("This page is damaged: its frames cannot be read. Write it again with `supple export --to html`.");
  }
  document.title = `${block.description.title} · Supple`;
  try {
    Object.assign(globalThis, { supplePage: new Page(block, motion) });
  } catch (error) {
    say(`This page cannot be shown: ${error instanceof Error ? error.message : error}`);
  }
}

void start();
