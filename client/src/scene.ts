// What is seen: bodies as skins or tets, obstacles, ground, stitches, joints and pins.

import {
  BufferAttribute, BufferGeometry, DynamicDrawUsage, LineBasicMaterial, LineSegments, Mesh, type Object3D,
  PlaneGeometry, Points, PointsMaterial, Quaternion, type Ray, Scene, type ShaderMaterial, Vector3,
} from "three";
import { scaleTexture } from "./colors.ts";
import type { Block, Body, Field, Numbers, Source } from "./decode.ts";
import { linear, type Look, SHADOW_LAYER } from "./look.ts";
import { follow, lighter, normals, type Skin, skinOf } from "./skin.ts";
import { placeTets, type Tets, tetsOf } from "./tets.ts";

export interface Shown {
  surface: "skin" | "tets";
  field: Field | null;
  explode: number;
  cut: number;
  axis: number;
  stitches: boolean;
  contacts: boolean;
}

/** A body on the picture. */
interface Drawn {
  body: Body;
  mesh: Mesh<BufferGeometry, ShaderMaterial>;
  skin: Skin | null;
  tets: Tets | null;
}

const LIGHT_SKIN = 700; // vertices of a skin where pictures take long

export class Stage {
  readonly scene = new Scene();
  private readonly block: Block;
  private readonly motion: Source;
  private readonly look: Look;
  private readonly points: Float32Array;
  private readonly first: Float32Array;
  private drawn: Drawn[] = [];
  private readonly moving: { objects: Object3D[]; obstacle: number }[] = [];
  private readonly marks: { object: LineSegments | Points; ends: () => Numbers; shown: () => boolean }[] = [];
  private readonly light = new Map<string, Skin>();
  private shown: Shown;
  private coarse = false;

  constructor(block: Block, motion: Source, look: Look, shown: Shown) {
    [this.block, this.motion, this.look, this.shown] = [block, motion, look, shown];
    this.points = new Float32Array(3 * block.description.points);
    motion.positions(0, this.points);
    this.first = this.points.slice();
    this.addBackground();
    this.addGround();
    this.addObstacles();
    this.addMarks();
    this.build();
  }

  /** Draws other things of the same frame; `coarse` takes lighter skins. */
  show(shown: Shown, coarse: boolean): void {
    const keys = ["surface", "field"] as const;
    const again = coarse !== this.coarse || keys.some((key) => shown[key] !== this.shown[key]);
    this.shown = { ...shown };
    this.coarse = coarse;
    if (again) this.build();
  }

