// The page: reads what it is to show, and draws when something has changed.

import { WebGLRenderer } from "three";
import { Block, inflated, Motion, type Source } from "./data.ts";
import { download, type Frame, Live, type Status } from "./live.ts";
import { Look } from "./look.ts";
import { Pace, type Quality } from "./pace.ts";
import { addBar, find, legend, Panel } from "./panel.ts";
import { Player } from "./player.ts";
import { Plots } from "./plots.ts";
import { type Shown, Stage } from "./stage.ts";
import { View } from "./view.ts";

const STILL = 400; // [ms] after which a picture that stands still is drawn with all that was left out
const SPEEDS = [0.01, 0.03, 0.1, 0.25, 0.5, 1];
const dark = matchMedia("(prefers-color-scheme: dark)");

/** The picture of one scene, of a recording or of a simulation. */
class Page {
  readonly shown: Shown = {
    surface: "skin", field: null, explode: 0, cut: 0, axis: 0, follow: -1, stitches: true, contacts: false,
  };
  stage!: Stage;
  look!: Look;
  readonly view: View;
  readonly player: Player | null = null;
  readonly panel: Panel;
  readonly gui: Panel["gui"];
  readonly pace: Pace;
  readonly plots: Plots;
  pictures = 0;
  private readonly renderer: WebGLRenderer;
  private readonly block: Block;
  private readonly source: Source;
  private asked = 0;
  private refine = 0; // the timer of a better picture
  private waits = true; // whether something has changed since the last picture
  private drawn = 0; // when that was asked of the browser [ms]
  private changed = true; // whether more than the camera has
  private sharp = 0;
  private readonly end = new AbortController();
  /** called with each picture */
  done = () => {};

  constructor(renderer: WebGLRenderer, pace: Pace, block: Block, source: Source) {
    [this.renderer, this.pace, this.block, this.source] = [renderer, pace, block, source];
    const canvas = renderer.domElement, live = source instanceof Live ? source : null, { signal } = this.end;
    this.dress();
    this.view = new View(block, canvas, live ? 260 : 0, {
      hit: (ray) => this.stage.hit(ray), moved: () => this.draw(), send: live?.send.bind(live),
    });
    this.plots = new Plots(block, (time) => this.player?.seekTime(time));
    if (source instanceof Motion) this.player = new Player(source, () => this.again(), signal);
    this.panel = new Panel(block.description, this.shown, live, {
      changed: () => this.again(), picture: () => this.save(), plotted: (plot) => this.plots.show(plot),
      fit: (view) => {
        this.view.fit(view);
        this.draw();
      },
    });
    this.gui = this.panel.gui;
    const sizes = new ResizeObserver(() => this.resize());
    sizes.observe(canvas.parentElement!);
    signal.onabort = () => sizes.disconnect();
    canvas.addEventListener("webglcontextrestored", () => this.again(), { signal });
    document.addEventListener("visibilitychange", () => (this.drawn = 0), { signal }); // a hidden page draws nothing
    dark.addEventListener("change", () => {
      this.dress();
      this.plots.show();
      this.again();
    }, { signal });
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
    const { stage, look, renderer, view } = this;
    if (quality.sharp !== this.sharp) renderer.setPixelRatio((this.sharp = quality.sharp));
    look.setQuality(quality);
    if (this.changed) {
      this.changed = false;
      stage.show(this.shown, quality.coarse);
      stage.move(this.player?.place ?? 0);
      view.follow(stage.middle(this.shown.follow));
      if (!this.player) view.include(stage.bodies);
      look.cast(renderer, stage.scene);
      this.plots.move(this.player?.time ?? Infinity);
    }
    renderer.clear();
    renderer.render(stage.scene, view.camera);
    this.pictures += 1;
  }

  dispose(): void {
    cancelAnimationFrame(this.asked);
    clearTimeout(this.refine);
    this.end.abort();
    this.view.dispose();
    this.gui.destroy();
    this.plots.show(-1);
    this.stage.dispose();
    this.look.dispose();
  }

