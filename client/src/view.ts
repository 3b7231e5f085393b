// The camera and the pointer: turned, moved and brought near beside bodies, which are pulled, pinned and centered.

import { Box3, PerspectiveCamera, Plane, type Ray, Raycaster, Vector2, Vector3 } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Block } from "./data.ts";

const MARGIN = 1.06;
const BAR = 70; // height of the bar below and its margins [pixels]
const STILL = 4; // that a click may move [pixels]
const TWICE = 250; // in which a second click makes a double click [ms]

/** What the pointer meets, and what it does there. */
export interface Touch {
  /** Where a ray meets a body first, and the middle of this body. */
  hit(ray: Ray): { at: Vector3; middle: Vector3 } | null;
  /** Asks a simulation for something. */
  send?(act: string, values?: object): void;
  moved(): void;
}

/**
 * The point at which a camera looks, and its distance, from which points just fill the picture.
 *
 * A point at x across and z towards the camera is in the picture where |x - t| <= slope (distance - z), with the middle
 * t: distance >= a - t / slope and distance >= b + t / slope, with the largest z + x / slope and z - x / slope. The
 * least distance is where both are equal.
 */
export function framed(points: ArrayLike<number>, center: Vector3, axes: Vector3[], slopes: number[]): [Vector3, number] {
  const most = [[-Infinity, -Infinity], [-Infinity, -Infinity]], p = new Vector3(), target = center.clone();
  for (let i = 0; i < points.length; i += 3) {
    p.set(points[i], points[i + 1], points[i + 2]).sub(center);
    const [x, y, z] = axes.map((axis) => p.dot(axis));
    [x, y].forEach((across, k) => {
      most[k][0] = Math.max(most[k][0], z + across / slopes[k]);
      most[k][1] = Math.max(most[k][1], z - across / slopes[k]);
    });
  }
  most.forEach(([a, b], k) => target.addScaledVector(axes[k], 0.5 * slopes[k] * (a - b)));
  return [target, MARGIN * Math.max(...most.map(([a, b]) => 0.5 * (a + b)), 1e-6)];
}

export class View {
  readonly camera = new PerspectiveCamera(35, 1, 0.01, 100);
  private readonly controls: OrbitControls;
  private readonly block: Block;
  private readonly panel: number;
  private fitted: string | null = "fit"; // the view that shows the whole scene, until somebody moves the camera
  private free = [1, 1]; // shares of width and height that panel and bar leave
  private followed: Vector3 | null = null;
  private seen: Box3; // all that was to be seen since the start
  private readonly end = new AbortController();

  /** `panel` is the width that the picture leaves free on its right [pixels]. */
  constructor(block: Block, canvas: HTMLCanvasElement, panel: number, touch: Touch) {
    [this.block, this.panel] = [block, panel];
    const { up, center, radius } = block.description;
    this.seen = new Box3().setFromArray(block.array(block.description.outline));
    this.camera.up.set(...up);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.minDistance = 0.05 * radius;
    this.controls.maxDistance = 30 * radius;
    this.controls.target.set(...center);
    this.controls.addEventListener("change", () => touch.moved());
    this.controls.addEventListener("start", () => (this.fitted = null));
    this.listen(canvas, touch);
  }

  /** The picture has another size; a camera that nobody has moved shows the whole scene again, above the bar. */
  resize(width: number, height: number): void {
    this.camera.aspect = width / height;
    const panel = width >= 600 ? this.panel : 0;
    this.free = [Math.max(1 - panel / width, 0.5), Math.max(1 - BAR / height, 0.5)];
    this.camera.setViewOffset(width, height, 0.5 * panel, 0.4 * BAR, width, height);
    if (this.fitted) this.fit(this.fitted);
    else this.camera.updateProjectionMatrix();
  }

  /** Where the camera is and looks, for another scene; null where nobody has moved it. */
  place(): Vector3[] | null {
    return this.fitted ? null : [this.camera.position.clone(), this.controls.target.clone()];
  }

  take(place: Vector3[] | null | undefined): void {
    if (!place) return;
    this.fit();
    this.moveBy(place[1].clone().sub(this.controls.target));
    this.camera.position.copy(place[0]);
    this.controls.update();
  }

