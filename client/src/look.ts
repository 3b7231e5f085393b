// Materials, the lights of both themes, and the maps that are drawn again when bodies have moved.

import {
  BackSide, Color, DataTexture, DepthTexture, DoubleSide, FrontSide, GLSL3, HalfFloatType, LinearFilter,
  LinearMipmapNearestFilter, Matrix4, Mesh, NearestFilter, OrthographicCamera, RedFormat, Scene, ShaderMaterial,
  SRGBColorSpace, UnsignedByteType, UnsignedIntType, Vector3, WebGLRenderTarget, type WebGLRenderer,
} from "three";
import type { Description } from "./data.ts";
import type { Quality } from "./pace.ts";
import * as shaders from "./shaders.ts";

export const SHADOW_LAYER = 1;
const LIT = 1.6; // half the side of the map of light on the ground, as a share of the reach of shadows
const LOOKS = ["rubber", "gummy", "foam", "steel", "obstacle", "glass"];
const THEMES = {
  bright: { sky: [238, 243, 250], ground: [190, 192, 198], sun: [255, 246, 232], floor: [222, 226, 234],
    top: [214, 224, 238], bottom: [238, 242, 247], obstacle: [196, 201, 210], strength: 1.3 },
  dark: { sky: [150, 162, 184], ground: [66, 68, 76], sun: [255, 244, 228], floor: [84, 90, 102],
    top: [20, 23, 29], bottom: [46, 51, 61], obstacle: [130, 138, 154], strength: 1.25 },
};

/** A color from 0 to 255 as amounts of light. */
export function linear(color: readonly number[]): Color {
  return new Color(...(color.map((c) => (c / 255) ** 2) as [number, number, number]));
}

