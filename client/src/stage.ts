// What is seen: bodies as skins or tets, obstacles, ground, stitches, joints and pins.

import {
  BufferAttribute, BufferGeometry, type DataTexture, DynamicDrawUsage, LineBasicMaterial, LineSegments, Mesh,
  type Object3D, PlaneGeometry, Points, PointsMaterial, type Ray, Scene, type ShaderMaterial, Vector3,
} from "three";
import type { Block, Body, Field, Numbers, Source } from "./data.ts";
import { type Look, palette, SHADOW_LAYER } from "./look.ts";
import { stops } from "./panel.ts";
import { bounds, follow, keepOut, lighter, moveBeside, normals, placeTets, type Skin, skinOf } from "./shape.ts";

/** What a person has chosen; `body` is a number, or -1. */
export interface Shown {
  surface: "skin" | "tets"; field: Field | null; explode: number; cut: number; axis: number; follow: number;
  stitches: boolean; contacts: boolean;
}

interface Drawn { body: Body; mesh: Mesh<BufferGeometry, ShaderMaterial>; skin: Skin | null; tets: Numbers | null }

const LIGHT_SKIN = 700; // vertices of a skin where pictures take long

export class Stage {
  readonly scene = new Scene();
  private readonly block: Block;
  private readonly source: Source;
  private readonly look: Look;
  private readonly points: Float32Array;
  private readonly first: Float32Array;
  private drawn: Drawn[] = [];
  private readonly moving: { objects: Object3D[]; obstacle: number }[] = [];
  private readonly marks: { object: LineSegments | Points; ends: () => Numbers; shown: () => boolean }[] = [];
  private readonly light = new Map<string, Skin>();
  private shown: Shown;
  private coarse = false;

  constructor(block: Block, source: Source, look: Look, shown: Shown) {
    [this.block, this.source, this.look, this.shown] = [block, source, look, { ...shown }];
    this.points = new Float32Array(3 * block.description.points);
    source.positions(0, this.points);
    this.first = this.points.slice();
    this.scene.background = look.background;
    this.addGround();
    this.addObstacles();
    this.addMarks();
    this.build();
  }

  /** Draws other things of the same frame; `coarse` takes lighter skins. */
  show(shown: Shown, coarse: boolean): void {
    const last = this.shown, again = coarse !== this.coarse || last.surface !== shown.surface || last.field !== shown.field;
    [this.shown, this.coarse] = [{ ...shown }, coarse];
    if (again) this.build();
  }

  /** Moves everything to a place between frames. */
  move(place: number): void {
    const { source, shown, points } = this, { obstacles, gap } = this.block.description;
    source.positions(place, points);
    const frame = Math.min(Math.round(place), source.count - 1);
    const values = shown.field && source.field(shown.field, frame);
    for (const { body, mesh, skin, tets } of this.drawn) {
      const { position, normal, value } = mesh.geometry.attributes as Record<string, BufferAttribute>;
      const x = position.array as Float32Array;
      if (tets) {
        const how = { explode: shown.explode, axis: shown.axis, cut: this.cutAt() };
        mesh.geometry.setDrawRange(0, placeTets(tets, points, this.first, values, how, position, value));
      } else if (skin) {
        follow(skin, points, 3, x);
        moveBeside(skin, points, x);
        if (body.reach > 0)
          obstacles.forEach(({ solid }, k) => solid &&
            keepOut(x, skin.outside, body.reach, gap, source.pose(k, frame), solid, this.block.array(solid.values)));
        normals(x, skin.triangles, normal.array as Float32Array);
        normal.needsUpdate = true;
        if (values) follow(skin, values, 1, value.array as Float32Array);
        value.needsUpdate = values !== null;
      }
      position.needsUpdate = true;
    }
    for (const { objects, obstacle } of this.moving) {
      const pose = [...source.pose(obstacle, frame), 0, 0, 0, 1];
      for (const object of objects) object.matrix.fromArray(pose).transpose();
    }
    for (const { object, ends, shown: isShown } of this.marks) {
      object.visible = isShown();
      const values = ends(), geometry = object.geometry;
      if ((geometry.attributes.position?.array.length ?? -1) < values.length) {
        geometry.dispose();
        geometry.setAttribute("position", new BufferAttribute(new Float32Array(2 * values.length), 3));
      }
      const position = geometry.attributes.position as BufferAttribute;
      position.set(values);
      position.needsUpdate = true;
      geometry.setDrawRange(0, values.length / 3);
    }
  }

