import { effect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { dark } from "../ui/dark";
import { alone } from "../store/alone";
import { answered, ghosts, looked, playing, run, show, stale, time } from "../store/state";
import { figure } from "../store/units";
import { Drag, dragNote } from "./drag";
import { picture } from "./instance";
import { followMeshes } from "./meshes";
import { PlaceLegend } from "./PlaceLegend";
import { PlaceMap } from "./placeMap";
import { rampStops } from "./path";
import { pictured, standing } from "./pictured";
import { reachedGhost } from "./reachedGhost";
import { Tools } from "./Tools";
import { View } from "./view";

const hasWebGl = Boolean(document.createElement("canvas").getContext("webgl2"));

/** Makes the picture, and draws it again when what it shows changes. */
function start(box: HTMLElement, layer: HTMLElement): () => void {
  const own = new View(box, layer);
  picture.value = own;
  if (!alone) Object.assign(own, { drag: new Drag(own), places: new PlaceMap(own) });
  const stops = [
    effect(() => {
      void pictured.value;
      own.build();
    }),
    effect(() => {
      own.content.stand(standing.value);
      own.draw();
    }),
    effect(() => {
      void dark.value;
      own.content.recolour();
      own.build();
    }),
    effect(() => {
      void [ghosts.value, run.value?.incumbents.length, reachedGhost.value];
      own.content.buildGhosts();
    }),
    effect(() => {
      void [time.value, show.value];
      own.pose();
    }),
    effect(() => {
      void playing.value;
      own.draw(true);
    }),
    followMeshes(own),
  ];
  return () => stops.forEach((stop) => stop());
}

/** The arm in its cell. */
export function Picture() {
  const box = useRef<HTMLDivElement>(null);
  const layer = useRef<HTMLDivElement>(null);
  useEffect(() => (hasWebGl ? start(box.current!, layer.current!) : undefined), []);
  return (
    <div
      id="view"
      ref={box}
      tabIndex={0}
      role="group"
      aria-label={describe()}
      data-without-axes={show.value.axes ? undefined : ""}
    >
      <div id="labels" ref={layer} aria-hidden="true" />
      {!hasWebGl && (
        <p id="no-view">
          This browser offers no WebGL, so the arm cannot be drawn. Charts, tables and downloads
          still work.
        </p>
      )}
      {hasWebGl && (
        <>
          <Tools />
          <div class="legends">
            {!alone && <PlaceLegend />}
            <Legend />
          </div>
          <p class="frame-note">{frameNote()}</p>
          {dragNote.value && (
            <p class="drag-note" id="drag-note" role="status">
              {dragNote.value}
            </p>
          )}
          {placeNote() && (
            <p class="drag-note" id="place-note">
              {placeNote()}
            </p>
          )}
          {stale.value && !looked.value && !dragNote.value && (
            <p class="drag-note">The previous motion is hidden, because the cell has changed.</p>
          )}
        </>
      )}
    </div>
  );
}

/** The energy at the selected place; the panel says more. */
function placeNote(): string {
  const now = looked.value;
  if (!now || now.state === "moving") return "";
  if (now.state === "failed") return now.why;
  const known = now.energy === null ? "" : `${figure(now.energy)} J`;
  return now.state === "computing" ? `${known} Computing …` : `${known} at this place`;
}

function describe(): string {
  const shown = answered.value;
  if (!shown || stale.value) return "The arm in its cell, at rest";
  const { robot, branch, duration, energy } = shown.solution;
  return `The arm ${robot} moves from ${branch.start.label} to ${branch.goal.label} in ${figure(duration)} s and draws ${figure(energy.electrical.total)} J.`;
}

function frameNote(): string {
  const pendant = pictured.value?.robot.title.startsWith("Universal Robots");
  return pendant
    ? "Base frame as on the pendant; ROS base_link is rotated by 180° about z"
    : "Base frame of the robot";
}

function Legend() {
  const power = pictured.value?.motion?.solution.trajectory.power;
  if (!power || !show.value.path) return null;
  return (
    <div class="legend" id="legend" aria-hidden="true">
      Power along the path
      <i style={{ background: `linear-gradient(90deg, ${rampStops.join(", ")})` }} />
      <div>
        <span>{figure(Math.min(...power))} W</span>
        <span>{figure(Math.max(...power))} W</span>
      </div>
    </div>
  );
}
