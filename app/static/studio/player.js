// The clock of the page: play, scrub, speed, loop, keys.
import { $, figure } from "./dom.js";
import { follow, set, state } from "./store.js";

const REST = 0.7; // at the end of the motion, before it begins again [s]

let [before, resting] = [null, 0]; // time of the frame before [ms], and at the end of the motion [s]

export function createPlayer(view) {
  $("play").onclick = toggle;
  $("scrub").oninput = (event) => goTo(Number(event.target.value));
  for (const box of document.querySelectorAll("[data-show]"))
    box.onchange = () => set({ show: { ...state.show, [box.dataset.show]: box.checked } });
  document.addEventListener("keydown", (event) => keys(event, view));
  follow("time duration", () => {
    const scrub = $("scrub");
    scrub.max = state.duration;
    scrub.value = state.time;
    $("clock").textContent = `${state.time.toFixed(3)} s`;
    scrub.setAttribute("aria-valuetext", `${figure(state.time)} of ${figure(state.duration)} seconds`);
  });
  follow("playing", () => {
    $("play").textContent = state.playing ? "▮▮" : "▶";
    $("play").setAttribute("aria-label", state.playing ? "Pause" : "Play");
  });
}

/** Sets the time, and holds the motion there. */
export const goTo = (time) => set({ playing: false, time: Math.max(0, Math.min(state.duration, time)) });

const toggle = () => (state.playing ? set({ playing: false }) : play());

/** Plays from where the clock is; from the start, if it is at the end. */
export function play() {
  if (state.playing || !state.answer) return;
  [before, resting] = [null, 0];
  set({ playing: true, ...(state.time >= state.duration ? { time: 0 } : {}) });
  requestAnimationFrame(tick);
}

function tick(now) {
  if (!state.playing) return;
  const passed = before === null ? 0 : Math.min((now - before) / 1000, 0.25);
  before = now;
  if (state.time >= state.duration) {
    resting += passed;
    if (!$("loop").checked) return set({ playing: false });
    if (resting > REST) {
      resting = 0;
      set({ time: 0 });
    }
  } else {
    set({ time: Math.min(state.duration, state.time + passed * Number($("speed").value)) });
  }
  requestAnimationFrame(tick);
}

/** Time of the sample `steps` away from the present one. */
function neighbour(steps) {
  const times = state.answer?.trajectory.t ?? [0];
  let nearest = times.findLastIndex((t) => t <= state.time + 1e-9);
  if (steps < 0 && state.time > times[nearest] + 1e-9) nearest += 1;
  return times[Math.max(0, Math.min(times.length - 1, nearest + steps))];
}

function keys(event, view) {
  if (event.target.closest("input:not([type=range]), select, textarea, dialog, [role=tab], summary") || event.ctrlKey || event.metaKey || event.altKey) return;
  const onButton = event.target.closest("button, a");
  const act = {
    " ": () => !onButton && toggle(),
    ArrowRight: () => goTo(neighbour(1)),
    ArrowLeft: () => goTo(neighbour(-1)),
    Home: () => goTo(0),
    End: () => goTo(state.duration),
    r: () => view?.look(1),
  }[event.key.length > 1 ? event.key : event.key.toLowerCase()];
  if (/^[1-6]$/.test(event.key)) view?.look(Number(event.key));
  else if (!act || (event.key === " " && onButton)) return;
  else act();
  event.preventDefault();
}
