// What the page shows: the block of `supple.results.page.packed` (JSON that refers to arrays, and these arrays), and
// where it takes what moves from.

/** Where an array is in a block. */
export interface Ref { type: keyof typeof TYPES; at: number; count: number }
type Vec = [number, number, number];
interface Triangles { name: string; color: Vec; triangles: Ref }

export interface Body extends Triangles {
  look: string; first: number; count: number; tets: [number, number]; closed: boolean;
  /** each vertex of the skin: (k, order) rows of the body's points, and in parts of `step` all their weights but the
   * last one, which is what they lack to one */
  order: number; corners: Ref; weights: Ref; step: number; rest: Ref;
  /** which vertices are beyond the tets, and how far they are moved out of solids at most [m] */
  outside: Ref; reach: number;
  /** where vertices are drawn beside their points: cells of the body's points, from which the axes there follow, and
   * (k, d) distances along these axes [m] */
  beside: { axes: "normals" | "frames"; cells: Ref; away: Ref } | null;
}

export interface Obstacle extends Triangles {
  vertices: Ref; poses: Ref; opacity: number; container: boolean; casts: boolean; isFloor: boolean;
  /** signed distances (n, n, n) at the places low + i step, in parts of `unit` [m] */
  solid: { low: Vec; step: Vec; n: number; unit: number; values: Ref } | null;
}

/** `key` is that of a live simulation. */
export interface Field { key?: string; name: string; unit: string; ends: [number, number]; colors: string; values: Ref }
export interface Plot { title: string; series: { name: string; values: Ref }[] }
export interface Parameter { name: string; label: string; factor: number; whole: boolean }

export interface Description {
  title: string; up: Vec; center: Vec; views: Record<string, Vec>; radius: number; outline: Ref; floor: number | null;
  gap: number; bodies: Body[]; tets: Ref; obstacles: Obstacle[]; fields: Field[]; plots: Plot[];
  points: number; stitches: [number, number]; joints: [number, number]; pins: Ref;
  times: Ref; groups: { first: number; count: number; low: Vec; step: number }[]; motion: Ref;
  /** of a live simulation */
  kind?: "scene"; parameters?: Parameter[]; reload?: boolean;
}

const TYPES = { u1: Uint8Array, u2: Uint16Array, u4: Uint32Array, i2: Int16Array, f4: Float32Array, f8: Float64Array };
export type Numbers = Uint8Array | Uint16Array | Uint32Array | Int16Array | Float32Array | Float64Array;
const NONE = new Float32Array(0);

export class Block {
  readonly description: Description;
  private readonly buffer: ArrayBuffer;
  private readonly start: number;

  constructor(buffer: ArrayBuffer) {
    const length = new DataView(buffer).getUint32(0, true);
    [this.buffer, this.start] = [buffer, 4 + length];
    this.description = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  }

  array(ref: Ref): Numbers {
    return new TYPES[ref.type](this.buffer, this.start + ref.at, ref.count);
  }
}

/** The bytes of a text in base64, which deflate has compressed. */
export async function inflated(text: string): Promise<ArrayBuffer> {
  const bytes = Uint8Array.from(atob(text.trim()), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer();
}

/** Values (frames, size) of folded differences of `width` bytes; of two, all upper ones are before all lower ones. */
export function summed(bytes: Numbers, frames: number, size: number, width: 1 | 2): Uint8Array | Uint16Array {
  const count = frames * size;
  if (bytes.length !== width * count) throw new Error("the frames are incomplete");
  const out = width === 1 ? new Uint8Array(count) : new Uint16Array(count);
  for (let i = 0; i < count; i++) {
    const folded = width === 1 ? bytes[i] : (bytes[i] << 8) | bytes[count + i];
    out[i] = (i < size ? 0 : out[i - size]) + ((folded >> 1) ^ -(folded & 1));
  }
  return out;
}

export type Marks = "pins" | "grabs" | "contacts" | "touching";

/** Where the picture takes what moves from: a recording, or a simulation. */
export interface Source {
  /** number of frames */
  readonly count: number;
  /** The positions (points, 3) at a place between frames, such as 3.5, into `out`. */
  positions(place: number, out: Float32Array): void;
  /** The values of a field at the vertices in a frame, from 0 to 255; null where they are not known. */
  field(field: Field, frame: number): Uint8Array | null;
  /** The rotation and translation (3, 4) of an obstacle in a frame. */
  pose(obstacle: number, frame: number): Numbers;
  /** Pinned points; ends (k, 2, 3) of the springs of grabs and of forces of contacts; points (k, 3) of contacts. */
  marks(kind: Marks): Numbers;
}

/** The frames of a recording. */
export class Motion implements Source {
  readonly times: Numbers;
  readonly count: number;
  private readonly steps: Numbers;
  private readonly values = new Map<Field, Numbers>();
  private readonly block: Block;

  constructor(block: Block) {
    this.block = block;
    this.times = block.array(block.description.times);
    this.count = this.times.length;
    this.steps = summed(block.array(block.description.motion), this.count, 3 * block.description.points, 2);
  }

  positions(place: number, out: Float32Array): void {
    const { points, groups } = this.block.description;
    const first = Math.min(Math.floor(place), this.count - 1), share = place - first;
    const a = first * 3 * points, b = Math.min(first + 1, this.count - 1) * 3 * points;
    for (const { first: begin, count, low, step } of groups)
      for (let axis = 0; axis < 3; axis++)
        for (let i = begin, j = axis * points + begin; i < begin + count; i++, j++) {
          const whole = this.steps[a + j];
          out[3 * i + axis] = low[axis] + step * (whole + share * (this.steps[b + j] - whole));
        }
  }

  field(field: Field, frame: number): Uint8Array {
    const packed = this.block.array(field.values), size = packed.length / this.count;
    if (!this.values.has(field)) this.values.set(field, summed(packed, this.count, size, 1));
    return this.values.get(field)!.subarray(frame * size, (frame + 1) * size) as Uint8Array;
  }

  pose(obstacle: number, frame: number): Numbers {
    const poses = this.block.array(this.block.description.obstacles[obstacle].poses);
    const at = poses.length > 12 ? 12 * frame : 0;
    return poses.subarray(at, at + 12);
  }

  marks(kind: Marks): Numbers {
    return kind === "pins" ? this.block.array(this.block.description.pins) : NONE;
  }
}