  /** The points (n, 3) of all bodies. */
  get bodies(): Float32Array {
    return this.points.subarray(0, 3 * this.block.description.stitches[0]);
  }

  /** The middle of the points of a body; null for -1. */
  middle(number: number): Vector3 | null {
    const body = this.block.description.bodies[number];
    if (!body) return null;
    const sum = new Vector3(), x = this.points;
    for (let i = 3 * body.first; i < 3 * (body.first + body.count); i += 3) sum.add(new Vector3(x[i], x[i + 1], x[i + 2]));
    return sum.divideScalar(body.count);
  }

  /** Where a ray meets a body first, and the middle of this body; or null. */
  hit(ray: Ray): { at: Vector3; middle: Vector3 } | null {
    const [a, b, c, hit, at] = Array.from({ length: 5 }, () => new Vector3());
    let nearest = -1, least = Infinity;
    this.drawn.forEach(({ mesh: { geometry } }, body) => {
      const x = geometry.attributes.position, { index } = geometry;
      const count = index ? index.count : geometry.drawRange.count;
      for (let t = 0; t < count; t += 3) {
        [a, b, c].forEach((corner, k) => corner.fromBufferAttribute(x, index ? index.getX(t + k) : t + k));
        if (!ray.intersectTriangle(a, b, c, false, hit)) continue;
        const away = hit.distanceToSquared(ray.origin);
        if (away < least) [least, nearest] = [away, (at.copy(hit), body)];
      }
    });
    return nearest < 0 ? null : { at, middle: this.middle(nearest)! };
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
    const { axis, cut } = this.shown, [low, high] = bounds(this.first);
    return cut === 0 ? Infinity : high[axis] - cut * (high[axis] - low[axis]);
  }

  /** The meshes of all bodies. */
  private build(): void {
    for (const { mesh } of this.drawn) {
      this.scene.remove(mesh);
      mesh.geometry.dispose();
      this.look.forget(mesh.material);
    }
    const { surface, field } = this.shown, all = this.block.array(this.block.description.tets);
    const scale: DataTexture | null = field ? palette(stops(field.colors), stops(field.colors).length, 1) : null;
    this.drawn = this.block.description.bodies.map((body) => {
      const geometry = new BufferGeometry(), [first, many] = body.tets, rest = this.block.array(body.rest);
      const tets = surface === "tets" && many > 0 ? all.subarray(4 * first, 4 * (first + many)) : null;
      const skin = tets ? null : this.skin(body);
      const count = tets ? 3 * tets.length : skin!.rest.length / 3;
      for (const [name, width] of [["position", 3], ["normal", 3], ["value", 1]] as const)
        geometry.setAttribute(name, new BufferAttribute(new Float32Array(width * count), width).setUsage(DynamicDrawUsage));
      if (skin) {
        geometry.setAttribute("rest", new BufferAttribute(skin.rest, 3));
        geometry.setIndex(new BufferAttribute(skin.triangles, 1));
      }
      const [low, high] = bounds(rest), size = Math.max(...high.map((end, i) => end - low[i]), 2e-9) / 2;
      const material = this.look.surface(tets ? "rubber" : body.look, body.color, size,
        { scale: many === 0 ? null : scale, facets: tets !== null, closed: body.closed });
      const mesh = this.add(new Mesh(geometry, material), true) as Drawn["mesh"];
      return { body, mesh, skin, tets };
    });
  }

