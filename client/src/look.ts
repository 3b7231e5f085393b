// Materials, the lights of both themes, and the two maps that are drawn again when bodies have moved.

import {
  BackSide, Color, DataTexture, DepthTexture, DoubleSide, FrontSide, GLSL3, HalfFloatType, LinearFilter,
  LinearMipmapNearestFilter, Matrix4, Mesh, NearestFilter, OrthographicCamera, RedFormat, RGBAFormat, Scene,
  ShaderMaterial, type Side, UnsignedByteType, UnsignedIntType, Vector3, WebGLRenderTarget, type WebGLRenderer,
} from "three";
import type { Description } from "./decode.ts";
import type { Quality } from "./pace.ts";
import * as shaders from "./shaders.ts";

export const SHADOW_LAYER = 1;
const LIT = 1.6; // half the side of the map of light on the ground, as a share of the reach of shadows
const LOOKS: Record<string, number> = { rubber: 0, gummy: 1, foam: 2, steel: 3, obstacle: 4, glass: 5 };

/** A color from 0 to 255 as amounts of light. */
export function linear(color: readonly number[]): Color {
  return new Color().setRGB(...(color.map((c) => (c / 255) ** 2) as [number, number, number]));
}

const THEMES = {
  bright: { sky: [238, 243, 250], ground: [190, 192, 198], sun: [255, 246, 232], floor: [222, 226, 234],
    top: [214, 224, 238], bottom: [238, 242, 247], obstacle: [196, 201, 210] },
  dark: { sky: [150, 162, 184], ground: [66, 68, 76], sun: [255, 244, 228], floor: [84, 90, 102],
    top: [20, 23, 29], bottom: [46, 51, 61], obstacle: [130, 138, 154] },
};

export class Look {
  readonly theme: (typeof THEMES)["bright"];
  private quality: Quality | null = null;
  private readonly shared: Record<string, { value: unknown }>;
  private readonly materials = new Set<ShaderMaterial>();
  private readonly key: OrthographicCamera;
  private readonly above: OrthographicCamera;
  private readonly depth: WebGLRenderTarget;
  private readonly height: WebGLRenderTarget;
  private readonly light = new WebGLRenderTarget(8, 8);
  private readonly mapMaterial: ShaderMaterial;
  private readonly lightScene = new Scene();
  private readonly lightMaterial: ShaderMaterial;

  constructor(scene: Description, dark: boolean) {
    this.theme = dark ? THEMES.dark : THEMES.bright;
    const up = new Vector3(...scene.up), center = new Vector3(...scene.center), reach = 1.15 * scene.radius;
    const away = new Vector3(...scene.away);
    // Over the left shoulder of who looks from the first place.
    const side = new Vector3().crossVectors(up, away).normalize();
    const sun = up.clone().multiplyScalar(1.25).addScaledVector(side, -0.62).addScaledVector(away, 0.28).normalize();
    const across = new Vector3().crossVectors(sun, up).normalize();
    const back = up.clone().addScaledVector(sun, -1.1).addScaledVector(across, 0.6).normalize();
    const camera = (from: Vector3, upward: Vector3) => {
      const made = new OrthographicCamera(-reach, reach, reach, -reach, 0, 2 * reach);
      made.up.copy(upward);
      made.position.copy(center).addScaledVector(from, reach);
      made.lookAt(center);
      made.updateMatrixWorld();
      made.layers.set(SHADOW_LAYER);
      return made;
    };
    this.key = camera(sun, up);
    this.above = camera(up, away.clone().addScaledVector(up, -away.dot(up)).normalize());
    this.depth = new WebGLRenderTarget(512, 512, { format: RedFormat, type: UnsignedByteType });
    this.depth.depthTexture = new DepthTexture(512, 512, UnsignedIntType);
    this.depth.depthTexture.minFilter = this.depth.depthTexture.magFilter = NearestFilter;
    this.height = new WebGLRenderTarget(128, 128, {
      format: RGBAFormat, type: HalfFloatType, generateMipmaps: true, minFilter: LinearMipmapNearestFilter,
      magFilter: LinearFilter,
    });
    this.mapMaterial = new ShaderMaterial({
      vertexShader: shaders.MAP_VERTEX, fragmentShader: shaders.MAP, glslVersion: GLSL3, side: DoubleSide,
    });
    const into = (made: OrthographicCamera) =>
      new Matrix4().set(0.5, 0, 0, 0.5, 0, 0.5, 0, 0.5, 0, 0, 0.5, 0.5, 0, 0, 0, 1)
        .multiply(made.projectionMatrix).multiply(made.matrixWorldInverse);
    // Of the map from above: upwards.
    const upwards = new Matrix4().set(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 1, 0, 0, 0, 1).multiply(into(this.above));
    const values = {
      up, sun, back, reach, skyColor: linear(this.theme.sky), groundColor: linear(this.theme.ground),
      sunColor: linear(this.theme.sun).multiplyScalar(dark ? 1.25 : 1.3), shadowMap: this.depth.depthTexture,
      heightMap: this.height.texture, shadowMatrix: into(this.key), heightMatrix: upwards,
      shadowDepth: 2 * reach, heightDepth: 2 * reach, groundMap: this.light.texture,
    };
    this.shared = Object.fromEntries(Object.entries(values).map(([name, value]) => [name, { value }]));
    this.lightMaterial = this.made(shaders.GROUND_VERTEX, shaders.GROUND_MAP, { LIT: LIT.toFixed(2), MAP: 1 }, {},
      { depthTest: false, depthWrite: false, side: DoubleSide });
  }

