// Tets as four flat triangles each: apart from each other, or cut open.

import type { BufferAttribute } from "three";
import type { Block, Body, Numbers } from "./decode.ts";

export interface Tets {
  /** (count, 4) rows of all points */
  corners: Numbers;
  count: number;
}

const FACETS = [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]; // counter-clockwise from outside

export function tetsOf(block: Block, body: Body): Tets {
  const [first, count] = body.tets;
  return { corners: block.array(block.description.tets).subarray(4 * first, 4 * (first + count)), count };
}

/** Places the corners of all tets whose center in the first frame is below the cut; the number of corners drawn. */
export function placeTets(tets: Tets, x: Float32Array, first: Float32Array, values: Uint8Array | null,
  how: { explode: number; axis: number }, cut: number, position: BufferAttribute, value: BufferAttribute): number {
  const { corners, count } = tets;
  const middle = [0, 0, 0];
  for (let i = 0; i < corners.length; i++)
    for (let axis = 0; axis < 3; axis++) middle[axis] += x[3 * corners[i] + axis] / corners.length;
  const apart = how.explode, out = position.array as Float32Array, amounts = value.array as Float32Array;
  const center = [0, 0, 0];
  let to = 0;
  for (let t = 0; t < count; t++) {
    const a = 4 * t;
    let place = 0;
    for (let j = 0; j < 4; j++) place += 0.25 * first[3 * corners[a + j] + how.axis];
    if (place > cut) continue;
    for (let axis = 0; axis < 3; axis++) {
      center[axis] = 0;
      for (let j = 0; j < 4; j++) center[axis] += 0.25 * x[3 * corners[a + j] + axis];
    }
    for (const j of FACETS) {
      const row = corners[a + j];
      for (let axis = 0; axis < 3; axis++)
        out[3 * to + axis] = x[3 * row + axis] + apart * (center[axis] - middle[axis]);
      amounts[to++] = values ? values[row] : 0;
    }
  }
  value.needsUpdate = true;
  return to;
}
