// A simulation at the other end of a websocket: its scene, its frames, and what a person asks of it.

import { Block, type Field, type Marks, type Numbers, type Ref, type Source } from "./data.ts";

export type Values = Record<string, number | boolean>;

export interface Frame extends Record<Marks, Ref> {
  time: number; frame: number; paused: boolean; speed: number; points: Ref; poses: Ref;
  field: { key: string; ends: [number, number]; values: Ref } | null;
  solver: string; values: Values; bodies: Values[]; rate: string; slow: string; measures: string[];
  /** (k, 1 + n): the last times, and what was measured then, as `Description.plots` has it */
  numbers: Ref;
}

/** `ended`: whether the server ends, because of this error. */
export interface Status { error: string | null; ended: boolean; busy: string; command: string; recording: boolean }

export interface Listener {
  scene(block: Block): void;
  frame(frame: Frame): void;
  status(status: Status): void;
  notice(level: string, text: string): void;
  /** The connection has ended, or is there again. */
  connected(is: boolean): void;
}

const AGAIN = 1000; // [ms] until the next attempt to connect

export class Live implements Source {
  readonly count = 1;
  latest: Frame | null = null;
  private block: Block | null = null;
  private socket: WebSocket | null = null;
  private readonly listener: Listener;

  constructor(listener: Listener) {
    this.listener = listener;
    this.connect();
  }

  /** Asks for something, such as `send("SetSpeed", { factor: .5 })`; nothing happens without a connection. */
  send(act: string, values: object = {}): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ act, ...values }));
  }

  positions(_place: number, out: Float32Array): void {
    if (this.latest) out.set(this.block!.array(this.latest.points));
  }

  field(field: Field): Uint8Array | null {
    const told = this.latest?.field;
    if (!told || told.key !== field.key) return null;
    field.ends = told.ends;
    return this.block!.array(told.values) as Uint8Array;
  }

  pose(obstacle: number): Numbers {
    return this.block!.array(this.latest!.poses).subarray(12 * obstacle, 12 * obstacle + 12);
  }

  marks(kind: Marks): Numbers {
    return this.block!.array(this.latest![kind]);
  }

  /** See `Frame.numbers`. */
  numbers(): Numbers {
    return this.block!.array(this.latest!.numbers);
  }

  private connect(): void {
    const socket = (this.socket = new WebSocket(`ws://${location.host}/${location.search}`));
    socket.binaryType = "arraybuffer";
    socket.onopen = () => this.listener.connected(true);
    socket.onmessage = ({ data }) => this.receive(data);
    socket.onclose = () => {
      this.listener.connected(false);
      setTimeout(() => this.connect(), AGAIN);
    };
  }

  private receive(data: string | ArrayBuffer): void {
    if (typeof data === "string") {
      const told = JSON.parse(data);
      if (told.kind === "status") this.listener.status(told);
      else this.listener.notice(told.level, told.text);
      return;
    }
    const block = new Block(data), told = block.description as unknown as { kind: string; name: string; bytes: Ref };
    if (told.kind === "file") download(told.name, new Blob([block.array(told.bytes) as Uint8Array<ArrayBuffer>]));
    else if (told.kind === "scene") {
      this.latest = null;
      this.listener.scene(block);
    } else {
      [this.block, this.latest] = [block, told as unknown as Frame];
      this.listener.frame(this.latest);
    }
  }
}

export function download(name: string, content: Blob): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
