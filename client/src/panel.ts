// The panel: what is shown; bodies, solver, measures and record of a simulation; the legend; and the bar of time below.

import GUI, { type Controller } from "lil-gui";
import type { Description, Field, Parameter } from "./data.ts";
import type { Frame, Live, Status, Values } from "./live.ts";
import type { Shown } from "./stage.ts";

export const find = <T extends HTMLElement = HTMLElement>(selector: string) => document.querySelector<T>(selector)!;

const ALL = "all bodies";
// Of matplotlib's scales, evenly spaced: from dark to bright, and red over white to blue where a field has a middle value.
const STOPS: Record<string, string> = {
  viridis: "440154 482878 3e4989 31688e 26828e 1f9e89 35b779 6ece58 b5de2b fde725",
  RdBu: "67001f b2182b d6604d f4a582 fddbc7 f7f7f7 d1e5f0 92c5de 4393c3 2166ac 053061",
};

/** The colors of a scale, each three numbers from 0 to 255. */
export function stops(name: string): number[][] {
  return STOPS[name].split(" ").map((hex) => [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16)));
}

/** The colors of the field that is shown, with the values at both ends. */
export function legend(field: Field | null): void {
  find("#legend").hidden = field === null;
  if (!field) return;
  find("#legend .name").textContent = nameOf(field);
  find("#legend .bar").style.background = `linear-gradient(to right, ${stops(field.colors).map((c) => `rgb(${c.join()})`)})`;
  ["low", "high"].forEach((end, k) => (find(`#legend .${end}`).textContent = `${Number(field.ends[k].toPrecision(3))}`));
}

const nameOf = ({ name, unit }: Field) => name + (unit && ` [${unit}]`);

/** Whose time the bar shows. */
export interface Clock { toggle(): void; step(by: number): void; reset(): void; speed(factor: number): void }

export function addBar(clock: Clock, speeds: number[], signal?: AbortSignal): void {
  const speed = find<HTMLSelectElement>("#speed");
  speed.replaceChildren(...speeds.map((one) => new Option(`${one} ×`, `${one}`)));
  speed.onchange = () => {
    clock.speed(Number(speed.value));
    speed.blur(); // the next keys are for the page
  };
  const acts: [string, string, () => void][] = [
    ["#play", " ", clock.toggle], ["#step", "n", () => clock.step(1)], ["#reset", "r", clock.reset],
    ["", "arrowright", () => clock.step(1)], ["", "arrowleft", () => clock.step(-1)],
  ];
  for (const [id, , act] of acts) if (id) find(id).onclick = act;
  document.addEventListener("keydown", (event) => {
    const { target, ctrlKey, metaKey } = event, act = acts.find(([, key]) => key === event.key.toLowerCase())?.[2];
    if (!act || ctrlKey || metaKey || (target instanceof HTMLInputElement && target.type !== "range")) return;
    event.preventDefault();
    act();
  }, { signal });
  find("#bar").hidden = false;
}

export function showTime(playing: boolean, time: number, speed: number): void {
  const select = find<HTMLSelectElement>("#speed"), button = find("#play");
  button.textContent = playing ? "❚❚" : "▶";
  button.title = playing ? "pause (space)" : "play (space)";
  find("#now").textContent = `${time.toFixed(3)} s`;
  if (![...select.options].some(({ value }) => value === `${speed}`)) select.add(new Option(`${speed} ×`, `${speed}`));
  select.value = `${speed}`;
}

/** What the panel asks of the page. */
export interface Actions { changed(): void; plotted(plot: number): void; fit(view: string): void; picture(): void }

export class Panel {
  readonly gui: GUI;
  private readonly description: Description;
  private readonly live: Live | null;
  private readonly plain = { plot: -1, body: ALL, solver: "xpbd" };
  private readonly inputs: { item: Controller; now: (frame: Frame) => number | boolean }[] = [];
  private readonly folders: Record<string, GUI> = {};
  private readonly measures = document.createElement("pre");
  private record: Controller | null = null;
  private recording = false;
  private kinds = "";

  constructor(description: Description, shown: Shown, live: Live | null, actions: Actions) {
    [this.description, this.live] = [description, live];
    const top = (this.gui = new GUI({ title: description.title, width: 250 }));
    if (innerWidth < 600) top.close();
    const { bodies, fields, plots, stitches } = description, { plain } = this;
    const soft = bodies.some((body) => body.tets[1] > 0), tets = () => shown.surface === "tets";
    const numbered = (items: string[], none: string) => Object.fromEntries([[none, -1], ...items.map((name, k) => [name, k])]);
    const named = Object.fromEntries([["body", null], ...fields.map((field) => [nameOf(field), field])]);
    const names = bodies.map((body) => body.name);
    // Each input: where its value is, its label, its range or choices, and where it is there.
    const rows: [object, string, string, unknown[], (() => boolean) | boolean][] = [
      [shown, "surface", "bodies as", [["skin", "tets"]], soft],
      [shown, "cut", "cut", [0, 1, 0.01], tets],
      [shown, "axis", "cut along", [{ x: 0, y: 1, z: 2 }], tets],
      [shown, "explode", "explode", [0, 1, 0.01], tets],
      [shown, "field", "color", [named], soft],
      [shown, "stitches", "stitches", [], stitches[1] > 0],
      [shown, "contacts", "contacts", [], live !== null],
      [shown, "follow", "camera follows", [numbered(names, "nothing")], true],
      [plain, "plot", "plot", [numbered(plots.map(({ title }) => title), "none")], plots.length > 0],
    ];
    const view = (this.folders.view = live ? top.addFolder("View") : top);
    const show = () => items.forEach((item, k) => item.show(typeof rows[k][4] === "function" ? rows[k][4]() : rows[k][4]));
    const items = rows.map(([object, property, label, more]) =>
      this.add(view, object, property, label, more).onChange(() => {
        if (property === "plot") return actions.plotted(plain.plot);
        show();
        legend(shown.field);
        live?.send("view", { field: shown.field?.key ?? null, contacts: shown.contacts });
        actions.changed();
      }));
    show();
    this.buttons(view, Object.keys(description.views), actions.fit);
    if (live) this.addLive(live, names, actions);
  }

