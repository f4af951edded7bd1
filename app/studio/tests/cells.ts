import type { ApiRequest } from "../src/store/types";

/** A move of a UR5e from joints to a pose, as people type one. */
export const MOVE: ApiRequest = {
  robot: "ur5e",
  start: { q: [0, -1.5, 1.5, -1.5, -1.5, 0] },
  goal: { pose: { position: [-0.35, -0.52, 0.45], rpy: [Math.PI / 2, 0, 0] } },
  payload: { mass: 0.8, com: [0, 0, 0.05] },
  scene: {
    obstacles: [
      { name: "table", shape: "half_space", pose: { position: [0, 0, -0.02], rotvec: [0, 0, 0] } },
    ],
  },
};
