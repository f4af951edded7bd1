import { signal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import type uPlot from "uplot";
import { Button } from "../ui/Button";
import { style } from "../ui/style";
import { compute, showAnswer } from "../store/run";
import { keptAnswer } from "../store/service";
import { save } from "../store/share";
import { answered, run, stale } from "../store/state";
import { trying } from "../store/trouble";
import type { ApiRequest } from "../store/types";
import { figure } from "../store/units";
import { Chart } from "./Chart";

interface Point {
  duration: number;
  energy: number;
  answer: string;
}

const front = signal<{ points: Point[]; asked: ApiRequest } | null>(null);

async function ask(): Promise<void> {
  const asked = answered.value!.asked!;
  const range = typeof asked.duration === "number" ? null : (asked.duration ?? null);
  const deadline = Math.max(30, typeof asked.deadline === "number" ? asked.deadline : 10);
  const body = { ...asked, duration: range, candidates: "none", deadline };
  const answer = (await compute("pareto", body, deadline)) as { points: Point[] } | null;
  if (answer) front.value = { points: answer.points, asked };
}

const csvOf = (points: Point[]) =>
  ["duration_s,energy_J", ...points.map(({ duration, energy }) => `${duration},${energy}`)].join(
    "\n",
  );

const load = async (path: string) => {
  const { asked } = front.value!;
  await showAnswer(await keptAnswer(path), asked);
};

/** The least energy of each duration. A click on a point loads its motion. */
export function Front() {
  const shown = answered.value!;
  const known = front.value && shown.asked === front.value.asked ? front.value.points : null;
  if (!known)
    return (
      <div class="chart-empty">
        <p class="hint">The least energy of slower and faster motions.</p>
        <Button
          id="compute-front"
          disabled={!shown.asked || stale.value || Boolean(run.value)}
          onClick={trying(ask)}
        >
          Compute
        </Button>
      </div>
    );
  return (
    <Drawn
      points={known}
      own={{
        duration: shown.solution.duration,
        energy: shown.solution.energy[shown.solution.objective].total,
      }}
    />
  );
}

function Drawn({ points, own }: { points: Point[]; own: { duration: number; energy: number } }) {
  const range = (key: "duration" | "energy"): [number, number] => {
    const values = [...points, own].map((each) => each[key]);
    const [least, most] = [Math.min(...values), Math.max(...values)];
    const room = 0.08 * (most - least || most || 1);
    return [least - room, most + room];
  };
  const [x, y] = [range("duration"), range("energy")];
  const data = useMemo(
    () =>
      [points.map((each) => each.duration), points.map((each) => each.energy)] as [
        number[],
        number[],
      ],
    [points, own.duration],
  );
  const over = (drawn: uPlot) => {
    const place = (
      node: HTMLElement,
      { duration, energy }: { duration: number; energy: number },
    ) => {
      node.style.left = `${(100 * (duration - x[0])) / (x[1] - x[0])}%`;
      node.style.top = `${(100 * (y[1] - energy)) / (y[1] - y[0])}%`;
      drawn.over.append(node);
    };
    for (const point of points) {
      const text = `${figure(point.duration)} s, ${figure(point.energy)} J`;
      const button = Object.assign(document.createElement("button"), {
        type: "button",
        className: "point",
        title: text,
        onclick: trying(() => load(point.answer)),
      });
      button.setAttribute("aria-label", `Load the motion of ${text}`);
      place(button, point);
    }
    place(
      Object.assign(document.createElement("i"), {
        className: "present",
        title: "the motion shown",
      }),
      own,
    );
  };
  return (
    <div id="front">
      <Chart
        id="plot-front"
        label="Least energy over duration"
        series={[{ stroke: style("--good"), width: 2, points: { show: false } }]}
        data={data}
        options={{ x, y, height: 7.6 }}
        over={over}
      />
      <p class="hint">
        Energy in J over duration in s. The large point is the motion shown; click another point to
        load its motion.{" "}
        <Button
          kind="link"
          id="front-csv"
          onClick={() => save("front.csv", csvOf(points), "text/csv")}
        >
          CSV
        </Button>
      </p>
    </div>
  );
}