/** A row or column of colors (n, 3) from 0 to 255. */
export function palette(colors: number[][], width: number, height: number): DataTexture {
  const data = Uint8Array.from(colors.flatMap((color) => [...color.map(Math.round), 255]));
  const texture = new DataTexture(data, width, height);
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

export class Look {
  readonly theme: (typeof THEMES)["bright"];
  readonly background: DataTexture;
  private quality: Quality | null = null;
  private readonly shared: Record<string, { value: unknown }>;
  private readonly materials = new Set<ShaderMaterial>();
  private readonly cameras: OrthographicCamera[]; // of the key light, and from above
  private readonly depth = new WebGLRenderTarget(8, 8, { format: RedFormat, type: UnsignedByteType });
  private readonly height = new WebGLRenderTarget(8, 8, {
    type: HalfFloatType, generateMipmaps: true, minFilter: LinearMipmapNearestFilter, magFilter: LinearFilter,
  });
  private readonly light = new WebGLRenderTarget(8, 8);
  private readonly lightScene = new Scene();
  private readonly mapMaterial: ShaderMaterial;
  private readonly lightMaterial: ShaderMaterial;

  constructor(scene: Description, dark: boolean) {
    const theme = (this.theme = dark ? THEMES.dark : THEMES.bright);
    this.background = palette([theme.bottom, theme.top], 1, 2);
    this.background.colorSpace = SRGBColorSpace;
    const up = new Vector3(...scene.up), center = new Vector3(...scene.center), reach = 1.15 * scene.radius;
    const away = new Vector3(...scene.views.fit), side = up.clone().cross(away).normalize();
    // Over the left shoulder of who looks from the first place.
    const sun = up.clone().multiplyScalar(1.25).addScaledVector(side, -0.62).addScaledVector(away, 0.28).normalize();
    const back = up.clone().addScaledVector(sun, -1.1).addScaledVector(sun.clone().cross(up).normalize(), 0.6).normalize();
    this.cameras = [[sun, up], [up, up.clone().cross(side)]].map(([from, upward]) => {
      const made = new OrthographicCamera(-reach, reach, reach, -reach, 0, 2 * reach);
      made.up.copy(upward);
      made.position.copy(center).addScaledVector(from, reach);
      made.lookAt(center);
      made.updateMatrixWorld();
      made.layers.set(SHADOW_LAYER);
      return made;
    });
    this.depth.depthTexture = new DepthTexture(8, 8, UnsignedIntType);
    this.depth.depthTexture.minFilter = this.depth.depthTexture.magFilter = NearestFilter;
    // From space to the maps; of the one from above: upwards.
    const [shadowMatrix, heightMatrix] = this.cameras.map((made, k) =>
      new Matrix4().set(0.5, 0, 0, 0.5, 0, 0.5, 0, 0.5, 0, 0, k ? -0.5 : 0.5, 0.5, 0, 0, 0, 1)
        .multiply(made.projectionMatrix).multiply(made.matrixWorldInverse));
    const values = {
      up, sun, back, reach, skyColor: linear(theme.sky), groundColor: linear(theme.ground),
      sunColor: linear(theme.sun).multiplyScalar(theme.strength), shadowMap: this.depth.depthTexture,
      heightMap: this.height.texture, groundMap: this.light.texture, shadowMatrix, heightMatrix,
    };
    this.shared = Object.fromEntries(Object.entries(values).map(([name, value]) => [name, { value }]));
    const flat = { depthTest: false, depthWrite: false, side: DoubleSide };
    this.mapMaterial = this.made(shaders.MAP_VERTEX, shaders.MAP, {}, {}, { side: DoubleSide });
    this.lightMaterial = this.made(shaders.GROUND_VERTEX, shaders.GROUND_MAP, { MAP: 1 }, {}, flat);
  }

  /** A material of a look; `scale` colors it by a field, `facets` draws flat triangles with their edges. */
  surface(look: string, color: readonly number[], size: number, { scale = null, facets = false, closed = false,
    opacity = 1, inside = false }: { scale?: DataTexture | null; facets?: boolean; closed?: boolean; opacity?: number;
    inside?: boolean } = {}): ShaderMaterial {
    const defines = { LOOK: Math.max(LOOKS.indexOf(look), 0), ...(scale && { FIELD: 1 }), ...(facets && { FACETS: 1 }) };
    return this.made(shaders.VERTEX, shaders.SURFACE, defines, { color: linear(color), size, opacity, scale }, {
      side: inside ? BackSide : closed ? FrontSide : DoubleSide, transparent: opacity < 1, depthWrite: opacity === 1,
    });
  }

  /** The ground, whose `rest` is in the plane: a mesh that gets its material, with lines at multiples of `cell` [m]. */
  ground(mesh: Mesh, cell: number): void {
    const own = { color: linear(this.theme.floor), cell };
    mesh.material = this.made(shaders.GROUND_VERTEX, shaders.GROUND, {}, own, { transparent: true });
    const map = mesh.clone();
    map.material = this.lightMaterial;
    map.frustumCulled = false;
    map.layers.enable(SHADOW_LAYER);
    this.lightScene.add(map);
  }

  /** Shadows or none, and how fine they are; materials are compiled again where that changes. */
  setQuality(quality: Quality): void {
    const last = this.quality;
    this.quality = quality;
    if (last && last.shadows === quality.shadows && last.taps === quality.taps) return;
    const cells = cellsOf(quality);
    [this.depth, this.light, this.height].forEach((target, k) => target.setSize(cells >> k, cells >> k));
    for (const material of this.materials) this.define(material);
  }

  forget(material: ShaderMaterial): void {
    this.materials.delete(material);
    material.dispose();
  }

  /** Draws the maps again: what lies between the light and each place, and how high bodies reach. */
  cast(renderer: WebGLRenderer, scene: Scene): void {
    if (!this.quality?.shadows) return;
    [scene.overrideMaterial, scene.background] = [this.mapMaterial, null];
    [this.depth, this.height].forEach((target, k) => {
      renderer.setRenderTarget(target);
      renderer.setClearColor(k ? 0 : 0xffffff, 1);
      renderer.clear();
      renderer.render(scene, this.cameras[k]);
    });
    [scene.overrideMaterial, scene.background] = [null, this.background];
    renderer.setRenderTarget(this.light);
    renderer.render(this.lightScene, this.cameras[0]);
    renderer.setRenderTarget(null);
  }

  dispose(): void {
    for (const one of [this.depth, this.height, this.light, this.background, ...this.materials]) one.dispose();
  }

  private define(material: ShaderMaterial): void {
    const { SHADOWS: _, ...others } = material.defines, quality = this.quality;
    const cells = quality ? cellsOf(quality) : 0;
    const taps = (quality?.taps ?? 0) + (material === this.lightMaterial ? 1 : 0); // soft edges on the ground
    const defines = { SHADOWS: 1, TAPS: taps, CELLS: `${cells}.`, LOD: `${Math.log2(cells / 128)}.` };
    material.defines = quality?.shadows ? { ...others, ...defines } : others;
    material.needsUpdate = true;
  }

  private made(vertexShader: string, fragmentShader: string, defines: Record<string, number | string>, own: object,
    options: object): ShaderMaterial {
    const uniforms = { ...this.shared };
    for (const [name, value] of Object.entries(own)) uniforms[name] = { value };
    const material = new ShaderMaterial({
      vertexShader, fragmentShader, defines: { LIT: LIT.toFixed(2), ...defines }, uniforms, glslVersion: GLSL3, ...options,
    });
    this.define(material);
    this.materials.add(material);
    return material;
  }
}

/** Of a side of the map of shadows. */
function cellsOf({ taps }: Quality): number {
  return taps ? 1024 : 512;
}
