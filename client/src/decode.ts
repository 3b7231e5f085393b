// Reads the block of `supple.results.page.packed`: JSON that refers to arrays, and these arrays.

export interface Ref {
  type: "u1" | "u2" | "u4" | "i2" | "f4" | "f8";
  at: number;
  count: number;
}

export interface Triangles {
  name: string;
  color: [number, number, number];
  triangles: Ref;
}

export interface Body extends Triangles {
  look: string;
  first: number;
  count: number;
  tets: [number, number];
  order: number;
  corners: Ref;
  weights: Ref;
  step: number;
  rest: Ref;
  closed: boolean;
}

export interface Obstacle extends Triangles {
  vertices: Ref;
  poses: Ref;
  opacity: number;
  container: boolean;
  casts: boolean;
  isFloor: boolean;
}

export interface Field {
  /** of a live simulation */
  key?: string;
  name: string;
  unit: string;
  ends: [number, number];
  colors: string;
  values: Ref;
}

export interface Plot {
  title: string;
  series: { name: string; values: Ref }[];
}

export interface Description {
  title: string;
  up: [number, number, number];
  center: [number, number, number];
  away: [number, number, number];
  radius: number;
  outline: Ref;
  floor: number | null;
  bodies: Body[];
  tets: Ref;
  times: Ref;
  points: number;
  groups: { first: number; count: number; low: [number, number, number]; step: number }[];
  motion: Ref;
  stitches: [number, number];
  joints: [number, number];
  pins: Ref;
  obstacles: Obstacle[];
  fields: Field[];
  plots: Plot[];
}

const TYPES = {
  u1: Uint8Array,
  u2: Uint16Array,
  u4: Uint32Array,
  i2: Int16Array,
  f4: Float32Array,
  f8: Float64Array,
};

export type Numbers = Uint8Array | Uint16Array | Uint32Array | Int16Array | Float32Array | Float64Array;

/** A description and its arrays. */
export class Block {
  readonly description: Description;
  private readonly buffer: ArrayBuffer;
  private readonly start: number;

  constructor(buffer: ArrayBuffer) {
    const length = new DataView(buffer).getUint32(0, true);
    this.buffer = buffer;
    this.start = 4 + length;
    this.description = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  }

  array(ref: Ref): Numbers {
    return new TYPES[ref.type](this.buffer, this.start + ref.at, ref.count);
  }
}

/** The bytes of a text in base64, which deflate has compressed. */
export async function inflated(text: string): Promise<ArrayBuffer> {
  const bytes = Uint8Array.from(atob(text.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

/** Values (frames, size) of folded differences in 16 bits: upper bytes, then lower bytes. */
export function summed16(bytes: Numbers, frames: number, size: number): Uint16Array {
  const count = frames * size;
  if (bytes.length !== 2 * count) throw new Error("the positions are incomplete");
  const out = new Uint16Array(count);
  for (let i = 0; i < count; i++) {
    const folded = (bytes[i] << 8) | bytes[count + i];
    const change = (folded >> 1) ^ -(folded & 1);
    out[i] = (i < size ? 0 : out[i - size]) + change;
  }
  return out;
}

/** Values (frames, size) of folded differences in 8 bits. */
export function summed8(bytes: Numbers, frames: number, size: number): Uint8Array {
  if (bytes.length !== frames * size) throw new Error("a field is incomplete");
  const out = new Uint8Array(bytes.length);
  for (let i = 0; i < out.length; i++) {
    const change = (bytes[i] >> 1) ^ -(bytes[i] & 1);
    out[i] = (i < size ? 0 : out[i - size]) + change;
  }
  return out;
}

/** Where the scene takes what moves from: a recording, or a simulation. */
export interface Source {
  /** number of frames */
  readonly count: number;
  /** The positions (points, 3) at a place between frames, such as 3.5, into `out`. */
  positions(place: number, out: Float32Array): void;
  /** The values of a field at the vertices in a frame, from 0 to 255; null where they are not known. */
  field(field: Field, frame: number): Uint8Array | null;
  /** The rotation and translation (3, 4) of an obstacle in a frame. */
  pose(obstacle: number, frame: number): Numbers;
  /** Pinned points. */
  pins(): Numbers;
  /** Ends (k, 2, 3) of the springs of grabs, and of forces of contacts; and points (k, 3) of contacts. */
  grabs(): Numbers;
  contacts(): Numbers;
  touching(): Numbers;
}

/** The frames of a recording: where all points are, and the values of fields, at any time. */
export class Motion implements Source {
  readonly times: Numbers;
  readonly count: number;
  private readonly steps: Uint16Array;
  private readonly values = new Map<Field, Uint8Array>();
  private readonly block: Block;

  constructor(block: Block) {
    this.block = block;
    this.times = block.array(block.description.times);
    this.count = this.times.length;
    this.steps = summed16(block.array(block.description.motion), this.count, 3 * block.description.points);
  }

  positions(place: number, out: Float32Array): void {
    const { points, groups } = this.block.description;
    const first = Math.min(Math.floor(place), this.count - 1);
    const share = place - first;
    const a = first * 3 * points;
    const b = Math.min(first + 1, this.count - 1) * 3 * points;
    for (const { first: begin, count, low, step } of groups)
      for (let axis = 0; axis < 3; axis++)
        for (let i = begin; i < begin + count; i++) {
          const j = axis * points + i;
          const whole = this.steps[a + j];
          out[3 * i + axis] = low[axis] + step * (whole + share * (this.steps[b + j] - whole));
        }
  }

  field(field: Field, frame: number): Uint8Array {
    const packed = this.block.array(field.values);
    const size = packed.length / this.count;
    let all = this.values.get(field);
    if (!all) this.values.set(field, (all = summed8(packed, this.count, size)));
    return all.subarray(frame * size, (frame + 1) * size);
  }

  pose(obstacle: number, frame: number): Numbers {
    const poses = this.block.array(this.block.description.obstacles[obstacle].poses);
    const at = poses.length > 12 ? 12 * frame : 0;
    return poses.subarray(at, at + 12);
  }

  pins(): Numbers {
    return this.block.array(this.block.description.pins);
  }

  grabs(): Numbers {
    return NONE;
  }

  contacts(): Numbers {
    return NONE;
  }

  touching(): Numbers {
    return NONE;
  }
}

const NONE = new Float32Array(0);
