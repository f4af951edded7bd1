// The clock of the page: play, scrub, speed, loop.
import { signal } from "@preact/signals";
import { duration, played, playing, time } from "../store/state";

const REST = 0.7; // at the end of the motion, before it begins again [s]

export const speed = signal(1);
export const loop = signal(true);

let [before, resting]: [number | null, number] = [null, 0];

/** Sets the time, and holds the motion there. */
export function goTo(to: number): void {
  playing.value = false;
  time.value = Math.max(0, Math.min(duration.value, to));
}

export const toggle = () => (playing.value ? (playing.value = false) : play());

/** Plays from where the clock is; from the start, if it is at the end. */
export function play(): void {
  if (playing.value || !played.value) return;
  [before, resting] = [null, 0];
  playing.value = true;
  if (time.value >= duration.value) time.value = 0;
  requestAnimationFrame(tick);
}

function tick(now: number): void {
  if (!playing.value) return;
  if (!played.value) {
    playing.value = false;
    return;
  }
  const passed = before === null ? 0 : Math.min((now - before) / 1000, 0.25);
  before = now;
  if (time.value >= duration.value) {
    resting += passed;
    if (!loop.value) {
      playing.value = false;
      return;
    }
    if (resting > REST) [resting, time.value] = [0, 0];
  } else {
    time.value = Math.min(duration.value, time.value + passed * speed.value);
  }
  requestAnimationFrame(tick);
}

/** Time of the sample `steps` away from the present one. */
export function neighbour(steps: number): number {
  const times = played.value?.solution.trajectory.t ?? [0];
  let nearest = times.findLastIndex((t) => t <= time.value + 1e-9);
  if (steps < 0 && time.value > times[nearest]! + 1e-9) nearest += 1;
  return times[Math.max(0, Math.min(times.length - 1, nearest + steps))]!;
}
