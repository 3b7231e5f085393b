// The panel: what is shown, and the legend of a field.

import GUI from "lil-gui";
import { gradient } from "./colors.ts";
import type { Description } from "./decode.ts";
import type { Shown } from "./scene.ts";

export interface Actions {
  changed(): void;
  plotted(plot: number): void;
  fit(): void;
}

export function addPanel(description: Description, shown: Shown, live: boolean, actions: Actions): GUI {
  const top = new GUI({ title: description.title, width: 250 });
  const gui = live ? top.addFolder("View") : top;
  const { fields, plots, bodies, stitches } = description;
  const plain = { color: -1, plot: -1, fit: () => actions.fit() };
  const soft = bodies.some((body) => body.tets[1] > 0);
  const update = () => {
    for (const item of [explode, cut, axis]) item.show(shown.surface === "tets");
    actions.changed();
  };
  const surface = gui.add(shown, "surface", { skin: "skin", tets: "tets" }).name("bodies as").onChange(update);
  const cut = gui.add(shown, "cut", 0, 1, 0.01).name("cut").onChange(update);
  const axis = gui.add(shown, "axis", { x: 0, y: 1, z: 2 }).name("cut along").onChange(update);
  const explode = gui.add(shown, "explode", 0, 1, 0.01).name("explode").onChange(update);
  const named = Object.fromEntries(fields.map((field, k) => [`${field.name}${field.unit && ` [${field.unit}]`}`, k]));
  const colors = gui.add(plain, "color", { body: -1, ...named }).name("color").onChange((k: number) => {
    shown.field = fields[k] ?? null;
    legend(shown);
    update();
  });
  const lines = gui.add(shown, "stitches").onChange(update).show(stitches[1] > 0);
  const contacts = gui.add(shown, "contacts").onChange(update).show(live);
  const titles = Object.fromEntries(plots.map((plot, k) => [plot.title, k]));
  const plot = gui.add(plain, "plot", { none: -1, ...titles }).onChange(actions.plotted).show(plots.length > 0);
  gui.add(plain, "fit").name("camera to the start");
  if (!soft) for (const item of [surface, colors]) item.hide();
  for (const item of [explode, cut, axis]) item.hide();
  const names = { surface, cut, axis, explode, color: colors, stitches: lines, contacts, plot };
  for (const [name, item] of Object.entries(names)) item.domElement.dataset.name = name;
  if (innerWidth < 600) top.close();
  return top;
}

/** The colors of the field that is shown, with the values at both ends. */
export function legend({ field }: Shown): void {
  const element = document.querySelector<HTMLElement>("#legend")!;
  element.hidden = field === null;
  if (!field) return;
  const [low, high] = field.ends.map((end) => Number(end.toPrecision(3)).toString());
  element.querySelector(".name")!.textContent = field.name + (field.unit && ` [${field.unit}]`);
  element.querySelector<HTMLElement>(".bar")!.style.background = gradient(field.colors);
  element.querySelector(".low")!.textContent = low;
  element.querySelector(".high")!.textContent = high;
}
