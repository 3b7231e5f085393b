// Skins follow the simulated points, lighter ones too, and stay out of obstacles; tets are apart from each other, or cut.

import type { BufferAttribute } from "three";
import type { Block, Body, Numbers, Obstacle } from "./data.ts";

/** See `Body`. */
export interface Skin {
  corners: Numbers; weights: Numbers; triangles: Numbers; rest: Numbers; outside: Numbers;
  order: number; step: number; first: number;
  beside: { axes: keyof typeof AXES; cells: Numbers; away: Numbers; count: number } | null;
}

export function skinOf(block: Block, { order, step, first, count, ...body }: Body): Skin {
  const [corners, weights, triangles, rest, outside] =
    [body.corners, body.weights, body.triangles, body.rest, body.outside].map((ref) => block.array(ref));
  const beside = body.beside &&
    { ...body.beside, cells: block.array(body.beside.cells), away: block.array(body.beside.away), count };
  return { corners, weights, triangles, rest, outside, order, step, first, beside };
}

/** Values (k, width) of a skin's vertices, of those (n, width) at all points, into `out`. */
export function follow(skin: Skin, values: Float32Array | Uint8Array, width: number, out: Float32Array): void {
  const { corners, weights, order, step, first } = skin;
  for (let c = 0, w = 0, to = 0; c < corners.length; to += width) {
    let rest = 1;
    for (let i = 0; i < width; i++) out[to + i] = 0;
    for (let j = 0; j < order; j++) {
      const weight = j < order - 1 ? step * weights[w++] : rest, from = width * (first + corners[c++]);
      rest -= weight;
      for (let i = 0; i < width; i++) out[to + i] += weight * values[from + i];
    }
  }
}

/** The axes (n, d, 3) at points x (n, 3), as `AXES` of supple.results.view.beside. */
const AXES = { normals, frames };

/** Moves vertices x (k, 3), which follow one point each of points, along the axes there. */
export function moveBeside({ beside, corners, first }: Skin, points: Float32Array, x: Float32Array): void {
  if (!beside) return;
  const { cells, away, count } = beside, d = away.length / corners.length, axes = new Float32Array(3 * d * count);
  AXES[beside.axes](points.subarray(3 * first, 3 * (first + count)), cells, axes);
  for (let k = 0; k < corners.length; k++)
    for (let j = 0; j < d; j++)
      for (let i = 0; i < 3; i++) x[3 * k + i] += away[d * k + j] * axes[3 * (d * corners[k] + j) + i];
}

/** Unit normals at vertices x (k, 3): of the triangles around each, weighted by their areas. */
export function normals(x: Float32Array, triangles: Numbers, out: Float32Array): void {
  out.fill(0);
  for (let t = 0; t < triangles.length; t += 3) {
    const a = 3 * triangles[t], b = 3 * triangles[t + 1], c = 3 * triangles[t + 2];
    const ux = x[b] - x[a], uy = x[b + 1] - x[a + 1], uz = x[b + 2] - x[a + 2];
    const vx = x[c] - x[a], vy = x[c + 1] - x[a + 1], vz = x[c + 2] - x[a + 2];
    const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    out[a] += nx; out[a + 1] += ny; out[a + 2] += nz;
    out[b] += nx; out[b + 1] += ny; out[b + 2] += nz;
    out[c] += nx; out[c + 1] += ny; out[c + 2] += nz;
  }
  for (let i = 0; i < out.length; i += 3) {
    const length = Math.hypot(out[i], out[i + 1], out[i + 2]) || 1;
    out[i] /= length; out[i + 1] /= length; out[i + 2] /= length;
  }
}

/** At the first material point of each edge (e, 4) of a rod: its frame, and from end to end, (n, 4, 3). */
export function frames(x: Float32Array, edges: Numbers, out: Float32Array): void {
  for (let k = 0; k < edges.length; k += 4) {
    const [a, b, c, d] = [0, 1, 2, 3].map((p) => Array.from(x.subarray(3 * edges[k + p], 3 * edges[k + p] + 3)));
    const e = b.map((value, i) => value - a[i]), length = Math.hypot(...e) || 1, t = e.map((value) => value / length);
    const u = c.map((value, i) => value - d[i]), along = u[0] * t[0] + u[1] * t[1] + u[2] * t[2];
    const n = u.map((value, i) => value - along * t[i]), size = Math.hypot(...n) || 1, v = n.map((value) => value / size);
    const w = [t[1] * v[2] - t[2] * v[1], t[2] * v[0] - t[0] * v[2], t[0] * v[1] - t[1] * v[0]];
    out.set([...v, ...w, ...t, ...e], 12 * edges[k + 2]);
  }
}

/** The bounds of points (k, 3): low and high, both (3,). */
export function bounds(x: ArrayLike<number>): [number[], number[]] {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < x.length; i++) {
    low[i % 3] = Math.min(low[i % 3], x[i]);
    high[i % 3] = Math.max(high[i % 3], x[i]);
  }
  return [low, high];
}