  /** The colors of the system's theme. */
  private dress(): void {
    this.stage?.dispose();
    this.look?.dispose();
    this.look = new Look(this.block.description, dark.matches);
    this.stage = new Stage(this.block, this.source, this.look, this.shown);
  }

  /** Draws where something has changed; once more without, as that tells how long the browser took. */
  private tick(now: number): void {
    const { pace, player, drawn } = this;
    [this.asked, this.drawn] = [0, 0];
    if (player?.playing) player.advance(now);
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
    const rate = this.drawn ? pace.rate(now) : 0;
    find("#rate").textContent = rate ? `${rate.toFixed(rate < 10 ? 1 : 0)} pictures/s` : "";
    find("#note").textContent = pace.note;
    if (this.shown.field?.key) legend(this.shown.field);
    if (player?.playing) this.again();
    else if (this.drawn) this.asked = requestAnimationFrame((next) => this.tick(next));
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.renderer.domElement.parentElement!;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.view.resize(clientWidth, clientHeight);
    this.plots.resize();
    this.draw();
  }

  private save(): void {
    this.again();
    this.render(this.pace.best);
    this.renderer.domElement.toBlob((blob) => blob && download("supple.png", blob));
  }
}

/** A page of a simulation: another picture for each scene that it sends. */
class LivePage {
  private page: Page | null = null;
  private status: Status = { error: null, ended: false, busy: "", command: "supple view", recording: false };
  private connected = true;
  private notices = 0;

  constructor(renderer: WebGLRenderer, pace: Pace) {
    let block: Block | null = null;
    const live = new Live({
      scene: (made) => (block = made),
      frame: (frame) => {
        if (block) this.show(new Page(renderer, pace, block, live), live);
        block = null;
        this.frame(frame, live);
      },
      status: (status) => {
        this.status = status;
        this.page?.panel.status(status);
        this.banner(live);
      },
      notice: (level, text) => {
        const element = find("#notice");
        [element.className, element.textContent, element.hidden] = [level, text, false];
        if (live.latest) this.page?.panel.frame(live.latest); // an input has its value again
        clearTimeout(this.notices);
        this.notices = setTimeout(() => (element.hidden = true), 6000);
      },
      connected: (is) => {
        this.connected = is;
        this.banner(live);
      },
    });
    Object.assign(globalThis, { suppleLive: live });
  }

  private show(page: Page, live: Live): void {
    const camera = this.page?.view.place();
    if (!this.page)
      addBar({
        toggle: () => live.send(live.latest?.paused ? "Play" : "Pause"), step: (by) => by > 0 && live.send("Step"),
        reset: () => live.send("Reset"), speed: (factor) => live.send("SetSpeed", { factor }),
      }, SPEEDS);
    this.page?.dispose();
    this.page = page;
    page.view.take(camera);
    page.panel.status(this.status);
    page.done = () => live.send("drawn");
    Object.assign(globalThis, { supplePage: page });
  }

  private frame(frame: Frame, live: Live): void {
    const { panel, plots } = this.page!;
    plots.append(live.numbers());
    panel.frame(frame);
    this.page!.again();
  }

  /** One line where something is wrong, or lasts. */
  private banner(live: Live): void {
    const { error, busy, ended, command } = this.status, element = find("#banner"), button = find("#banner button");
    const gone = ended || !this.connected;
    const why = ended ? `Not shown: ${error}.` : gone ? "The server has ended." : error && `The simulation has ended: ${error}`;
    const text = gone ? `${why} Start it again in a terminal: ${command}` : why || busy || live.latest?.slow;
    element.hidden = !text;
    find("#banner span").textContent = text ?? "";
    button.hidden = gone || !error;
    button.onclick = () => live.send("restart");
  }
}

function say(text: string): void {
  [find("#message").textContent, find("#message").hidden] = [text, false];
}

async function start(): Promise<void> {
  const data = find("#data").textContent!, isLive = data.startsWith("<");
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
    else Object.assign(globalThis, { supplePage: new Page(renderer, pace, block!, motion!) });
  } catch (error) {
    say(`This page cannot be shown: ${error instanceof Error ? error.message : error}`);
  }
}

void start();
