// The camera: turned, moved and brought near with the mouse or fingers; at first it shows the whole scene.

import { PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Block } from "./decode.ts";

const MARGIN = 1.06;
const BAR = 70; // height of the bar below and its margins [pixels]

/**
 * The point at which a camera looks, and its distance, from which points just fill the picture.
 *
 * A point at x across and z towards the camera is in the picture where |x - t| <= slope (distance - z), with the middle
 * t: distance >= a - t / slope and distance >= b + t / slope, with the largest z + x / slope and z - x / slope. The
 * least distance is where both are equal.
 */
export function framed(points: ArrayLike<number>, center: Vector3, axes: Vector3[], slopes: number[]): [Vector3, number] {
  const most = [[-Infinity, -Infinity], [-Infinity, -Infinity]];
  const p = new Vector3(), target = center.clone();
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
  private fitted = true;
  private free = [1, 1]; // shares of width and height that panel and bar leave
  private readonly panel: number;

  /** `panel` is the width that the picture leaves free on its right [pixels]. */
  constructor(block: Block, canvas: HTMLCanvasElement, panel: number, moved: () => void) {
    this.block = block;
    this.panel = panel;
    const { up, center, radius } = block.description;
    this.camera.up.set(...up);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.minDistance = 0.05 * radius;
    this.controls.maxDistance = 30 * radius;
    this.controls.target.set(...center);
    this.controls.addEventListener("change", moved);
    this.controls.addEventListener("start", () => (this.fitted = false));
  }

  /** The picture has another size; a camera that nobody has moved shows the whole scene again, above the bar. */
  resize(width: number, height: number): void {
    this.camera.aspect = width / height;
    const panel = width >= 600 ? this.panel : 0;
    this.free = [Math.max(1 - panel / width, 0.5), Math.max(1 - BAR / height, 0.5)];
    this.camera.setViewOffset(width, height, 0.5 * panel, 0.4 * BAR, width, height);
    if (this.fitted) this.fit();
    else this.camera.updateProjectionMatrix();
  }

  /** Whether something else takes the mouse. */
  hold(is: boolean): void {
    this.controls.enabled = !is;
  }

  /** Where the camera is and looks, for another scene; null where nobody has moved it. */
  place(): Vector3[] | null {
    return this.fitted ? null : [this.camera.position.clone(), this.controls.target.clone()];
  }

  take(place: Vector3[] | null | undefined): void {
    if (!place) return;
    this.fit();
    this.fitted = false;
    this.camera.position.copy(place[0]);
    this.controls.target.copy(place[1]);
    this.controls.update();
  }

  dispose(): void {
    this.controls.dispose();
  }

  /** Shows the whole scene, as large as possible. */
  fit(): void {
    const { away, radius, outline } = this.block.description;
    const points = this.block.array(outline);
    const back = new Vector3(...away);
    const right = new Vector3().crossVectors(this.camera.up, back).normalize();
    const upward = new Vector3().crossVectors(back, right);
    const slope = Math.tan((this.camera.fov * Math.PI) / 360);
    const slopes = [slope * this.camera.aspect * this.free[0], slope * this.free[1]];
    const center = new Vector3(...this.block.description.center);
    const [target, distance] = framed(points, center, [right, upward, back], slopes);
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(back, distance);
    this.camera.near = 0.02 * radius;
    this.camera.far = distance + 40 * radius;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.fitted = true;
  }
}