  /** A material of a look; `scale` colors it by a field, `facets` draws flat triangles with their edges. */
  surface(look: string, color: Color, size: number, more: { scale?: DataTexture | null; facets?: boolean;
    closed?: boolean; opacity?: number; inside?: boolean } = {}): ShaderMaterial {
    const opacity = more.opacity ?? 1;
    const defines: Record<string, number | string> = { LOOK: LOOKS[look] ?? 0 };
    if (more.scale) defines.FIELD = 1;
    if (more.facets) defines.FACETS = 1;
    const side: Side = more.inside ? BackSide : more.closed ? FrontSide : DoubleSide;
    return this.made(shaders.VERTEX, shaders.SURFACE, defines, { color, size, opacity, scale: more.scale ?? null },
      { side, transparent: opacity < 1, depthWrite: opacity === 1 });
  }

  /** The ground, whose `rest` is in the plane; it is a mesh of this material. */
  ground(mesh: Mesh, cell: number): void {
    mesh.material = this.made(shaders.GROUND_VERTEX, shaders.GROUND, { LIT: LIT.toFixed(2) }, { color: linear(this.theme.floor), cell },
      { transparent: true, side: FrontSide });
    const map = new Mesh(mesh.geometry, this.lightMaterial);
    map.position.copy(mesh.position);
    map.quaternion.copy(mesh.quaternion);
    map.frustumCulled = false;
    map.layers.enable(SHADOW_LAYER);
    this.lightScene.add(map);
  }

  background(): ShaderMaterial {
    const [top, bottom] = [this.theme.top, this.theme.bottom].map((c) => new Color(...c.map((one) => one / 255)));
    return this.made(shaders.BACKGROUND_VERTEX, shaders.BACKGROUND, {}, { top, bottom },
      { depthTest: false, depthWrite: false });
  }

  /** Shadows or none, and how fine they are; materials are compiled again where that changes. */
  setQuality(quality: Quality): void {
    const last = this.quality;
    this.quality = quality;
    if (last && last.shadows === quality.shadows && last.taps === quality.taps) return;
    const cells = cellsOf(quality);
    this.depth.setSize(cells, cells);
    this.light.setSize(cells / 2, cells / 2);
    this.height.setSize(cells / 4, cells / 4);
    for (const material of this.materials) this.define(material);
  }

  forget(material: ShaderMaterial): void {
    this.materials.delete(material);
    material.dispose();
  }

  /** Draws the maps again: what lies between the light and each place, and how high bodies reach. */
  cast(renderer: WebGLRenderer, scene: Scene): void {
    if (!this.quality?.shadows) return;
    scene.overrideMaterial = this.mapMaterial;
    for (const [target, camera, clear] of [[this.depth, this.key, 1], [this.height, this.above, 0]] as const) {
      renderer.setRenderTarget(target);
      renderer.setClearColor(new Color(clear, 0, 0), 1);
      renderer.clear();
      renderer.render(scene, camera);
    }
    scene.overrideMaterial = null;
    renderer.setRenderTarget(this.light);
    renderer.render(this.lightScene, this.key);
    renderer.setRenderTarget(null);
  }

  dispose(): void {
    for (const target of [this.depth, this.height, this.light]) target.dispose();
  }

  private define(material: ShaderMaterial): void {
    const { SHADOWS: _, ...others } = material.defines;
    const quality = this.quality, cells = quality ? cellsOf(quality) : 0;
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
      vertexShader, fragmentShader, defines, uniforms, glslVersion: GLSL3, ...options,
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
