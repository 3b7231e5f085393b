import assert from "node:assert/strict";
import { test } from "node:test";
import { Vector3 } from "three";
import { Block, inflated, summed } from "../src/data.ts";
import { Pace } from "../src/pace.ts";
import { follow, frames, keepOut, lighter, moveBeside, normals, placeTets, type Skin } from "../src/shape.ts";
import { framed } from "../src/view.ts";

/** A sphere of triangles, each vertex of which follows a point of its own and, with weight 1/4, the first one. */
function sphere(rings: number): Skin {
  const rest: number[] = [], triangles: number[] = [];
  for (let i = 0; i <= rings; i++)
    for (let j = 0; j < 2 * rings; j++) {
      const [a, b] = [(Math.PI * i) / rings, (Math.PI * j) / rings];
      rest.push(Math.sin(a) * Math.cos(b), Math.cos(a), -Math.sin(a) * Math.sin(b));
      const [right, down] = [i * 2 * rings + ((j + 1) % (2 * rings)), 2 * rings];
      const at = i * 2 * rings + j;
      if (i < rings) triangles.push(at, at + down, right, right, at + down, right + down);
    }
  const count = rest.length / 3;
  return {
    corners: Uint32Array.from({ length: 2 * count }, (_, k) => (k % 2 ? k >> 1 : 0)),
    weights: new Int16Array(count).fill(8192), step: 0.25 / 8192, order: 2, first: 0,
    triangles: Uint32Array.from(triangles), rest: Float32Array.from(rest), outside: new Uint8Array(count).fill(1), beside: null,
  };
}

test("a camera shows all points, as near as it can", () => {
  const corners = [0.1, -0.1].flatMap((x) => [0.1, 0.3].flatMap((y) => [0.1, -0.1].map((z) => [x, y, z])));
  const points = Float32Array.from([...corners, [0, 0, 0]].flat()); // a box above a point of the floor
  const back = new Vector3(0.45, 0.5, 0.84).normalize();
  const right = new Vector3().crossVectors(new Vector3(0, 1, 0), back).normalize();
  const axes = [right, new Vector3().crossVectors(back, right), back], slopes = [0.37, 0.29];
  const [target, distance] = framed(points, new Vector3(0, 0.15, 0), axes, slopes);
  let widest = 0;
  for (let i = 0; i < points.length; i += 3) {
    const p = new Vector3(points[i], points[i + 1], points[i + 2]).sub(target);
    const [x, y, z] = axes.map((axis) => p.dot(axis));
    widest = Math.max(widest, Math.abs(x) / slopes[0] / (distance - z), Math.abs(y) / slopes[1] / (distance - z));
  }
  assert.ok(widest < 1 && widest > 0.9, `${widest}`);
});

test("differences are summed over frames", () => {
  // 5, 70000 mod 2^16, then -3 and +2 against the frame before: folded as 5 -> 10, -3 -> 5, +2 -> 4
  const folded = [10, 2 * 300, 5, 4];
  const bytes = Uint8Array.from([...folded.map((x) => x >> 8), ...folded.map((x) => x & 255)]);
  assert.deepEqual([...summed(bytes, 2, 2, 2)], [5, 300, 2, 302]);
  assert.deepEqual([...summed(Uint8Array.from([10, 5, 4]), 3, 1, 1)], [5, 2, 4]);
  for (const width of [1, 2] as const) assert.throws(() => summed(bytes, 3, 2, width), /incomplete/);
});

test("a block gives its arrays, and damaged ones are refused", async () => {
  const json = JSON.stringify({ ref: { type: "i2", at: 8, count: 2 } });
  const text = new TextEncoder().encode(json.padEnd(8 * Math.ceil((4 + json.length) / 8) - 4));
  const bytes = new Uint8Array(4 + text.length + 16);
  new DataView(bytes.buffer).setUint32(0, text.length, true);
  bytes.set(text, 4);
  new DataView(bytes.buffer).setInt16(4 + text.length + 8, -7, true);
  const packed = new Blob([bytes]).stream().pipeThrough(new CompressionStream("deflate"));
  const base64 = Buffer.from(await new Response(packed).arrayBuffer()).toString("base64");
  const block = new Block(await inflated(`\n${base64}\n`));
  const ref = (block.description as unknown as { ref: Parameters<Block["array"]>[0] }).ref;
  assert.deepEqual([...block.array(ref)], [-7, 0]);
  assert.throws(() => block.array({ ...ref, count: 99 }));
  await assert.rejects(inflated(base64.slice(0, 40)));
  await assert.rejects(inflated("no base64 ?"));
});