  private skin(body: Body): Skin {
    const whole = skinOf(this.block, body), key = `${body.corners.at} ${body.triangles.at}`; // of equal bodies once
    if (!this.coarse) return whole;
    if (!this.light.has(key)) this.light.set(key, lighter(whole, LIGHT_SKIN));
    return { ...this.light.get(key)!, first: body.first };
  }

  private add<T extends Object3D>(object: T, casts = false): T {
    object.frustumCulled = false;
    if (casts) object.layers.enable(SHADOW_LAYER);
    this.scene.add(object);
    return object;
  }

  private addGround(): void {
    const { floor, up, center, radius } = this.block.description, upward = new Vector3(...up), middle = new Vector3(...center);
    if (floor === null) return;
    const size = 2 * 5 * 1.15 * radius, cell = 10 ** Math.floor(Math.log10(radius));
    const mesh = this.add(new Mesh(new PlaneGeometry(size, size)));
    mesh.geometry.setAttribute("rest", mesh.geometry.attributes.position.clone());
    mesh.quaternion.setFromUnitVectors(new Vector3(0, 0, 1), upward);
    mesh.position.copy(middle).addScaledVector(upward, floor - upward.dot(middle) - 2e-3 * radius);
    mesh.updateMatrixWorld();
    this.look.ground(mesh, cell < 0.4 * radius ? 2 * cell : cell / 2);
  }

  private addObstacles(): void {
    this.block.description.obstacles.forEach((one, obstacle) => {
      if (one.isFloor) return;
      const geometry = new BufferGeometry(), vertices = this.block.array(one.vertices) as Float32Array;
      const triangles = this.block.array(one.triangles), normal = new Float32Array(vertices.length);
      normals(vertices, triangles, normal);
      geometry.setAttribute("position", new BufferAttribute(vertices, 3));
      geometry.setAttribute("normal", new BufferAttribute(normal, 3));
      geometry.setIndex(new BufferAttribute(triangles, 1));
      // Of glass, the far side is drawn first, so that the near one reflects over it.
      const objects = (one.container ? [true, false] : [false]).map((inside, order) => {
        const opacity = one.container && !inside ? 0.04 : one.opacity, look = one.opacity < 1 ? "glass" : "obstacle";
        const how = { closed: one.container, opacity, inside };
        const mesh = this.add(new Mesh(geometry, this.look.surface(look, this.look.theme.obstacle, 1, how)), one.casts);
        mesh.renderOrder = one.opacity < 1 ? 2 + order : 0;
        mesh.matrixAutoUpdate = false;
        return mesh;
      });
      this.moving.push({ objects, obstacle });
    });
  }

  private addMarks(): void {
    const { stitches, joints, radius } = this.block.description, { source } = this;
    const part = ([first, count]: [number, number]) => this.points.subarray(3 * first, 3 * (first + count));
    const lines = (color: number) => new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color }));
    const dots = (color: number, size: number) =>
      new Points(new BufferGeometry(), new PointsMaterial({ color, size: size * radius }));
    const pinned = () => Float32Array.from(Array.from(source.marks("pins"),
      (row) => [...this.points.subarray(3 * row, 3 * row + 3)]).flat());
    const table: [LineSegments | Points, () => Numbers, (() => boolean)?][] = [
      [lines(0xc77700), () => part(stitches), () => this.shown.stitches],
      [lines(0xe17814), () => part(joints)],
      [lines(0x30343c), () => source.marks("grabs")],
      [lines(0xdc286e), () => source.marks("contacts"), () => this.shown.contacts],
      [dots(0xdc286e, 0.015), () => source.marks("touching"), () => this.shown.contacts],
      [dots(0x141418, 0.03), pinned],
    ];
    for (const [object, ends, shown = () => true] of table) this.marks.push({ object: this.add(object), ends, shown });
  }
}
