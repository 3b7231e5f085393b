// The page: reads what it is to show, and draws when something has changed.

import type GUI from "lil-gui";
import { type Ray, WebGLRenderer } from "three";
import { View } from "./camera.ts";
import { Controls } from "./controls.ts";
import { Block, inflated, Motion, type Source } from "./decode.ts";
import { addDragging } from "./drag.ts";
import { download, type FrameMessage, Live, type SceneMessage, type Status } from "./live.ts";
import { Look } from "./look.ts";
import { Pace, type Quality } from "./pace.ts";
import { addPanel, legend } from "./panel.ts";
import { Player } from "./player.ts";
import { Plots } from "./plots.ts";
import { type Shown, Stage } from "./scene.ts";

const STILL = 400; // [ms] after which a picture that stands still is drawn with all that was left out
const find = (selector: string) => document.querySelector<HTMLElement>(selector)!;

/** The picture of one scene, of a recording or of a simulation. */
class Page {
  readonly shown: Shown = {
    surface: "skin", field: null, explode: 0, cut: 0, axis: 0, stitches: true, contacts: false,
  };
  readonly stage: Stage;
  readonly view: View;
  readonly player: Player | null = null;
  readonly gui: GUI;
  readonly pace: Pace;
  readonly look: Look;
  pictures = 0;
  private readonly renderer: WebGLRenderer;
  private readonly plots: Plots | null = null;
  private asked = 0;
  private refine = 0; // the timer of a better picture
  private waits = true; // whether something has changed since the last picture
  private drawn = 0; // when that was asked of the browser [ms]
  private changed = true; // whether more than the camera has
  private sharp = 0;
  private readonly end = new AbortController();
  /** called with each picture */
  done = () => {};

  constructor(renderer: WebGLRenderer, pace: Pace, block: Block, source: Source, live: Live | null) {
    [this.renderer, this.pace] = [renderer, pace];
    const canvas = renderer.domElement;
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    this.look = new Look(block.description, dark);
    this.stage = new Stage(block, source, this.look, this.shown);
    this.view = new View(block, canvas, live ? 260 : 0, () => this.draw());
    if (source instanceof Motion) {
      this.player = new Player(source, () => this.again());
      this.plots = new Plots(block, (time) => this.player!.seekTime(time));
    }
    this.gui = addPanel(block.description, this.shown, live !== null, {
      changed: () => {
        live?.send("view", { field: this.shown.field?.key ?? null, contacts: this.shown.contacts });
        this.again();
      },
      plotted: (plot) => this.plots?.show(plot),
      fit: () => {
        this.view.fit();
        this.draw();
      },
    });
    const { signal } = this.end;
    const hit = (ray: Ray) => this.stage.firstHit(ray);
    if (live) addDragging(canvas, this.view.camera, live, signal, hit, (is) => this.view.hold(is));
    const sizes = new ResizeObserver(() => this.resize());
    sizes.observe(canvas.parentElement!);
    signal.onabort = () => sizes.disconnect();
    canvas.addEventListener("webglcontextrestored", () => this.again(), { signal });
  }

  /** Asks for a picture. */
  draw(): void {
    clearTimeout(this.refine);
    this.refine = 0;
    this.waits = true;
    if (!this.asked) this.asked = requestAnimationFrame((now) => this.tick(now));
  }

  /** Asks for one in which something has moved, or something else is shown. */
  again(): void {
    this.changed = true;
    this.draw();
  }

  render(quality: Quality): void {
    if (quality.sharp !== this.sharp) {
      this.sharp = quality.sharp;
      this.renderer.setPixelRatio(quality.sharp);
    }
    this.look.setQuality(quality);
    if (this.changed) {
      this.changed = false;
      this.stage.show(this.shown, quality.coarse);
      this.stage.move(this.player?.place ?? 0);
      this.look.cast(this.renderer, this.stage.scene);
      if (this.player) this.plots!.move(this.player.time);
    }
    this.renderer.clear();
    this.renderer.render(this.stage.scene, this.view.camera);
    this.pictures += 1;
  }

  /** Draws where something has changed; once more without, as that tells how long the browser took. */
  private tick(now: number): void {
    this.asked = 0;
    if (this.player?.playing) this.player.advance(now);
    const { pace, drawn } = this;
    this.drawn = 0;
    if (drawn && pace.picture(now, now - drawn)) this.changed = true;
    if (this.waits) {
      this.waits = false;
      this.render(pace.quality);
      this.drawn = now;
      this.done();
    } else if (pace.quality !== pace.best) {
      this.refine = setTimeout(() => {
        this.refine = 0;
        this.changed = true;
        this.render(pace.best);
        this.changed = true; // the next one is drawn as the measured rate allows
      }, STILL);
    }
    this.report(now);
    if (this.player?.playing) this.again();
    else if (this.drawn) this.asked = requestAnimationFrame((next) => this.tick(next));
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.renderer.domElement.parentElement!;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.view.resize(clientWidth, clientHeight);
    this.plots?.resize();
    this.draw();
  }

