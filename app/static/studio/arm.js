// An arm as three.js objects: its links from the figures, its tool and its payload; and what collision checks see.
import * as THREE from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import { IDENTITY } from "./chain.js";
import { along, capsule, place, placedShape, roundedCylinder } from "./shapes.js";

const COLOURS = { tube: 0xe3e7ec, housing: 0xcfd5dc, cap: 0x2f7fb8, ring: 0x3a424c, foot: 0x555e69, tool: 0x2f3742, payload: 0xd8951f };
const ROUNDED = { tube: 0.01, housing: 0.04, cap: 0.16, ring: 0.01, foot: 0.1 }; // edges, of the radius
const SIDES = 22; // of round bodies
const WATER = 1000; // density [kg/m³]
const geometries = new Map(); // of each robot, by name: several arms share them

/** Names of the links, base first. */
export const linkNames = (robot) => ["base", ...robot.kinematics.link_names.value];

/** One geometry for each link, with the colours of its bodies, and one with the capsules of its collision checks. */
function robotGeometry(robot) {
  if (!geometries.has(robot.name)) {
    const drawn = robot.form.map((bodies) => merged(bodies.map((body) => coloured(bodyGeometry(body), COLOURS[body.kind]))));
    const capsules = linkNames(robot).map((name) => robot.collision[name]?.value ?? []);
    const seen = capsules.map((own) => merged(own.map((row) => capsule(row.slice(0, 3), row.slice(3, 6), row[6], 14))));
    geometries.set(robot.name, { drawn, seen });
  }
  return geometries.get(robot.name);
}

/** Draws a robot by these geometries from now on, one for each link, with colours. */
export const drawBy = (robot, drawn) => Object.assign(robotGeometry(robot), { drawn });

const merged = (parts) => (parts.length ? mergeGeometries(parts) : new THREE.BufferGeometry());

function coloured(geometry, colour) {
  const one = new THREE.Color(colour).toArray();
  const all = Array.from({ length: geometry.attributes.position.count }, () => one).flat();
  return geometry.setAttribute("color", new THREE.Float32BufferAttribute(all, 3));
}

const bodyGeometry = ({ kind, start, end, radius }) => along(start, end, (length) => roundedCylinder(radius, length, ROUNDED[kind] * radius, SIDES));

/** What is drawn of a payload: its shape; without one, the ball that as much water has. */
const loadShape = ({ mass, com, shape }) =>
  shape ?? { shape: "sphere", radius: Math.cbrt((3 * mass) / (4 * Math.PI * WATER)), pose: { position: com ?? [0, 0, 0] } };

/** One arm in the scene. `tint`: a colour over its own ones. `opacity` below 1: a ghost, in the tint alone. `loads`: the
 * payloads that it carries one after the other. */
export class Arm {
  constructor(chain, robot, request, { tint = 0xffffff, opacity = 1, loads = [request.payload] } = {}) {
    this.chain = chain;
    this.object = new THREE.Group();
    const ghost = opacity < 1;
    const { drawn, seen } = robotGeometry(robot);
    const own = armMaterial(tint, opacity, !ghost);
    const of = (kind) => (ghost ? own : armMaterial(COLOURS[kind], 1, false));
    this.links = [...drawn, null].map(() => place(new THREE.Group(), IDENTITY));
    const put = (link, geometry, material) => {
      const mesh = new THREE.Mesh(geometry, material);
      mesh.castShadow = !ghost;
      this.links[link].add(mesh);
      return mesh;
    };
    // ghosts and further arms stand on the same base
    this.drawn = drawn.map((geometry, link) => link > 0 || tint === 0xffffff ? put(link, geometry, own) : null).filter(Boolean);
    this.seen = ghost ? [] : seen.map((geometry, link) => put(link, geometry, armMaterial(0x66aadd, 0.45, false)));
    for (const mesh of this.seen) mesh.castShadow = false;
    const tool = (request.tool?.capsules ?? []).map(({ start, end, radius }) => capsule(start, end, radius, 16));
    if (tool.length) put(drawn.length, merged(tool), of("tool"));
    this.loads = loads.map((payload) => {
      const part = payload?.mass ? placedShape(loadShape(payload), of("payload")) : new THREE.Group();
      part.traverse((each) => { each.castShadow = !ghost; });
      this.links.at(-1).add(part);
      return part;
    });
    this.object.add(...this.links);
    this.showCapsules(false);
    this.carry(0);
  }

  /** Shows the load of this number alone. */
  carry(number) {
    this.loads.forEach((part, k) => { part.visible = k === number; });
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

function armMaterial(color, opacity, vertexColors) {
  if (opacity === 1) return new THREE.MeshPhongMaterial({ color, vertexColors, shininess: 28, specular: 0x333333 });
  const behind = { depthWrite: false, polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 2 };
  return new THREE.MeshLambertMaterial({ color, opacity, vertexColors, transparent: true, ...behind });
}