  /** Shows the whole scene, as large as possible, from one of the described directions. */
  fit(name = "fit"): void {
    const { views, radius, outline, up, center } = this.block.description, back = new Vector3(...views[name]);
    const right = new Vector3(...up).cross(back).normalize(), upward = back.clone().cross(right);
    const slope = Math.tan((this.camera.fov * Math.PI) / 360);
    const slopes = [slope * this.camera.aspect * this.free[0], slope * this.free[1]];
    const middle = new Vector3(...center), { min, max } = this.seen;
    // The bounds where bodies have left those of the start.
    const first = this.block.array(outline), left = !new Box3().setFromArray(first).containsBox(this.seen);
    const corners = [min, max].flatMap((a) => [min, max].flatMap((b) => [min, max].flatMap((c) => [a.x, b.y, c.z])));
    const points = left ? corners : first;
    const [target, distance] = framed(points, middle, [right, upward, back], slopes);
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(back, distance);
    this.camera.near = 0.02 * radius;
    this.camera.far = distance + 40 * radius;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.fitted = name;
  }

  /** Shows also where bodies have gone, at most five times as far, unless somebody has moved the camera. */
  include(points: Float32Array): void {
    const { center, radius } = this.block.description, most = new Vector3().setScalar(5 * radius);
    const now = new Box3().setFromArray(points), farthest = new Box3().setFromCenterAndSize(new Vector3(...center), most);
    now.intersect(farthest);
    // Neither one that is held nor one that gets a little wider moves the picture.
    if (!this.fitted || !this.controls.enabled || now.isEmpty() || this.seen.clone().expandByScalar(0.15 * radius).containsBox(now)) return;
    this.seen.union(now.expandByScalar(0.1 * radius)).intersect(farthest.expandByScalar(0.1 * radius));
    this.fit(this.fitted);
  }

  /** Moves with a point that moves; null ends that. */
  follow(middle: Vector3 | null): void {
    if (middle && this.followed) this.moveBy(middle.clone().sub(this.followed));
    this.followed = middle;
  }

  dispose(): void {
    this.end.abort();
    this.controls.dispose();
  }

  private moveBy(by: Vector3): void {
    if (by.lengthSq() === 0) return;
    this.fitted = null;
    this.camera.position.add(by);
    this.controls.target.add(by);
    this.controls.update();
  }

  private listen(canvas: HTMLCanvasElement, touch: Touch): void {
    const caster = new Raycaster(), plane = new Plane(), target = new Vector3(), { signal } = this.end;
    let held: Vector3 | null = null, pulls = false, begin = new Vector2(), click = 0;
    const aim = ({ clientX, clientY }: PointerEvent) => {
      const box = canvas.getBoundingClientRect();
      const at = new Vector2((2 * (clientX - box.left)) / box.width - 1, 1 - (2 * (clientY - box.top)) / box.height);
      caster.setFromCamera(at, this.camera);
    };
    // Before the camera's own handlers, which are on the canvas.
    canvas.parentElement!.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || event.target !== canvas) return;
      aim(event);
      const hit = touch.hit(caster.ray), isSecond = event.timeStamp - click < TWICE;
      clearTimeout(this.click);
      click = event.timeStamp;
      if (hit && isSecond) this.moveBy(hit.middle.sub(this.controls.target));
      if (!hit || isSecond || !touch.send) return;
      held = hit.at;
      plane.setFromNormalAndCoplanarPoint(this.camera.getWorldDirection(new Vector3()), held);
      begin.set(event.clientX, event.clientY);
      pulls = this.controls.enabled = false;
      canvas.setPointerCapture(event.pointerId);
    }, { capture: true, signal });
    canvas.addEventListener("pointermove", (event) => {
      if (!held || (!pulls && begin.distanceTo(new Vector2(event.clientX, event.clientY)) < STILL)) return;
      aim(event);
      if (!caster.ray.intersectPlane(plane, target)) return;
      touch.send!(pulls ? "move" : "grab", { target: target.toArray(), ...(pulls ? {} : { point: held.toArray() }) });
      pulls = true;
    }, { signal });
    const end = ({ type }: PointerEvent) => {
      const point = held?.toArray();
      if (pulls) touch.send!("release");
      // It waits for what may be a double click.
      else if (point && type === "pointerup") this.click = setTimeout(() => touch.send!("click", { point }), TWICE);
      held = null;
      pulls = false;
      this.controls.enabled = true;
    };
    for (const type of ["pointerup", "pointercancel"] as const) canvas.addEventListener(type, end, { signal });
  }

  private click = 0; // the timer of a click
}
