// An arm as three.js objects: its links from the figures, its tool and its payload; and what
// collision checks see.
import * as THREE from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import { IDENTITY, type Chain, type Matrix } from "../store/chain";
import type { ApiRequest, FormBody, Payload, Robot, Shape } from "../store/types";
import { along, capsule, place, placedShape, roundedCylinder } from "./shapes";

const COLOURS = {
  tube: 0xe3e7ec,
  housing: 0xcfd5dc,
  cap: 0x2f7fb8,
  ring: 0x3a424c,
  foot: 0x555e69,
  tool: 0x2f3742,
  payload: 0xd8951f,
};
const ROUNDED = { tube: 0.01, housing: 0.04, cap: 0.16, ring: 0.01, foot: 0.1 }; // edges, of the radius
const SIDES = 22; // of round bodies
const WATER = 1000; // density [kg/m³]

interface Geometries {
  drawn: THREE.BufferGeometry[];
  seen: THREE.BufferGeometry[];
}

const geometries = new Map<string, Geometries>(); // of each robot, by name: several arms share them

/** Names of the links, base first. */
export const linkNames = (robot: Robot) => [
  "base",
  ...(robot.kinematics.link_names!.value as string[]),
];

/**
 * One geometry for each link, with the colours of its bodies, and one with the capsules of its
 * collision checks.
 */
function robotGeometry(robot: Robot): Geometries {
  const known = geometries.get(robot.name);
  if (known) return known;
  const drawn = robot.form.map((bodies) =>
    merged(bodies.map((body) => coloured(bodyGeometry(body), COLOURS[body.kind]))),
  );
  const capsules = linkNames(robot).map(
    (name) => (robot.collision[name]?.value ?? []) as number[][],
  );
  const seen = capsules.map((own) =>
    merged(own.map((row) => capsule(row.slice(0, 3), row.slice(3, 6), row[6]!, 14))),
  );
  geometries.set(robot.name, { drawn, seen });
  return { drawn, seen };
}

/** Draws a robot by these geometries from now on, one for each link, with colours. */
export const drawBy = (robot: Robot, drawn: THREE.BufferGeometry[]) =>
  geometries.set(robot.name, { ...robotGeometry(robot), drawn });

const merged = (parts: THREE.BufferGeometry[]) =>
  parts.length ? mergeGeometries(parts) : new THREE.BufferGeometry();

function coloured(geometry: THREE.BufferGeometry, colour: number): THREE.BufferGeometry {
  const one = new THREE.Color(colour).toArray();
  const all = Array.from({ length: geometry.attributes.position!.count }, () => one).flat();
  return geometry.setAttribute("color", new THREE.Float32BufferAttribute(all, 3));
}

const bodyGeometry = ({ kind, start, end, radius }: FormBody) =>
  along(start, end, (length) => roundedCylinder(radius, length, ROUNDED[kind] * radius, SIDES));

/** What is drawn of a payload: its shape; without one, the ball that as much water has. */
const loadShape = ({ mass, com, shape }: Payload): Shape =>
  shape ?? {
    shape: "sphere",
    radius: Math.cbrt((3 * mass) / (4 * Math.PI * WATER)),
    pose: { position: com ?? [0, 0, 0] },
  };

export interface ArmOptions {
  /** A colour over its own ones. */
  tint?: number;
  /** Below 1: a ghost, in the tint alone. */
  opacity?: number;
  /** The payloads that it carries one after the other. */
  loads?: (Payload | null | undefined)[];
}

/** One arm in the scene. */
export class Arm {
  readonly object = new THREE.Group();
  readonly links: THREE.Group[];
  readonly drawn: THREE.Mesh[];
  readonly seen: THREE.Mesh[];
  readonly loads: THREE.Object3D[];
  frames: Matrix[] = [];

  constructor(
    private readonly chain: Chain,
    robot: Robot,
    request: ApiRequest,
    { tint = 0xffffff, opacity = 1, loads = [request.payload] }: ArmOptions = {},
  ) {
    const ghost = opacity < 1;
    const { drawn, seen } = robotGeometry(robot);
    const own = armMaterial(tint, opacity, !ghost);
    const of = (kind: "tool" | "payload") => (ghost ? own : armMaterial(COLOURS[kind], 1, false));
    this.links = [...drawn, null].map(() => place(new THREE.Group(), IDENTITY));
    const put = (link: number, geometry: THREE.BufferGeometry, material: THREE.Material) => {
      const mesh = new THREE.Mesh(geometry, material);
      mesh.castShadow = !ghost;
      this.links[link]!.add(mesh);
      return mesh;
    };
    // ghosts and further arms stand on the same base
    const first = tint === 0xffffff ? 0 : 1;
    this.drawn = drawn.slice(first).map((geometry, k) => put(k + first, geometry, own));
    this.seen = ghost
      ? []
      : seen.map((geometry, link) => put(link, geometry, armMaterial(0x66aadd, 0.45, false)));
    for (const mesh of this.seen) mesh.castShadow = false;
    const tool = (typeof request.tool === "object" ? (request.tool.capsules ?? []) : []).map(
      ({ start, end, radius }) => capsule(start, end, radius, 16),
    );
    if (tool.length) put(drawn.length, merged(tool), of("tool"));
    this.loads = loads.map((payload) => {
      const part = payload?.mass
        ? placedShape(loadShape(payload), of("payload"))
        : new THREE.Group();
      part.traverse((each) => (each.castShadow = !ghost));
      this.links.at(-1)!.add(part);
      return part;
    });
    this.object.add(...this.links);
    this.showCapsules(false);
    this.carry(0);
  }

  /** Shows the load of this number alone. */
  carry(number: number): void {
    this.loads.forEach((part, k) => (part.visible = k === number));
  }

  /** Moves all links to joint positions q. */
  pose(q: number[]): void {
    this.frames = this.chain.frames(q);
    this.frames.forEach((T, link) => place(this.links[link]!, T));
  }

  showCapsules(on: boolean): void {
    for (const mesh of this.seen) mesh.visible = on;
    if (this.seen.length) for (const mesh of this.drawn) mesh.visible = !on;
  }
}

function armMaterial(color: number, opacity: number, vertexColors: boolean): THREE.Material {
  if (opacity === 1)
    return new THREE.MeshPhongMaterial({ color, vertexColors, shininess: 28, specular: 0x333333 });
  const behind = {
    depthWrite: false,
    polygonOffset: true,
    polygonOffsetFactor: 2,
    polygonOffsetUnits: 2,
  };
  return new THREE.MeshLambertMaterial({
    color,
    opacity,
    vertexColors,
    transparent: true,
    ...behind,
  });
}
