import { Button } from "../ui/Button";
import { useDraft } from "../ui/draft";
import { NumberCell } from "../ui/NumberCell";
import { tool, untyped } from "../picture/drag";
import { withObstacle } from "../store/edits";
import { at, put, type Pointer } from "../store/pointer";
import { DEFAULT_MARGIN, isObject, listOf, sixOf, withNumber } from "../store/request";
import { edit, request, typed } from "../store/state";
import type { Obstacle, Pose } from "../store/types";
import { PoseCells } from "./PoseCells";

const AXES = ["X", "Y", "Z"];
const UNITS: [number, string][] = [
  [0.001, "mm"],
  [0.01, "cm"],
  [0.0254, "inch"],
  [1, "m"],
];
/** The units to choose from, with that of the request. */
const unitsWith = (scale: number): [number, string][] =>
  UNITS.some(([known]) => known === scale) ? UNITS : [...UNITS, [scale, `${scale} m`]];

/** The fields of one obstacle. */
export function ObstacleEditor({ pointer }: { pointer: Pointer }) {
  const obstacle = at(request.value, pointer);
  const name = useDraft(isObject(obstacle) ? String(obstacle.name) : "");
  if (!isObject(obstacle)) return null;
  const given = obstacle as unknown as Obstacle;
  const pose: Pose = isObject(given.pose)
    ? { ...given.pose, position: listOf<number>(given.pose.position) }
    : { position: [0, 0, 0], rotvec: [0, 0, 0] };
  const scale = typeof given.scale === "number" ? given.scale : 1;
  const cell = (
    label: string,
    field: string,
    value: unknown = at(request.value, `${pointer}/${field}`),
  ) => (
    <NumberCell label={label} pointer={`${pointer}/${field}`} value={value} unit="mm" withUnit />
  );
  return (
    <div class="obstacle-editor">
      <label class="field">
        <span>Name</span>
        <input
          type="text"
          {...name.field}
          onChange={(event) =>
            edit(put(request.value, `${pointer}/name`, event.currentTarget.value))
          }
        />
      </label>
      {Array.isArray(given.size) && (
        <div class="field">
          <span>Size</span>
          {AXES.map((axis, k) => cell(`Size ${axis}`, `size/${k}`))}
        </div>
      )}
      {"radius" in given && given.radius !== undefined && (
        <div class="field">
          <span>Radius</span>
          {cell("Radius", "radius")}
        </div>
      )}
      {"length" in given && given.length !== undefined && (
        <div class="field">
          <span>Length along z</span>
          {cell("Length", "length")}
        </div>
      )}
      {given.shape === "mesh_file" && (
        <label class="field">
          <span>Unit of the file</span>
          <select
            value={scale}
            onChange={(event) =>
              edit(put(request.value, `${pointer}/scale`, Number(event.currentTarget.value)))
            }
          >
            {unitsWith(scale).map(([scale, text]) => (
              <option key={scale} value={scale}>
                {text}
              </option>
            ))}
          </select>
        </label>
      )}
      <p class="hint">
        {given.shape === "half_space"
          ? "A point of the surface, with z pointing outwards"
          : given.shape === "mesh_file"
            ? "The origin of the file, in the base frame"
            : "The centre, in the base frame"}
      </p>
      <PoseCells
        name={String(given.name)}
        pointer={`${pointer}/pose`}
        six={sixOf(pose)}
        onNumber={(index, value, text, where) =>
          edit(put(request.value, `${pointer}/pose`, withNumber(pose, index, value)), {
            ...typed.value,
            [where]: text,
          })
        }
      />
      <div class="field">
        <span>Margin</span>
        {cell("Margin", "margin", given.margin ?? DEFAULT_MARGIN)}
      </div>
      <div class="row">
        <Button small icon="move" onClick={() => (tool.value = "move")}>
          Drag
        </Button>
        <Button small icon="turn" onClick={() => (tool.value = "turn")}>
          Turn
        </Button>
        <Button
          small
          icon="copy"
          onClick={() => edit(withObstacle(request.value, given, given.name), untyped(pointer))}
        >
          Duplicate
        </Button>
      </div>
    </div>
  );
}
