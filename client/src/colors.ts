// Colors of fields: viridis from dark to bright, and red over white to blue where a field has a middle value.

import { DataTexture, LinearFilter } from "three";

// Of matplotlib's scales, evenly spaced.
const STOPS: Record<string, string> = {
  viridis: "440154 482878 3e4989 31688e 26828e 1f9e89 35b779 6ece58 b5de2b fde725",
  RdBu: "67001f b2182b d6604d f4a582 fddbc7 f7f7f7 d1e5f0 92c5de 4393c3 2166ac 053061",
};

/** The colors of a scale, each three numbers from 0 to 255. */
export function stops(name: string): number[][] {
  return STOPS[name].split(" ").map((hex) => [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16)));
}

/** The color at a place of a scale from 0 to 1. */
export function colorAt(name: string, share: number): number[] {
  const all = stops(name);
  const place = Math.min(Math.max(share, 0), 1) * (all.length - 1);
  const first = Math.min(Math.floor(place), all.length - 2);
  return all[first].map((c, i) => c + (place - first) * (all[first + 1][i] - c));
}

/** A picture of 256 colors. */
export function scaleTexture(name: string): DataTexture {
  const data = new Uint8Array(1024);
  for (let i = 0; i < 256; i++) data.set([...colorAt(name, i / 255).map(Math.round), 255], 4 * i);
  const texture = new DataTexture(data, 256, 1);
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

/** The same as CSS. */
export function gradient(name: string): string {
  return `linear-gradient(to right, ${stops(name).map((c) => `rgb(${c.join()})`).join()})`;
}
