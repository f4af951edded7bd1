import { Button } from "../ui/Button";
import { Icon } from "../ui/icons";
import { Section } from "../ui/Section";
import { play } from "../picture/clock";
import { answered, ghosts, playing, racers, stale, time, toast, type Racer } from "../store/state";
import { fixed, figure } from "../store/units";
import { capital, postureWords } from "../store/facts";
import { postures, type Posture } from "./postures";

const COLOURS = [0xee6677, 0x228833, 0xaa3377, 0x4477aa];
const MOST = 3; // arms beside that of the answer

const degrees = (q: number[]) => q.map((value) => fixed((value * 180) / Math.PI, 0));

/**
 * Postures at the goal, with joints as the pendant shows them and the energy of the motion there.
 */
export function Postures() {
  const shown = answered.value;
  const all = postures.value;
  if (!shown || shown.cycle || !all?.length) return null;
  const free = all.filter(({ state }) => state !== "collides");
  const copy = () => {
    const text = all
      .map(({ letter, q, energy }) => [letter, ...degrees(q), figure(energy)].join("\t"))
      .join("\n");
    navigator.clipboard?.writeText(text).then(
      () => (toast.value = "The joint positions are copied in degrees."),
      () => undefined,
    );
  };
  const [best] = all;
  const collide = all.length - free.length;
  return (
    <Section
      title="Postures at the goal"
      note="degrees"
      id="postures"
      action={
        <Button kind="link" onClick={copy}>
          Copy joints
        </Button>
      }
    >
      <div class="scroll" role="region" aria-label="Postures" tabIndex={0}>
        <table class={stale.value ? "stale" : undefined}>
          <thead>
            <tr>
              <td />
              {best!.q.map((_, k) => (
                <th scope="col" key={k}>
                  {k ? k + 1 : "joint 1"}
                </th>
              ))}
              <th scope="col">J</th>
            </tr>
          </thead>
          <tbody>
            {all.map((posture) => (
              <Row key={posture.letter} posture={posture} />
            ))}
          </tbody>
        </table>
      </div>
      <p class="hint">
        {best!.letter}: {postureWords(best!.label)}. Every motion begins at its best start.
        {collide > 0 &&
          ` ${collide} of ${all.length} postures ${collide === 1 ? "collides" : "collide"} at the goal.`}
      </p>
    </Section>
  );
}

function Row({ posture }: { posture: Posture }) {
  const { letter, label, q, state, energy, why, solution } = posture;
  const own = solution !== null && solution === answered.value?.solution;
  const name = `Posture ${letter}`;
  const seen =
    own ||
    racers.value.some((each) => each.name === name) ||
    ghosts.value.some((each) => each.q === q);
  return (
    <tr class={own ? "best" : state} title={why || capital(postureWords(label))}>
      <th scope="row">
        <button
          type="button"
          class="plain"
          aria-pressed={seen}
          aria-label={`${seen ? "Hide" : "Show"} posture ${letter}`}
          disabled={own}
          onClick={() => showPosture(posture, name, seen)}
        >
          <Icon name={seen ? "eye" : "eyeOff"} /> {letter}
        </button>
      </th>
      {degrees(q).map((text, k) => (
        <td key={k}>{text}</td>
      ))}
      <td>
        {state === "computing"
          ? "…"
          : state === "collides"
            ? "collides"
            : state === "failed"
              ? "–"
              : figure(energy)}
      </td>
    </tr>
  );
}

/** A posture with a motion races against the answer's arm; one without is a ghost. */
function showPosture({ q, solution }: Posture, name: string, seen: boolean): void {
  if (seen) {
    racers.value = racers.value.filter((each) => each.name !== name);
    ghosts.value = ghosts.value.filter((each) => each.q !== q);
  } else if (solution) {
    race({ name, solution, colour: 0 });
  } else {
    ghosts.value = [
      ...ghosts.value,
      { q, colour: COLOURS[ghosts.value.length % COLOURS.length]! },
    ].slice(-4);
  }
}

/** Lets an arm move beside that of the answer, on the same clock. */
export function race(racer: Racer): void {
  const others = racers.value.filter(({ name }) => name !== racer.name).slice(0, MOST - 1);
  racers.value = [...others, { ...racer, colour: COLOURS[others.length]! }];
  playing.value = false;
  time.value = 0;
  play();
}
