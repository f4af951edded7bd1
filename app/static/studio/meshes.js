// The maker's meshes, where the service has them: they take the place of what is drawn from a robot's figures.
import { send } from "./api.js";
import { drawBy, linkNames } from "./arm.js";
import { fromBase64, readMeshes } from "./shapes.js";
import { follow, state } from "./store.js";

const files = new Map(); // name of a robot: promise of its file

/** The file (glTF) of a robot's meshes, asked for once. Throws Problem. */
export function meshFileOf({ name }) {
  if (!files.has(name)) {
    const asked = send(`robots/${encodeURIComponent(name)}/meshes.glb`, {}).then(async (file) => new Uint8Array(await file.arrayBuffer()));
    // the picture is there without them: the next answer asks again
    files.set(name, asked.catch((error) => { files.delete(name); throw error; }));
  }
  return files.get(name);
}

/** Draws every robot that is shown by its meshes, as soon as they are there. `inside`: what a page that stands alone has
 * inside of it; it asks for none. */
export function createMeshes(view, inside) {
  const drawn = new Set();
  follow("robot", async ({ robot }) => {
    if (!view || drawn.has(robot.name) || !(inside ? inside.meshes : robot.has_meshes)) return;
    try {
      const scene = await readMeshes("glb", inside ? fromBase64(inside.meshes) : await meshFileOf(robot));
      drawn.add(robot.name);
      drawBy(robot, linkNames(robot).map((name) => scene.getObjectByName(name).geometry));
      if (state.answer) view.build();
    } catch {
      // drawn from its figures
    }
  });
}
