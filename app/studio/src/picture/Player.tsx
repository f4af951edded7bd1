import { Icon } from "../ui/icons";
import { duration, played, playing, time } from "../store/state";
import { figure } from "../store/units";
import { goTo, loop, speed, toggle } from "./clock";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2];

/** Plays the motion. */
export function Player() {
  const off = !played.value;
  return (
    <div class="player" id="player">
      <button
        type="button"
        id="play"
        class="button bare"
        aria-label={playing.value ? "Pause" : "Play"}
        disabled={off}
        onClick={toggle}
      >
        <Icon name={playing.value ? "pause" : "play"} />
      </button>
      <output id="clock">{time.value.toFixed(3)} s</output>
      <input
        id="scrub"
        type="range"
        min={0}
        max={duration.value}
        step="any"
        value={time.value}
        aria-label="Time"
        aria-valuetext={`${figure(time.value)} of ${figure(duration.value)} seconds`}
        disabled={off}
        onInput={(event) => goTo(Number(event.currentTarget.value))}
      />
      <span class="hint">{figure(duration.value)} s</span>
      <select
        aria-label="Speed of playing"
        value={speed.value}
        onChange={(event) => (speed.value = Number(event.currentTarget.value))}
      >
        {SPEEDS.map((each) => (
          <option key={each} value={each}>
            {each}×
          </option>
        ))}
      </select>
      <label>
        <input
          type="checkbox"
          id="loop"
          checked={loop.value}
          onChange={(event) => (loop.value = event.currentTarget.checked)}
        />{" "}
        loop
      </label>
    </div>
  );
}