  /** Shows what a frame tells. */
  frame(frame: Frame): void {
    showTime(!frame.paused, frame.time, frame.speed);
    this.measures.textContent = [...(frame.paused ? [] : [frame.rate]), ...frame.measures].join("\n");
    const kinds = [frame.solver, ...Object.keys(this.body(frame)), ...Object.keys(frame.values)].join();
    if (kinds !== this.kinds) this.fill(frame, kinds);
    for (const { item, now } of this.inputs) {
      if (item.domElement.contains(document.activeElement) || item.getValue() === now(frame)) continue;
      item.object[item.property as never] = now(frame) as never;
      item.updateDisplay();
    }
  }

  status({ recording }: Status): void {
    this.recording = recording;
    this.record?.name(recording ? "stop, and get the page" : "record a page");
  }

  private add(folder: GUI, object: object, property: string, label: string, more: unknown[] = []): Controller {
    const item = folder.add(object, property as never, ...(more as [])).name(label);
    item.domElement.dataset.name = property;
    return item;
  }

  private button(folder: GUI, label: string, act: () => void): Controller {
    return this.add(folder, { act }, "act", label);
  }

  /** A row of buttons. */
  private buttons(folder: GUI, names: string[], act: (name: string) => void): void {
    const row = document.createElement("div");
    row.className = "row";
    for (const name of names) {
      const button = row.appendChild(document.createElement("button"));
      [button.textContent, button.title, button.onclick] = [name, `view: ${name}`, () => act(name)];
    }
    folder.$children.append(row);
  }

  private addLive(live: Live, names: string[], actions: Actions): void {
    const { gui, folders, plain } = this;
    for (const name of ["Bodies", "Solver", "Measures", "Record"]) folders[name.toLowerCase()] = gui.addFolder(name);
    this.add(folders.bodies, plain, "body", "body", [[ALL, ...names]]).onChange(() => (this.kinds = ""));
    this.button(folders.bodies, "unpin all", () => live.send("Unpin"));
    this.add(folders.solver, plain, "solver", "kind", [["xpbd", "implicit"]])
      .onChange((kind: string) => live.send("SetSolver", { kind }));
    folders.measures.$children.append(this.measures);
    this.button(folders.record.close(), "picture", actions.picture);
    this.record = this.button(folders.record, "", () => live.send("record", { on: !this.recording }));
    if (this.description.reload) this.button(gui, "reload the file", () => live.send("reload"));
  }

  /** The values of the chosen body; of all bodies, those of the first one that has each. */
  private body(frame: Frame): Values {
    const number = this.description.bodies.findIndex((body) => body.name === this.plain.body);
    return number < 0 ? Object.assign({}, ...[...frame.bodies].reverse()) : frame.bodies[number];
  }

  /** Makes the inputs of the parameters that a solver and a body have. */
  private fill(frame: Frame, kinds: string): void {
    this.kinds = kinds;
    for (const { item } of this.inputs.splice(0)) item.destroy();
    this.plain.solver = frame.solver;
    this.folders.solver.controllers[0].updateDisplay();
    for (const parameter of this.description.parameters!) {
      if (parameter.name in frame.values) this.addInput("solver", parameter, (now) => now.values);
      if (parameter.name in this.body(frame)) this.addInput("bodies", parameter, (now) => this.body(now));
    }
  }

  private addInput(folder: string, { name, label, factor, whole }: Parameter, of: (frame: Frame) => Values): void {
    const now = (frame: Frame) => {
      const value = of(frame)[name];
      return typeof value === "number" ? Number((value / factor).toPrecision(6)) : value;
    };
    const item = this.add(this.folders[folder], { [name]: now(this.live!.latest!) }, name, label);
    item.onFinishChange((value: number | boolean) => {
      const body = folder === "bodies" && this.plain.body !== ALL ? this.plain.body : null;
      const number = typeof value === "number" ? value * factor : value;
      this.live!.send("SetParameter", { name, value: whole ? Math.round(Number(number)) : number, body });
    });
    this.inputs.push({ item, now });
  }
}