  private report(now: number): void {
    const rate = this.drawn ? this.pace.rate(now) : 0;
    find("#rate").textContent = rate ? `${rate.toFixed(rate < 10 ? 1 : 0)} pictures/s` : "";
    find("#note").textContent = this.pace.note;
    if (this.shown.field?.key) legend(this.shown);
  }

  dispose(): void {
    cancelAnimationFrame(this.asked);
    clearTimeout(this.refine);
    this.end.abort();
    this.view.dispose();
    this.gui.destroy();
    this.stage.dispose();
    this.look.dispose();
  }
}

/** A page of a simulation: another picture for each scene that it sends. */
class LivePage {
  private page: Page | null = null;
  private controls: Controls | null = null;
  private scene: SceneMessage | null = null;
  private status: Status = { error: null, ended: false, busy: "", command: "supple view", recording: false };
  private connected = true;
  private notices = 0;
  private readonly live: Live;

  constructor(renderer: WebGLRenderer, pace: Pace) {
    let block: Block | null = null;
    this.live = new Live({
      scene: (made) => {
        block = made;
        this.scene = made.description as SceneMessage;
      },
      frame: (frame) => {
        if (block) this.show(renderer, pace, block);
        block = null;
        this.frame(frame);
      },
      status: (status) => {
        this.status = status;
        this.controls?.status(status);
        this.banner();
      },
      notice: (level, text) => this.notice(level, text),
      connected: (is) => {
        this.connected = is;
        this.banner();
      },
    });
    Object.assign(globalThis, { suppleLive: this.live });
  }

  private show(renderer: WebGLRenderer, pace: Pace, block: Block): void {
    const camera = this.page?.view.place();
    this.page?.dispose();
    const page = (this.page = new Page(renderer, pace, block, this.live, this.live));
    page.view.take(camera);
    this.controls = new Controls(page.gui, this.scene!, this.live, () => {
      page.again();
      page.render(page.pace.best);
      renderer.domElement.toBlob((blob) => blob && download("supple.png", blob));
    });
    page.done = () => this.live.send("drawn");
    Object.assign(globalThis, { supplePage: page });
  }

  private frame(frame: FrameMessage): void {
    this.controls!.frame(frame);
    this.page!.again();
    this.banner();
  }

  /** One line where something is wrong, or lasts. */
  private banner(): void {
    const { error, busy, ended, command } = this.status, element = find("#banner");
    const gone = ended || !this.connected;
    const why = ended ? `Not shown: ${error}.` : gone ? "The server has ended." : error && `The simulation has ended: ${error}`;
    const text = gone ? `${why} Start it again in a terminal: ${command}` : why || busy || this.live.latest?.slow;
    element.hidden = !text;
    if (!text) return;
    element.querySelector("span")!.textContent = text;
    const again = element.querySelector("button")!;
    again.hidden = gone || !error;
    again.onclick = () => this.live.send("restart");
  }

  private notice(level: string, text: string): void {
    const element = find("#notice");
    element.className = level;
    element.textContent = text;
    element.hidden = false;
    if (this.live.latest) this.controls?.frame(this.live.latest); // an input has its value again
    clearTimeout(this.notices);
    this.notices = setTimeout(() => (element.hidden = true), 6000);
  }
}

function say(text: string): void {
  find("#message").textContent = text;
  find("#message").hidden = false;
}

async function start(): Promise<void> {
  const data = find("#data").textContent!;
  const isLive = data.startsWith("<");
  let block: Block | null = null, motion: Motion | null = null;
  if (!isLive)
    try {
      block = new Block(await inflated(data));
      motion = new Motion(block);
    } catch {
      return say("This page is damaged: its frames cannot be read. Write it again with `supple export --to html`.");
    }
  try {
    const canvas = document.querySelector("canvas")!;
    const renderer = new WebGLRenderer({ canvas, antialias: false, powerPreference: "high-performance" });
    renderer.autoClear = false;
    const pace = new Pace(devicePixelRatio);
    if (isLive) new LivePage(renderer, pace);
    else Object.assign(globalThis, { supplePage: new Page(renderer, pace, block!, motion!, null) });
  } catch (error) {
    say(`This page cannot be shown: ${error instanceof Error ? error.message : error}`);
  }
}

void start();
