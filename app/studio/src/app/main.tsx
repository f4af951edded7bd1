import "../styles/font.css";
import "uplot/dist/uPlot.min.css";
import "../styles/tokens.css";
import "../styles/base.css";
import "../styles/controls.css";
import "../styles/surfaces.css";
import "../styles/reports.css";
import "../styles/task.css";
import "../styles/forms.css";
import "../styles/targets.css";
import "../styles/picture.css";
import "../styles/charts.css";
import "../styles/answer.css";
import "../styles/figures.css";
import "../styles/placement.css";
import "../styles/pages.css";
import "../styles/narrow.css";
import { render } from "preact";
import { multiply, ofPose } from "../store/chain";
import {
  answered,
  changes,
  economics,
  looked,
  page,
  placing,
  playing,
  project,
  racers,
  request,
  run,
  saved,
  selected,
  show,
  stale,
  tab,
  time,
  typed,
  duration,
  trouble,
} from "../store/state";
import { mapShown } from "../store/placement";
import { postures } from "../answer/postures";
import { picture } from "../picture/instance";
import { reachedGhost } from "../picture/reachedGhost";
import { tell } from "../store/trouble";
import { App } from "./App";
import { start } from "./start";

declare global {
  interface Window {
    studio: unknown;
  }
}

const signals = {
  answered,
  changes,
  duration,
  economics,
  looked,
  mapShown,
  page,
  placing,
  playing,
  postures,
  project,
  racers,
  request,
  run,
  saved,
  selected,
  show,
  stale,
  tab,
  time,
  trouble,
  typed,
};

/** For tests, and for those who look in the console. */
window.studio = {
  state: Object.defineProperties(
    {},
    Object.fromEntries(
      Object.entries(signals).map(([name, each]) => [
        name,
        { get: () => each.value, enumerable: true },
      ]),
    ),
  ),
  get view() {
    return picture.value;
  },
  /** Pose of the TCP as it is drawn now: a matrix, row by row. */
  tcp: () => {
    const arm = picture.value!.content.arms[0]!;
    const flange = arm.links.at(-1)!.matrix.clone().transpose().toArray();
    return multiply(flange, ofPose((answered.value?.cell ?? request.value).tcp));
  },
  /** The configuration that reaches what is dragged. */
  reached: () => reachedGhost.value,
};

render(<App />, document.getElementById("app")!);
start().catch((error) => tell(error));