test("a skin follows its points, and moves with them", () => {
  const skin = sphere(6);
  const out = new Float32Array(skin.rest.length);
  follow(skin, skin.rest as Float32Array, 3, out);
  for (let k = 0; k < out.length; k++) {
    const expected = 0.25 * skin.rest[k % 3] + 0.75 * skin.rest[k];
    assert.ok(Math.abs(out[k] - expected) < 1e-6);
  }
  const moved = new Float32Array(out.length);
  follow(skin, (skin.rest as Float32Array).map((x) => x + 100), 3, moved);
  for (let k = 0; k < out.length; k++) assert.ok(Math.abs(moved[k] - out[k] - 100) < 1e-4);
});

test("normals of a sphere point outwards", () => {
  const { rest, triangles } = sphere(12);
  const out = new Float32Array(rest.length);
  normals(rest as Float32Array, triangles, out);
  for (let k = 3 * 24; k < rest.length - 3 * 24; k += 3)
    assert.ok(out[k] * rest[k] + out[k + 1] * rest[k + 1] + out[k + 2] * rest[k + 2] > 0.98);
});

test("a lighter skin is closed, has about as many vertices as asked, and follows the same points", () => {
  const skin = sphere(40);
  const light = lighter(skin, 400);
  const count = light.rest.length / 3;
  assert.ok(count <= 400 && count > 150, `${count}`);
  assert.equal(light.corners.length, 2 * count);
  assert.equal(light.weights.length, count);
  assert.equal(light.outside.length, count);
  const edges = new Map<string, number>();
  for (let t = 0; t < light.triangles.length; t++) {
    const [a, b] = [light.triangles[t], light.triangles[t % 3 === 2 ? t - 2 : t + 1]];
    assert.ok(a < count && a !== b);
    edges.set(`${a} ${b}`, (edges.get(`${a} ${b}`) ?? 0) + 1);
    edges.set(`${b} ${a}`, (edges.get(`${b} ${a}`) ?? 0) - 1);
  }
  assert.ok([...edges.values()].every((sum) => sum === 0), "an edge has one side only");
  for (let k = 0; k < count; k++)
    assert.deepEqual([0, 1, 2].map((i) => light.rest[3 * k + i]),
      [0, 1, 2].map((i) => skin.rest[3 * light.corners[2 * k + 1] + i]));
  assert.equal(lighter(light, 400), light);
});

test("both sides of a sheet are half its thickness away, also of a lighter one", () => {
  const points = sphere(12).rest as Float32Array, n = points.length / 3, { triangles } = sphere(12);
  const corners = Uint32Array.from({ length: 2 * n }, (_, k) => k % n), away = new Float32Array(2 * n).fill(0.1, 0, n).fill(-0.1, n);
  const beside = { axes: "normals" as const, cells: triangles, away, count: n };
  const both = Uint32Array.from([...triangles, ...triangles.map((_, t) => n + triangles[t - (t % 3) + 2 - (t % 3)])]);
  const rest = Float32Array.from([...points, ...points]);
  const sheet: Skin = { corners, weights: new Int16Array(0), step: 1, order: 1, first: 1, triangles: both, rest,
    outside: new Uint8Array(2 * n), beside };
  const moved = Float32Array.from([9, 9, 9, ...points]); // its points begin with the second one
  for (const skin of [sheet, lighter(sheet, 200)]) {
    const count = skin.corners.length, x = new Float32Array(3 * count), seen = new Set<boolean>();
    follow(skin, moved, 3, x);
    moveBeside(skin, moved, x);
    for (let k = 0; k < count; k++) {
      const side = skin.beside!.away[k], height = x[3 * k + 1];
      seen.add(side > 0);
      if (Math.abs(height) < 0.9) assert.ok(Math.abs(Math.hypot(...x.subarray(3 * k, 3 * k + 3)) - 1 - side) < 0.01);
    }
    assert.deepEqual([...seen].sort(), [false, true]);
    for (let t = 0; t < skin.triangles.length; t += 3) // none joins both sides
      assert.equal(new Set([0, 1, 2].map((i) => skin.beside!.away[skin.triangles[t + i]])).size, 1);
  }
});

