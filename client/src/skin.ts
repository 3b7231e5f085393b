// Skins follow the simulated points: each vertex is a weighted mean of a few of them.

import type { Block, Body, Numbers } from "./decode.ts";

export interface Skin {
  /** (k, order) rows of the points of the body */
  corners: Numbers;
  /** (k, order - 1) of all corners but the last one, whose weight is what they lack to one, in parts of `step` */
  weights: Numbers;
  triangles: Numbers;
  rest: Numbers;
  order: number;
  step: number;
  first: number;
}

export function skinOf(block: Block, body: Body): Skin {
  const { order, step, first } = body;
  const [corners, weights, triangles, rest] = [body.corners, body.weights, body.triangles, body.rest].map((ref) =>
    block.array(ref),
  );
  return { corners, weights, triangles, rest, order, step, first };
}

/** Values (k, width) of a skin's vertices, of those (n, width) at all points, into `out`. */
export function follow(skin: Skin, values: Float32Array | Uint8Array, width: number, out: Float32Array): void {
  const { corners, weights, order, step, first } = skin;
  const count = corners.length / order;
  for (let k = 0, c = 0, w = 0; k < count; k++) {
    let rest = 1;
    const last = width * (first + corners[c + order - 1]);
    const to = k * width;
    for (let i = 0; i < width; i++) out[to + i] = 0;
    for (let j = 0; j < order - 1; j++) {
      const weight = step * weights[w++];
      const from = width * (first + corners[c++]);
      rest -= weight;
      for (let i = 0; i < width; i++) out[to + i] += weight * values[from + i];
    }
    c++;
    for (let i = 0; i < width; i++) out[to + i] += rest * values[last + i];
  }
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

/** The same skin with about `most` vertices: one in each cell of a grid. */
export function lighter(skin: Skin, most: number): Skin {
  const { rest, triangles, corners, weights, order } = skin;
  const count = rest.length / 3;
  if (count <= most) return skin;
  let low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < rest.length; i++) {
    low[i % 3] = Math.min(low[i % 3], rest[i]);
    high[i % 3] = Math.max(high[i % 3], rest[i]);
  }
  let size = Math.hypot(...high.map((end, i) => end - low[i])) / Math.sqrt(most);
  for (;;) {
    const cells = new Map<string, number>();
    const chosen: number[] = [];
    const map = new Uint32Array(count);
    for (let k = 0; k < count; k++) {
      const cell = [0, 1, 2].map((i) => Math.floor((rest[3 * k + i] - low[i]) / size));
      // Both sides of a thin sheet or a crease are in one cell, and stay apart by the direction that they face.

      const key = cell.join();
      const known = cells.get(key);
      map[k] = known ?? chosen.length;
      if (known === undefined) {
        cells.set(key, chosen.length);
        chosen.push(k);
      }
    }
    if (chosen.length > most) {
      size *= 1.2;
      continue;
    }
    const kept: number[] = [];
    for (let t = 0; t < triangles.length; t += 3) {
      const [a, b, c] = [map[triangles[t]], map[triangles[t + 1]], map[triangles[t + 2]]];
      if (a !== b && b !== c && c !== a) kept.push(a, b, c);
    }
    const of = (values: Numbers, width: number, out: Numbers) => {
      chosen.forEach((k, row) => out.set(values.subarray(k * width, (k + 1) * width), row * width));
      return out;
    };
    return {
      ...skin,
      triangles: new Uint32Array(kept),
      corners: of(corners, order, new Uint32Array(order * chosen.length)),
      weights: of(weights, order - 1, new Int16Array((order - 1) * chosen.length)),
      rest: of(rest, 3, new Float32Array(3 * chosen.length)),
    };
  }
}