  /** Moves everything to a place between frames. */
  move(place: number): void {
    this.motion.positions(place, this.points);
    const frame = Math.min(Math.round(place), this.motion.count - 1);
    const values = this.shown.field && this.motion.field(this.shown.field, frame);
    for (const { mesh, skin, tets } of this.drawn) {
      const { position, normal, value } = mesh.geometry.attributes as Record<string, BufferAttribute>;
      if (tets) {
        const count = placeTets(tets, this.points, this.first, values, this.shown, this.cutAt(), position, value);
        mesh.geometry.setDrawRange(0, count);
      } else if (skin) {
        follow(skin, this.points, 3, position.array as Float32Array);
        normals(position.array as Float32Array, skin.triangles, normal.array as Float32Array);
        normal.needsUpdate = true;
        if (values) {
          follow(skin, values, 1, value.array as Float32Array);
          value.needsUpdate = true;
        }
      }
      position.needsUpdate = true;
    }
    for (const { objects, obstacle } of this.moving) {
      const p = this.motion.pose(obstacle, frame);
      for (const object of objects)
        object.matrix.set(p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11], 0, 0, 0, 1);
    }
    for (const { object, ends, shown } of this.marks) {
      object.visible = shown();
      const values = ends(), geometry = object.geometry;
      let position = geometry.attributes.position as BufferAttribute | undefined;
      if (!position || position.array.length < values.length) {
        geometry.dispose();
        position = new BufferAttribute(new Float32Array(2 * values.length), 3);
        geometry.setAttribute("position", position);
      }
      (position.array as Float32Array).set(values);
      position.needsUpdate = true;
      geometry.setDrawRange(0, values.length / 3);
    }
  }

  /** Where a ray meets a body first, or null. */
  firstHit(ray: Ray): Vector3 | null {
    const corners = [new Vector3(), new Vector3(), new Vector3()], hit = new Vector3();
    let nearest: Vector3 | null = null, least = Infinity;
    for (const { mesh } of this.drawn) {
      const x = mesh.geometry.attributes.position, index = mesh.geometry.index;
      const count = index ? index.count : mesh.geometry.drawRange.count;
      for (let t = 0; t < count; t += 3) {
        corners.forEach((corner, k) => corner.fromBufferAttribute(x, index ? index.getX(t + k) : t + k));
        if (!ray.intersectTriangle(corners[0], corners[1], corners[2], false, hit)) continue;
        const away = hit.distanceToSquared(ray.origin);
        if (away < least) [least, nearest] = [away, hit.clone()];
      }
    }
    return nearest;
  }

  /** Gives back what the graphics card holds. */
  dispose(): void {
    this.scene.traverse((object) => {
      const { geometry, material } = object as Mesh<BufferGeometry, ShaderMaterial>;
      geometry?.dispose();
      material?.dispose();
    });
  }

  private cutAt(): number {
    const { center, radius } = this.block.description;
    let low = Infinity, high = -Infinity;
    for (let i = this.shown.axis; i < this.first.length; i += 3) {
      low = Math.min(low, this.first[i]);
      high = Math.max(high, this.first[i]);
    }
    return this.shown.cut === 0 ? center[this.shown.axis] + 1e3 * radius : high - this.shown.cut * (high - low);
  }

  /** The meshes of all bodies. */
  private build(): void {
    for (const { mesh } of this.drawn) {
      this.scene.remove(mesh);
      mesh.geometry.dispose();
      this.look.forget(mesh.material);
    }
    const { surface, field } = this.shown;
    const scale = field ? scaleTexture(field.colors) : null;
    this.drawn = this.block.description.bodies.map((body) => {
      const geometry = new BufferGeometry();
      const attribute = (name: string, array: Float32Array, width: number) =>
        geometry.setAttribute(name, new BufferAttribute(array, width).setUsage(DynamicDrawUsage));
      const tets = surface === "tets" && body.tets[1] > 0 ? tetsOf(this.block, body) : null;
      const skin = tets ? null : this.skin(body);
      const count = tets ? 12 * tets.count : skin!.rest.length / 3;
      attribute("position", new Float32Array(3 * count), 3);
      attribute("value", new Float32Array(count), 1);
      if (skin) {
        attribute("normal", new Float32Array(3 * count), 3);
        geometry.setAttribute("rest", new BufferAttribute(skin.rest, 3));
        geometry.setIndex(new BufferAttribute(skin.triangles, 1));
      }
      const color = linear(body.color);
      const material = this.look.surface(tets ? "rubber" : body.look, color, sizeOf(this.block.array(body.rest)),
        { scale: skin && body.tets[1] === 0 ? null : scale, facets: tets !== null, closed: body.closed });
      const mesh = new Mesh(geometry, material);
      mesh.frustumCulled = false;
      mesh.layers.enable(SHADOW_LAYER);
      this.scene.add(mesh);
      return { body, mesh, skin, tets };
    });
  }

  private skin(body: Body): Skin {
    const whole = skinOf(this.block, body);
    if (!this.coarse) return whole;
    const key = `${body.corners.at} ${body.triangles.at}`; // of bodies with the same skin once
    const known = this.light.get(key) ?? lighter(whole, LIGHT_SKIN);
    this.light.set(key, known);
    return { ...known, first: body.first };
  }

  private addBackground(): void {
    const mesh = new Mesh(new PlaneGeometry(2, 2), this.look.background());
    mesh.frustumCulled = false;
    mesh.renderOrder = -1;
    this.scene.add(mesh);
  }

  private addGround(): void {
    const { floor, up, center, radius } = this.block.description;
    if (floor === null) return;
    const size = 5 * 1.15 * radius;
    const geometry = new PlaneGeometry(2 * size, 2 * size, 1, 1);
    geometry.setAttribute("rest", geometry.attributes.position.clone());
    const cell = 10 ** Math.floor(Math.log10(radius));
    const mesh = new Mesh(geometry);
    const upward = new Vector3(...up);
    mesh.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), upward));
    mesh.position.set(...center).addScaledVector(upward, floor - upward.dot(new Vector3(...center)) - 2e-3 * radius);
    mesh.updateMatrixWorld();
    this.look.ground(mesh, cell < 0.4 * radius ? 2 * cell : cell / 2);
    this.scene.add(mesh);
  }

  private addObstacles(): void {
    for (const [number, obstacle] of this.block.description.obstacles.entries()) {
      if (obstacle.isFloor) continue;
      const geometry = new BufferGeometry();
      const vertices = this.block.array(obstacle.vertices) as Float32Array;
      const triangles = this.block.array(obstacle.triangles);
      const normal = new Float32Array(vertices.length);
      normals(vertices, triangles, normal);
      geometry.setAttribute("position", new BufferAttribute(vertices, 3));
      geometry.setAttribute("normal", new BufferAttribute(normal, 3));
      geometry.setIndex(new BufferAttribute(triangles, 1));
      // Of glass, the far side is drawn first, so that the near one reflects over it.
      const sides = obstacle.container ? [true, false] : [false];
      const objects = sides.map((inside, order) => {
        const opacity = obstacle.container && !inside ? 0.04 : obstacle.opacity;
        const material = this.look.surface(obstacle.opacity < 1 ? "glass" : "obstacle", linear(this.look.theme.obstacle),
          1, { closed: obstacle.container, opacity, inside });
        const mesh = new Mesh(geometry, material);
        mesh.renderOrder = obstacle.opacity < 1 ? 2 + order : 0;
        mesh.matrixAutoUpdate = false;
        mesh.frustumCulled = false;
        if (obstacle.casts) mesh.layers.enable(SHADOW_LAYER);
        this.scene.add(mesh);
        return mesh;
      });
      this.moving.push({ objects, obstacle: number });
    }
  }

  private addMarks(): void {
    const { stitches, joints, radius } = this.block.description;
    const part = ([first, count]: [number, number]) => this.points.subarray(3 * first, 3 * (first + count));
    const add = (object: LineSegments | Points, ends: () => Numbers, shown: () => boolean) => {
      object.frustumCulled = false;
      this.scene.add(object);
      this.marks.push({ object, ends, shown });
    };
    const lines = (color: number) => new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color }));
    const always = () => true;
    add(lines(0xc77700), () => part(stitches), () => this.shown.stitches);
    add(lines(0xe17814), () => part(joints), always);
    add(lines(0x30343c), () => this.motion.grabs(), always);
    add(lines(0xdc286e), () => this.motion.contacts(), () => this.shown.contacts);
    const dots = (color: number, size: number) =>
      new Points(new BufferGeometry(), new PointsMaterial({ color, size: size * radius }));
    add(dots(0xdc286e, 0.015), () => this.motion.touching(), () => this.shown.contacts);
    add(dots(0x141418, 0.03), () => this.pinned(), always);
  }

  private pinned(): Float32Array {
    const rows = this.motion.pins(), out = new Float32Array(3 * rows.length);
    rows.forEach((row: number, k: number) => out.set(this.points.subarray(3 * row, 3 * row + 3), 3 * k));
    return out;
  }
}

/** Half the longest side of the box about points (k, 3) [m]. */
function sizeOf(x: Numbers): number {
  let size = 1e-9;
  for (let axis = 0; axis < 3; axis++) {
    let low = Infinity, high = -Infinity;
    for (let i = axis; i < x.length; i += 3) {
      low = Math.min(low, x[i]);
      high = Math.max(high, x[i]);
    }
    size = Math.max(size, 0.5 * (high - low));
  }
  return size;
}
