// Shapes of requests as three.js geometry: obstacles, tool capsules, payloads. Lengths in m.
import * as THREE from "three";
import { ConvexGeometry } from "three/addons/geometries/ConvexGeometry.js";
import { ofPose, type Matrix } from "../store/chain";
import { fromBase64 } from "../store/share";
import type { Shape } from "../store/types";

const SIDE = 8; // of what is drawn of a half space [m]
const MOST_CELLS = 60000; // drawn of a point cloud or of voxels

/** Gives an object a pose as a matrix. */
export function place<T extends THREE.Object3D>(object: T, T_: Matrix): T {
  object.matrixAutoUpdate = false;
  object.matrix.fromArray(T_).transpose();
  object.matrixWorldNeedsUpdate = true;
  return object;
}

const upright = <T extends THREE.BufferGeometry>(geometry: T) => geometry.rotateX(Math.PI / 2);

/**
 * A geometry from `from` to `to`, both [x, y, z], made along z about its centre by `make(length)`.
 */
export function along(
  from: number[],
  to: number[],
  make: (length: number) => THREE.BufferGeometry,
): THREE.BufferGeometry {
  const [a, b] = [new THREE.Vector3().fromArray(from), new THREE.Vector3().fromArray(to)];
  const direction = b.clone().sub(a);
  const geometry = make(direction.length());
  const turn = new THREE.Quaternion().setFromUnitVectors(
    new THREE.Vector3(0, 0, 1),
    direction.clone().normalize(),
  );
  const middle = a.add(b).multiplyScalar(0.5);
  return geometry.applyQuaternion(turn).translate(middle.x, middle.y, middle.z);
}

export const capsule = (from: number[], to: number[], radius: number, segments = 20) =>
  along(from, to, (length) => upright(new THREE.CapsuleGeometry(radius, length, 8, segments)));

/** A cylinder along z whose edges are rounded by `round` [m]. */
export function roundedCylinder(
  radius: number,
  length: number,
  round: number,
  segments = 32,
): THREE.BufferGeometry {
  const edge = Math.min(round, radius / 2, length / 2);
  const [wide, high] = [radius - edge, length / 2 - edge];
  const profile = new THREE.Path();
  profile.lineTo(0, -length / 2);
  profile.absarc(wide, -high, edge, -Math.PI / 2, 0);
  profile.absarc(wide, high, edge, 0, Math.PI / 2);
  profile.lineTo(0, length / 2);
  return upright(new THREE.LatheGeometry(profile.getPoints(2).slice(1), segments));
}

interface Fields extends Shape {
  vertices?: number[][];
  points?: number[][];
  cells?: number[][];
  bits?: { dimensions: number[]; data: string };
  format?: string;
  data?: string;
  scale?: number;
}

/**
 * An object in the frame of the shape's pose; `margin` [m] makes it thicker. Mesh files fill
 * themselves later.
 */
export function shapeObject(shape: Fields, material: THREE.Material, margin = 0): THREE.Object3D {
  const solid = (geometry: THREE.BufferGeometry) => new THREE.Mesh(geometry, material);
  const twice = 2 * margin;
  const radius = (shape.radius ?? 0) + margin;
  switch (shape.shape) {
    case "box": {
      const [x = 0, y = 0, z = 0] = (shape.size as number[]).map((edge) => edge + twice);
      return solid(new THREE.BoxGeometry(x, y, z));
    }
    case "sphere":
      return solid(new THREE.SphereGeometry(radius, 32, 20));
    case "cylinder":
      return solid(
        upright(new THREE.CylinderGeometry(radius, radius, (shape.length ?? 0) + twice, 40)),
      );
    case "capsule":
      return solid(upright(new THREE.CapsuleGeometry(radius, shape.length ?? 0, 10, 28)));
    case "mesh":
      return solid(new ConvexGeometry(hull(shape.vertices ?? [], margin)));
    case "half_space":
      return halfSpace(material, margin);
    case "points":
      return cells(new THREE.IcosahedronGeometry(radius, 1), shape.points ?? [], material);
    case "voxels": {
      const size = shape.size as number;
      return cells(
        new THREE.BoxGeometry(size + twice, size + twice, size + twice),
        voxelCentres(shape, size),
        material,
      );
    }
    case "mesh_file":
      return meshFile(shape, material);
    default:
      return new THREE.Group();
  }
}