test("a frame of an edge of a rod has its first material point ahead, and turns to the right", () => {
  const x = Float32Array.from([0, 0, 0, 2, 0, 0, 1.1, 0.5, 0, 0.9, -0.5, 0]), axes = new Float32Array(48);
  frames(x, Uint32Array.from([0, 1, 2, 3]), axes);
  assert.deepEqual(Array.from(axes.subarray(24, 36)), [0, 1, 0, 0, 0, 1, 1, 0, 0, 2, 0, 0]);
});

test("tets are apart from the middle, and end at a cut", () => {
  const x = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 9, 9, 9]);
  const tets = Uint32Array.from([0, 1, 2, 3, 1, 2, 3, 4]);
  const position = { array: new Float32Array(72) }, value = { array: new Float32Array(24), needsUpdate: false };
  const place = (explode: number, cut: number, axis = 0) =>
    placeTets(tets, x, x, Uint8Array.from([1, 2, 3, 4, 5]), { explode, axis, cut }, position as never, value as never);
  assert.equal(place(0, 10), 24);
  assert.deepEqual([...position.array.slice(0, 9)], [0, 0, 0, 0, 1, 0, 1, 0, 0]);
  assert.deepEqual([...value.array.slice(0, 3)], [1, 3, 2]);
  assert.equal(place(0, 1), 12);
  place(1, 10);
  assert.ok(position.array[0] < -0.5 && position.array[36] > 1);
});

test("points of a skin beyond its tets stay out of solids that move", () => {
  const n = 24, low = [-1.2, -1.2, -1.2], step = [2.4 / (n - 1), 2.4 / (n - 1), 2.4 / (n - 1)];
  const ball = Float32Array.from({ length: n ** 3 }, (_, k) =>
    Math.hypot(...[Math.floor(k / n ** 2), Math.floor(k / n) % n, k % n].map((i, axis) => low[axis] + i * step[axis])) - 1);
  const solid = { low, step, n, unit: 1, values: {} } as unknown as Parameters<typeof keepOut>[5];
  const pose = [0, -1, 0, 5, 1, 0, 0, 6, 0, 0, 1, 7]; // a quarter turn about z, and a move
  const ends = [[5.9, 6, 7], [5, 6, 7.95], [4.6, 6.6, 7.5], [5.9, 6.1, 7], [5, 6.5, 7], [8, 6, 7]];
  const x = Float32Array.from(ends.flat());
  keepOut(x, Uint8Array.from([1, 1, 1, 0, 1, 1]), 0.3, 0.02, pose as never, solid, ball);
  for (let k = 0; k < 6; k++) {
    const away = Math.hypot(x[3 * k] - 5, x[3 * k + 1] - 6, x[3 * k + 2] - 7);
    if (k < 3) assert.ok(Math.abs(away - 1.02) < 0.01, `${away}`);
    else assert.deepEqual([...x.slice(3 * k, 3 * k + 3)], [...Float32Array.from(ends[k])]); // not beyond, too deep, far
  }
});

test("slow pictures lower the quality, once they are known to be slow", () => {
  const run = (gap: number, count: number) => {
    const pace = new Pace(1);
    for (let k = 0; k < count; k++) pace.picture(1000 + gap * k, gap);
    return pace;
  };
  assert.equal(run(16, 200).note, "");
  assert.ok(Math.abs(run(16, 200).rate(1000 + 16 * 200) - 62.5) < 1);
  assert.equal(run(16, 7).quality.sharp, 1);
  assert.equal(run(16, 8).quality.sharp, 2);
  assert.equal(run(300, 4).quality.coarse, false);
  assert.equal(run(300, 5).quality.coarse, true);
  assert.equal(run(300, 40).quality.shadows, false);
  assert.match(run(300, 40).note, /lighter skins, no shadows/);
  assert.equal(run(300, 40).best.shadows, true);
  assert.equal(run(600, 2).quality.shadows, false);
});