/** The same skin with at most `most` vertices: one in each cell of a grid. */
export function lighter(skin: Skin, most: number): Skin {
  const { rest, triangles, order, beside } = skin, count = rest.length / 3, [low, high] = bounds(rest);
  if (count <= most) return skin;
  const map = new Uint32Array(count), d = beside ? beside.away.length / count : 0;
  const side = (k: number) => Array.from({ length: d }, (_, j) => Math.sign(beside!.away[d * k + j])); // stay apart
  let chosen: number[] = [];
  for (let size = Math.hypot(...high.map((end, i) => end - low[i])) / Math.sqrt(most); ; size *= 1.2) {
    const cells = new Map<string, number>();
    chosen = [];
    for (let k = 0; k < count; k++) {
      const cell = [...[0, 1, 2].map((i) => Math.floor((rest[3 * k + i] - low[i]) / size)), ...side(k)].join();
      if (!cells.has(cell)) cells.set(cell, chosen.push(k) - 1);
      map[k] = cells.get(cell)!;
    }
    if (chosen.length <= most) break;
  }
  const kept: number[] = [];
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [map[triangles[t]], map[triangles[t + 1]], map[triangles[t + 2]]];
    if (a !== b && b !== c && c !== a) kept.push(a, b, c);
  }
  const of = <T extends Numbers>(values: T, width: number): T => {
    const out = new (values.constructor as new (n: number) => T)(width * chosen.length);
    chosen.forEach((k, row) => out.set(values.subarray(k * width, (k + 1) * width), row * width));
    return out;
  };
  return {
    ...skin, triangles: new Uint32Array(kept), corners: of(skin.corners, order), weights: of(skin.weights, order - 1),
    rest: of(rest, 3), outside: of(skin.outside, 1), beside: beside && { ...beside, away: of(beside.away, d) },
  };
}

/**
 * Moves the points x (k, 3) of a skin that are beyond its tets out of a solid at a pose (3, 4), by less than `reach`.
 *
 * Between the places at which the distance is known, it is linear along each axis.
 */
export function keepOut(x: Float32Array, outside: Numbers, reach: number, gap: number, pose: Numbers,
  solid: NonNullable<Obstacle["solid"]>, distances: Numbers): void {
  const { low, step, n, unit } = solid, cell = [0, 0, 0], share = [0, 0, 0], slope = [0, 0, 0], stride = [n * n, n, 1];
  for (let k = 0; k < outside.length; k++) {
    if (!outside[k]) continue;
    let inside = true, corner = 0, distance = 0;
    for (let i = 0; i < 3; i++) {
      let own = 0;
      for (let j = 0; j < 3; j++) own += pose[4 * j + i] * (x[3 * k + j] - pose[4 * j + 3]);
      const place = (own - low[i]) / step[i];
      inside &&= place >= 0 && place < n - 1;
      cell[i] = Math.floor(place);
      share[i] = place - cell[i];
      corner += cell[i] * stride[i];
      slope[i] = 0;
    }
    if (!inside) continue;
    for (let c = 0; c < 8; c++) {
      const a = c & 1, b = (c >> 1) & 1, d = c >> 2;
      const u = a ? share[0] : 1 - share[0], v = b ? share[1] : 1 - share[1], w = d ? share[2] : 1 - share[2];
      const value = unit * distances[corner + a * stride[0] + b * stride[1] + d * stride[2]];
      distance += u * v * w * value;
      slope[0] += ((a ? v : -v) * w * value) / step[0];
      slope[1] += ((b ? u : -u) * w * value) / step[1];
      slope[2] += ((d ? u : -u) * v * value) / step[2];
    }
    const missing = gap - distance, away = missing / (Math.hypot(...slope) || 1);
    if (missing <= 0 || missing >= reach) continue;
    for (let j = 0; j < 3; j++)
      for (let i = 0; i < 3; i++) x[3 * k + j] += pose[4 * j + i] * slope[i] * away;
  }
}

const FACETS = [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]; // of a tet, counter-clockwise from outside

/** Places the corners of all tets (m, 4) whose center in the first frame is below the cut; the number of corners drawn. */
export function placeTets(tets: Numbers, x: Float32Array, first: Float32Array, values: Uint8Array | null,
  { explode, axis, cut }: { explode: number; axis: number; cut: number }, position: BufferAttribute,
  value: BufferAttribute): number {
  const out = position.array, amounts = value.array, middle = [0, 0, 0];
  for (let i = 0; i < tets.length; i++)
    for (let k = 0; k < 3; k++) middle[k] += x[3 * tets[i] + k] / tets.length;
  let to = 0;
  for (let t = 0; t < tets.length; t += 4) {
    const mean = (of: Float32Array, k: number) =>
      0.25 * (of[3 * tets[t] + k] + of[3 * tets[t + 1] + k] + of[3 * tets[t + 2] + k] + of[3 * tets[t + 3] + k]);
    if (mean(first, axis) > cut) continue;
    const apart = [0, 1, 2].map((k) => explode * (mean(x, k) - middle[k]));
    for (const j of FACETS) {
      const row = tets[t + j];
      for (let k = 0; k < 3; k++) out[3 * to + k] = x[3 * row + k] + apart[k];
      amounts[to++] = values ? values[row] : 0;
    }
  }
  value.needsUpdate = true;
  return to;
}
