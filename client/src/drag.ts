// Bodies are pulled with the mouse or a finger; a click pins a vertex. Beside bodies, the camera turns.

import { type PerspectiveCamera, Plane, type Ray, Raycaster, Vector2, Vector3 } from "three";
import type { Live } from "./live.ts";

const STILL = 4; // pixels that a click may move

/** `hit` finds where a ray meets a body; `held` is called while one is held, so that the camera stays. */
export function addDragging(canvas: HTMLCanvasElement, camera: PerspectiveCamera, live: Live,
  signal: AbortSignal, hit: (ray: Ray) => Vector3 | null, held: (is: boolean) => void): void {
  const caster = new Raycaster(), plane = new Plane(), target = new Vector3();
  let point: Vector3 | null = null, pulls = false, begin = new Vector2();
  const aim = ({ clientX, clientY }: PointerEvent) => {
    const box = canvas.getBoundingClientRect();
    const at = new Vector2((2 * (clientX - box.left)) / box.width - 1, 1 - (2 * (clientY - box.top)) / box.height);
    caster.setFromCamera(at, camera);
  };
  // Before the camera's own handlers, which are on the canvas.
  canvas.parentElement!.addEventListener("pointerdown", (event) => {
    if (event.button !== 0 || event.target !== canvas) return;
    aim(event);
    point = hit(caster.ray);
    if (!point) return;
    plane.setFromNormalAndCoplanarPoint(camera.getWorldDirection(new Vector3()), point);
    begin.set(event.clientX, event.clientY);
    pulls = false;
    held(true);
    canvas.setPointerCapture(event.pointerId);
  }, { capture: true, signal });
  canvas.addEventListener("pointermove", (event) => {
    if (!point) return;
    if (!pulls && begin.distanceTo(new Vector2(event.clientX, event.clientY)) < STILL) return;
    aim(event);
    if (!caster.ray.intersectPlane(plane, target)) return;
    if (pulls) live.send("move", { target: target.toArray() });
    else live.send("grab", { point: point.toArray(), target: target.toArray() });
    pulls = true;
  }, { signal });
  const end = (event: PointerEvent) => {
    if (!point) return;
    if (pulls) live.send("release");
    else if (event.type === "pointerup") live.send("click", { point: point.toArray() });
    point = null;
    held(false);
  };
  for (const type of ["pointerup", "pointercancel"] as const) canvas.addEventListener(type, end, { signal });
}
