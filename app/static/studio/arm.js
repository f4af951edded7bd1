// An arm as three.js objects: its links from the figures, its tool and its payload; and what collision checks see.
import * as THREE from "three";
import { linkBodies, linkCapsules } from "./links.js";
import { along, capsule, place, placedShape, roundedCylinder } from "./shapes.js";

const COLOURS = { tube: 0xe3e7ec, housing: 0xcfd5dc, cap: 0x2f7fb8, ring: 0x3a424c, foot: 0x555e69, tool: 0x2f3742, payload: 0xd8951f };
const geometries = new Map(); // of each robot, by name: several arms share them

function robotGeometry(robot) {
  if (!geometries.has(robot.name)) {
    const drawn = linkBodies(robot).map((bodies) => bodies.map(({ kind, from, to, radius }) => ({ kind, geometry: bodyGeometry(kind, from, to, radius) })));
    const seen = linkCapsules(robot).map((own) => own.map(({ from, to, radius }) => capsule(from, to, radius, 14)));
    geometries.set(robot.name, { drawn, seen });
  }
  return geometries.get(robot.name);
}

function bodyGeometry(kind, from, to, radius) {
  if (kind === "tube") return along(from, to, (length) => new THREE.CylinderGeometry(radius, radius, length, 28, 1, true).rotateX(Math.PI / 2));
  const round = { cap: 0.16, housing: 0.04, ring: 0.01, foot: 0.1 }[kind] * radius;
  return along(from, to, (length) => roundedCylinder(radius, length, round, 30));
}

/** One arm in the scene. `tint`: its one colour, for a ghost or a branch; null: as it looks. `opacity` below 1: a ghost. */
export class Arm {
  constructor(chain, robot, request, { tint = null, opacity = 1 } = {}) {
    this.chain = chain;
    this.object = new THREE.Group();
    const materials = new Map();
    const material = (kind) => {
      const colour = tint !== null && (opacity < 1 || kind === "cap") ? tint : COLOURS[kind];
      if (!materials.has(colour)) materials.set(colour, armMaterial(colour, opacity));
      return materials.get(colour);
    };
    const { drawn, seen } = robotGeometry(robot);
    const checked = armMaterial(0x66aadd, 0.45);
    this.links = [...drawn, []].map(() => place(new THREE.Group(), chain.frames(chain.placements.map(() => 0))[0]));
    this.drawn = [];
    this.seen = [];
    const put = (link, geometry, of, list) => {
      const mesh = new THREE.Mesh(geometry, of);
      mesh.castShadow = opacity === 1;
      this.links[link].add(mesh);
      list.push(mesh);
      return mesh;
    };
    // a ghost stands on the same base
    drawn.forEach((bodies, link) => (link > 0 || opacity === 1) && bodies.forEach(({ kind, geometry }) => put(link, geometry, material(kind), this.drawn)));
    if (opacity === 1) seen.forEach((own, link) => own.forEach((geometry) => put(link, geometry, checked, this.seen).castShadow = false));
    for (const { start, end, radius } of request.tool?.capsules ?? []) put(seen.length, capsule(start, end, radius, 18), material("tool"), []);
    const load = request.payload?.shape;
    if (load) {
      const part = placedShape(load, material("payload"));
      part.traverse((each) => { each.castShadow = opacity === 1; });
      this.links.at(-1).add(part);
    }
    this.object.add(...this.links);
    this.showCapsules(false);
  }

  /** Moves all links to joint positions q. */
  pose(q) {
    this.frames = this.chain.frames(q);
    this.frames.forEach((T, link) => place(this.links[link], T));
  }

  showCapsules(on) {
    for (const mesh of this.seen) mesh.visible = on;
    if (this.seen.length) for (const mesh of this.drawn) mesh.visible = !on;
  }
}

function armMaterial(colour, opacity) {
  const ghost = opacity < 1;
  return new THREE.MeshPhongMaterial({ color: colour, shininess: 28, specular: 0x333333, transparent: ghost, opacity, depthWrite: !ghost, polygonOffset: ghost, polygonOffsetFactor: 2, polygonOffsetUnits: 2 });
}