/** The corners of a hull, `margin` [m] farther out. */
function hull(vertices: number[][], margin: number): THREE.Vector3[] {
  const corners = vertices.map((point) => new THREE.Vector3().fromArray(point));
  if (!margin) return corners;
  const ball = new THREE.IcosahedronGeometry(margin, 1).attributes.position!;
  const around = Array.from({ length: ball.count }, (_, k) =>
    new THREE.Vector3().fromBufferAttribute(ball, k),
  );
  return corners.flatMap((corner) => around.map((offset) => corner.clone().add(offset)));
}

function halfSpace(material: THREE.Material, margin: number): THREE.Object3D {
  const plane = new THREE.Mesh(new THREE.PlaneGeometry(SIDE, SIDE), material);
  plane.position.z = margin;
  return new THREE.Group().add(plane);
}

function cells(
  geometry: THREE.BufferGeometry,
  centres: number[][],
  material: THREE.Material,
): THREE.Object3D {
  const step = Math.ceil(centres.length / MOST_CELLS);
  const drawn = centres.filter((_, k) => k % step === 0);
  const mesh = new THREE.InstancedMesh(geometry, material, drawn.length);
  const T = new THREE.Matrix4();
  drawn.forEach(([x = 0, y = 0, z = 0], k) => mesh.setMatrixAt(k, T.makeTranslation(x, y, z)));
  return mesh;
}

function voxelCentres({ cells: given, bits }: Fields, size: number): number[][] {
  const centre = (cell: number[]) => cell.map((index) => (index + 0.5) * size);
  if (given) return given.map(centre);
  if (!bits) return [];
  const [nx = 1, ny = 1, nz = 1] = bits.dimensions;
  const bytes = fromBase64(bits.data);
  const centres: number[][] = [];
  for (let bit = 0; bit < nx * ny * nz; bit++)
    if ((bytes[bit >> 3]! >> (bit & 7)) & 1)
      centres.push(centre([bit % nx, Math.floor(bit / nx) % ny, Math.floor(bit / (nx * ny))]));
  return centres;
}

// the reader of a format is loaded when it is needed
const READERS: Record<string, (bytes: Uint8Array) => Promise<THREE.Object3D>> = {
  stl: async (bytes) => {
    const { STLLoader } = await import("three/addons/loaders/STLLoader.js");
    return new THREE.Mesh(new STLLoader().parse(bytes.buffer as ArrayBuffer));
  },
  obj: async (bytes) => {
    const { OBJLoader } = await import("three/addons/loaders/OBJLoader.js");
    return new OBJLoader().parse(new TextDecoder().decode(bytes));
  },
  glb: async (bytes) => {
    const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
    return (await new GLTFLoader().parseAsync(bytes.buffer as ArrayBuffer, "")).scene;
  },
};

/** The object in a file of a format: `stl`, `obj` or `glb`. */
export function readMeshes(format: string, bytes: Uint8Array): Promise<THREE.Object3D> {
  const read = READERS[format];
  return read ? read(bytes) : Promise.reject(new Error(`There is no reader for ${format}.`));
}

/** The sides of the box around a file's meshes, in the file's own unit; null without meshes. */
export async function extentOf(format: string, bytes: Uint8Array): Promise<number[] | null> {
  const box = new THREE.Box3().setFromObject(await readMeshes(format, bytes.slice()));
  return box.isEmpty() ? null : box.getSize(new THREE.Vector3()).toArray();
}

/** A group that fills itself. */
function meshFile(
  { format = "", data = "", scale = 1 }: Fields,
  material: THREE.Material,
): THREE.Object3D {
  const group = new THREE.Group();
  group.scale.setScalar(scale);
  const fill = (object: THREE.Object3D) => {
    // some files have no normals, or zeros
    object.traverse((part) => {
      if (!(part instanceof THREE.Mesh)) return;
      part.geometry.computeVertexNormals();
      part.material = material;
    });
    group.add(object);
    (group.userData.filled as (() => void) | undefined)?.();
  };
  readMeshes(format, fromBase64(data))
    .then(fill)
    .catch((error: Error) => console.warn(`A mesh file cannot be drawn: ${error.message}`));
  return group;
}

/** An obstacle, tool or payload shape at its own pose. */
export function placedShape(shape: Shape, material: THREE.Material, margin = 0): THREE.Object3D {
  return place(new THREE.Group(), ofPose(shape.pose)).add(shapeObject(shape, material, margin));
}
