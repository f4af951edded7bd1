// The maker's meshes, where the service has them: they take the place of what is drawn from a robot's figures.
import { send } from "./api.js";
import { drawBy } from "./arm.js";
import { linkNames } from "./links.js";
import { follow } from "./store.js";

const asked = new Set(); // names of robots

/** Asks for the meshes of every robot that is shown, once, and draws the picture anew with them. */
export function createMeshes(view) {
  follow("robot", async ({ robot }) => {
    if (!view || !robot.has_meshes || asked.has(robot.name)) return;
    asked.add(robot.name);
    try {
      drawBy(robot, await meshesOf(robot));
      view.build();
    } catch {
      asked.delete(robot.name); // the picture is there without them: the next answer asks again
    }
  });
}

async function meshesOf(robot) {
  const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
  const file = await send(`robots/${encodeURIComponent(robot.name)}/meshes.glb`, {});
  const { scene } = await new GLTFLoader().parseAsync(await file.arrayBuffer(), "");
  return linkNames(robot).map((name) => scene.getObjectByName(name).geometry);
}
