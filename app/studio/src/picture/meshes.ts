// The maker's meshes, where the service has them: they take the place of what is drawn from a
// robot's figures.
import { effect, untracked } from "@preact/signals";
import type * as THREE from "three";
import { meshFileOf } from "../store/service";
import type { Robot } from "../store/types";
import { drawBy, linkNames } from "./arm";
import { pictured } from "./pictured";
import { readMeshes } from "./shapes";
import type { View } from "./view";

/** Draws every robot that is shown by its meshes, as soon as they are there. */
export function followMeshes(view: View): () => void {
  const drawn = new Set<string>();
  const load = async (robot: Robot) => {
    if (drawn.has(robot.name) || !robot.has_meshes) return;
    try {
      const scene = await readMeshes("glb", await meshFileOf(robot.name));
      drawn.add(robot.name);
      drawBy(
        robot,
        linkNames(robot).map((name) => (scene.getObjectByName(name) as THREE.Mesh).geometry),
      );
      view.build();
    } catch {
      // drawn from its figures; the next answer asks again
    }
  };
  return effect(() => {
    const robot = pictured.value?.robot;
    if (robot) untracked(() => void load(robot));
  });
}
