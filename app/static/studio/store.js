// What the page shows, and who follows it. Everything else reads and changes the page through this.

export const state = {
  request: null, // body of POST /optimize as it is edited
  asked: null, // the body that `answer` belongs to
  cell: null, // what is drawn around the answer: tool, payload and obstacles, in the base frame
  answer: null,
  robot: null, // GET /robots/{name} of the answer
  arms: [], // [{name, colour, answer}]: the answer and further branches, which move on one clock
  problem: null, // the error that is shown
  best: null, // the best motion so far of the request that is being computed: {robot, energy, q_goal, ...}
  cycle: null, // answer of POST /cycle
  time: 0,
  duration: 1,
  playing: false,
  chosen: [], // candidates drawn as ghosts
  show: { ghosts: true, path: true, nearest: true, margins: false, capsules: false, axes: true, fade: true },
};

const followers = [];

/** Calls `then(state)` whenever one of the names was set. */
export const follow = (names, then) => void followers.push({ names: new Set(names.split(" ")), then });

/** Sets some of the state, then calls those who follow it. */
export function set(changes) {
  Object.assign(state, changes);
  for (const { names, then } of followers) if (Object.keys(changes).some((name) => names.has(name))) then(state);
}
