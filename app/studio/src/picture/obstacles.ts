// An obstacle as an object of the picture, with its margin as a shell.
import * as THREE from "three";
import { DEFAULT_MARGIN } from "../store/request";
import type { Obstacle } from "../store/types";
import { figure } from "../store/units";
import type { Solid } from "./eye";
import { placedShape } from "./shapes";
import { colour } from "./theme";

// to look for thousands of parts between eye and arm would take longer than to draw them
const MANY_PARTS = ["points", "voxels", "mesh_file"];

/**
 * Draws an obstacle; `filled` is called when a mesh file has been read. Throws where it is of wrong
 * types.
 */
export function drawnObstacle(
  obstacle: Obstacle,
  filled: () => void,
): { object: THREE.Object3D; shell: THREE.Object3D | null } {
  const solid = obstacle.shape !== "half_space";
  const material = new THREE.MeshLambertMaterial({
    color: colour(solid ? "--obstacle" : "--floor"),
    // from within, a half space hides nothing: below a floor, or where the base hangs
    side: solid ? THREE.DoubleSide : THREE.FrontSide,
  });
  const object = placedShape(obstacle, material);
  const margin = typeof obstacle.margin === "number" ? obstacle.margin : DEFAULT_MARGIN;
  object.userData = {
    material,
    solid,
    hides: solid && !MANY_PARTS.includes(obstacle.shape),
    name: obstacle.name,
    title: `${obstacle.name}, margin ${figure(margin * 1000)} mm`,
  } satisfies Solid;
  object.traverse((mesh) => {
    mesh.receiveShadow = true;
    mesh.castShadow = solid;
  });
  object.children[0]!.userData.filled = filled;
  if (margin <= 0 || obstacle.shape === "mesh_file") return { object, shell: null };
  const red = new THREE.MeshBasicMaterial({
    color: 0xd64545,
    transparent: true,
    opacity: 0.16,
    depthWrite: false,
    side: THREE.DoubleSide,
  });
  const shell = placedShape(obstacle, red, margin);
  shell.userData.of = object;
  return { object, shell };
}
