// Shapes of requests as three.js geometry: obstacles, tool capsules, payloads. Lengths in m.
import * as THREE from "three";
import { ConvexGeometry } from "three/addons/geometries/ConvexGeometry.js";
import { ofPose } from "./chain.js";

const SIDE = 8; // of what is drawn of a half space [m]
const MOST_CELLS = 60000; // drawn of a point cloud or of voxels

/** Gives an object a pose as a matrix. */
export function place(object, T) {
  object.matrixAutoUpdate = false;
  object.matrix.set(...T);
  object.matrixWorldNeedsUpdate = true;
  return object;
}

const upright = (geometry) => geometry.rotateX(Math.PI / 2);

/** A geometry from `from` to `to`, both [x, y, z], made along z about its centre by `make(length)`. */
export function along(from, to, make) {
  const [a, b] = [new THREE.Vector3(...from), new THREE.Vector3(...to)];
  const direction = b.clone().sub(a);
  const geometry = make(direction.length());
  const turn = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 0, 1), direction.clone().normalize());
  return geometry.applyQuaternion(turn).translate(...a.add(b).multiplyScalar(0.5).toArray());
}

export const capsule = (from, to, radius, segments = 20) =>
  along(from, to, (length) => upright(new THREE.CapsuleGeometry(radius, length, 8, segments)));

/** A cylinder along z whose edges are rounded by `round` [m]. */
export function roundedCylinder(radius, length, round, segments = 32) {
  const edge = Math.min(round, radius / 2, length / 2);
  const [wide, high] = [radius - edge, length / 2 - edge];
  const profile = new THREE.Path().lineTo(0, -length / 2).absarc(wide, -high, edge, -Math.PI / 2, 0).absarc(wide, high, edge, 0, Math.PI / 2).lineTo(0, length / 2);
  return upright(new THREE.LatheGeometry(profile.getPoints(2).slice(1), segments));
}

/** An object in the frame of the shape's pose; `margin` [m] makes it thicker. Mesh files come as a promise in `later`. */
export function shapeObject(shape, material, margin = 0) {
  const solid = (geometry) => new THREE.Mesh(geometry, material);
  const twice = 2 * margin;
  switch (shape.shape) {
    case "box": return solid(new THREE.BoxGeometry(...shape.size.map((edge) => edge + twice)));
    case "sphere": return solid(new THREE.SphereGeometry(shape.radius + margin, 32, 20));
    case "cylinder": return solid(upright(new THREE.CylinderGeometry(shape.radius + margin, shape.radius + margin, shape.length + twice, 40)));
    case "capsule": return solid(upright(new THREE.CapsuleGeometry(shape.radius + margin, shape.length, 10, 28)));
    case "mesh": return solid(new ConvexGeometry(hull(shape.vertices, margin)));
    case "half_space": return halfSpace(material, margin);
    case "points": return cells(new THREE.IcosahedronGeometry(shape.radius + margin, 1), shape.points, material);
    case "voxels": return cells(new THREE.BoxGeometry(...[0, 0, 0].map(() => shape.size + twice)), voxelCentres(shape), material);
    case "mesh_file": return meshFile(shape, material);
    default: return new THREE.Group();
  }
}

/** The corners of a hull, `margin` [m] farther out. */
function hull(vertices, margin) {
  const corners = vertices.map((point) => new THREE.Vector3(...point));
  if (!margin) return corners;
  const ball = new THREE.IcosahedronGeometry(margin, 1).attributes.position;
  const around = Array.from({ length: ball.count }, (_, k) => new THREE.Vector3().fromBufferAttribute(ball, k));
  return corners.flatMap((corner) => around.map((offset) => corner.clone().add(offset)));
}

function halfSpace(material, margin) {
  const plane = new THREE.Mesh(new THREE.PlaneGeometry(SIDE, SIDE), material);
  plane.position.z = margin;
  const group = new THREE.Group();
  group.add(plane);
  return group;
}

function cells(geometry, centres, material) {
  const step = Math.ceil(centres.length / MOST_CELLS);
  const drawn = centres.filter((_, k) => k % step === 0);
  const mesh = new THREE.InstancedMesh(geometry, material, drawn.length);
  const T = new THREE.Matrix4();
  drawn.forEach((centre, k) => mesh.setMatrixAt(k, T.makeTranslation(...centre)));
  return mesh;
}

function voxelCentres({ size, cells: given, bits }) {
  const centre = (cell) => cell.map((index) => (index + 0.5) * size);
  if (given) return given.map(centre);
  const [nx, ny, nz] = bits.dimensions;
  const bytes = fromBase64(bits.data);
  const centres = [];
  for (let bit = 0; bit < nx * ny * nz; bit++)
    if ((bytes[bit >> 3] >> (bit & 7)) & 1) centres.push(centre([bit % nx, Math.floor(bit / nx) % ny, Math.floor(bit / (nx * ny))]));
  return centres;
}

export const fromBase64 = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

// the reader of a format is loaded when it is needed
const READERS = {
  stl: async (bytes) => new THREE.Mesh(new (await import("three/addons/loaders/STLLoader.js")).STLLoader().parse(bytes.buffer)),
  obj: async (bytes) => new (await import("three/addons/loaders/OBJLoader.js")).OBJLoader().parse(new TextDecoder().decode(bytes)),
  glb: async (bytes) => (await new (await import("three/addons/loaders/GLTFLoader.js")).GLTFLoader().parseAsync(bytes.buffer, "")).scene,
};

/** The object in a file of a format: `stl`, `obj` or `glb`. */
export const readMeshes = (format, bytes) => READERS[format](bytes);

/** A group that fills itself. */
function meshFile({ format, data, scale = 1 }, material) {
  const group = new THREE.Group();
  group.scale.setScalar(scale);
  const fill = (object) => {
    // some files have no normals, or zeros
    object.traverse((part) => { if (part.isMesh) part.geometry.computeVertexNormals(), part.material = material; });
    group.add(object);
    group.dispatchEvent({ type: "filled" });
  };
  readMeshes(format, fromBase64(data)).then(fill).catch((error) => console.warn(`A mesh file cannot be drawn: ${error.message}`));
  return group;
}

/** An obstacle, tool or payload shape at its own pose. */
export function placedShape(shape, material, margin = 0) {
  const outer = place(new THREE.Group(), ofPose(shape.pose));
  outer.add(shapeObject(shape, material, margin));
  return outer;
}
