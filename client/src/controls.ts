// The panel of a simulation: bodies, solver, measures, record; and the bar of time below.

import type GUI from "lil-gui";
import type { Controller } from "lil-gui";
import type { FrameMessage, Live, Parameter, SceneMessage, Status, Values } from "./live.ts";

const SPEEDS = [0.01, 0.03, 0.1, 0.25, 0.5, 1];
const ALL = "all bodies";
const element = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

export class Controls {
  private readonly live: Live;
  private readonly scene: SceneMessage;
  private readonly chosen = { body: ALL, solver: "xpbd", recording: false };
  private readonly inputs: { controller: Controller; now: (frame: FrameMessage) => number | boolean }[] = [];
  private readonly folders: Record<"bodies" | "solver", GUI>;
  private readonly solver: Controller;
  private readonly record: Controller;
  private readonly measures = document.createElement("pre");
  private kinds = "";

  constructor(gui: GUI, scene: SceneMessage, live: Live, picture: () => void) {
    [this.scene, this.live] = [scene, live];
    this.folders = { bodies: gui.addFolder("Bodies"), solver: gui.addFolder("Solver") };
    const names = [ALL, ...scene.bodies.map((body) => body.name)];
    const body = this.folders.bodies.add(this.chosen, "body", names).onChange(() => (this.kinds = ""));
    this.folders.bodies.add({ unpin: () => live.send("Unpin") }, "unpin").name("unpin all");
    this.solver = this.folders.solver.add(this.chosen, "solver", ["xpbd", "implicit"]).name("kind")
      .onChange((kind: string) => live.send("SetSolver", { kind }));
    const measures = gui.addFolder("Measures");
    measures.$children.append(this.measures);
    const more = gui.addFolder("Record").close();
    more.add({ picture }, "picture").name("picture");
    this.record = more.add({ record: () => live.send("record", { on: !this.chosen.recording }) }, "record");
    if (scene.reload) gui.add({ reload: () => live.send("reload") }, "reload").name("reload the file");
    for (const [name, item] of Object.entries({ body, solver: this.solver })) item.domElement.dataset.name = name;
    this.bar();
  }

  /** Shows what a frame tells. */
  frame(frame: FrameMessage): void {
    element("play").textContent = frame.paused ? "▶" : "❚❚";
    element("play").title = frame.paused ? "play (space)" : "pause (space)";
    element("now").textContent = `${frame.time.toFixed(3)} s`;
    const speed = element<HTMLSelectElement>("speed");
    if (![...speed.options].some((option) => Number(option.value) === frame.speed))
      speed.add(new Option(`${frame.speed} ×`, String(frame.speed)));
    speed.value = String(frame.speed);
    this.measures.textContent = [...(frame.paused ? [] : [frame.rate]), ...frame.measures].join("\n");
    const body = this.body(frame);
    const kinds = [frame.solver, ...Object.keys(body), ...Object.keys(frame.values)].join();
    if (kinds !== this.kinds) this.fill(frame, kinds);
    for (const { controller, now } of this.inputs) {
      if (controller.domElement.contains(document.activeElement) || controller.getValue() === now(frame)) continue;
      controller.object[controller.property as never] = now(frame) as never;
      controller.updateDisplay();
    }
  }

  status({ recording }: Status): void {
    this.chosen.recording = recording;
    this.record.name(recording ? "stop, and get the page" : "record a page");
  }

  /** The values of the chosen body; of all bodies, those of the first one that has each. */
  private body(frame: FrameMessage): Values {
    const number = this.scene.bodies.findIndex((body) => body.name === this.chosen.body);
    return number < 0 ? Object.assign({}, ...[...frame.bodies].reverse()) : frame.bodies[number];
  }

  /** Makes the inputs of the parameters that a solver and a body have. */
  private fill(frame: FrameMessage, kinds: string): void {
    this.kinds = kinds;
    for (const { controller } of this.inputs.splice(0)) controller.destroy();
    this.chosen.solver = frame.solver;
    this.solver.updateDisplay();
    for (const parameter of this.scene.parameters) {
      if (parameter.name in frame.values) this.add("solver", parameter, (now) => now.values);
      if (parameter.name in this.body(frame)) this.add("bodies", parameter, (now) => this.body(now));
    }
  }

  private add(folder: "bodies" | "solver", parameter: Parameter, of: (frame: FrameMessage) => Values): void {
    const { name, label, factor, whole } = parameter;
    const now = (frame: FrameMessage) => {
      const value = of(frame)[name];
      return typeof value === "number" ? Number((value / factor).toPrecision(6)) : value;
    };
    const controller = this.folders[folder].add({ [name]: now(this.live.latest!) }, name).name(label);
    controller.onFinishChange((value: number | boolean) => {
      const body = folder === "bodies" && this.chosen.body !== ALL ? this.chosen.body : null;
      const number = typeof value === "number" ? value * factor : value;
      this.live.send("SetParameter", { name, value: whole ? Math.round(Number(number)) : number, body });
    });
    controller.domElement.dataset.name = name;
    this.inputs.push({ controller, now });
  }

  private bar(): void {
    element("bar").hidden = false;
    element("time").hidden = true;
    const toggle = () => this.live.send(this.live.latest?.paused ? "Play" : "Pause");
    const acts: Record<string, () => void> = {
      play: toggle, step: () => this.live.send("Step"), reset: () => this.live.send("Reset"),
    };
    for (const [id, act] of Object.entries(acts)) {
      element(id).hidden = false;
      element(id).onclick = act;
    }
    const speed = element<HTMLSelectElement>("speed");
    speed.replaceChildren(...SPEEDS.map((one) => new Option(`${one} ×`, String(one))));
    speed.onchange = () => {
      this.live.send("SetSpeed", { factor: Number(speed.value) });
      speed.blur();
    };
    document.onkeydown = (event) => {
      if (event.target instanceof HTMLInputElement) return;
      const act = { " ": toggle, n: acts.step, r: acts.reset }[event.key.toLowerCase()];
      if (!act || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      act();
    };
  }
}
