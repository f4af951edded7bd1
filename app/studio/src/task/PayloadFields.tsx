import { NumberCell } from "../ui/NumberCell";
import { at, put, type Pointer } from "../store/pointer";
import { isObject } from "../store/request";
import { edit, request } from "../store/state";
import type { Payload, Shape } from "../store/types";
import { untyped } from "../picture/drag";

const SHAPES: Record<string, Shape | null> = {
  none: null,
  box: { shape: "box", size: [0.06, 0.06, 0.1] },
  cylinder: { shape: "cylinder", radius: 0.03, length: 0.1 },
  sphere: { shape: "sphere", radius: 0.04 },
};

/** Centre of mass and shape of what is carried, at its place in the request. */
export function PayloadFields({ pointer }: { pointer: Pointer }) {
  const payload = at(request.value, pointer) as Payload;
  const shape = isObject(payload.shape) ? payload.shape : null;
  const choose = (name: string) => {
    const next = SHAPES[name];
    // about the centre of mass
    const placed = next
      ? { ...next, pose: { position: payload.com ?? [0, 0, 0], rotvec: [0, 0, 0] } }
      : null;
    edit(put(request.value, pointer, { ...payload, shape: placed }), untyped(`${pointer}/shape`));
  };
  const cell = (name: string, field: string) => (
    <NumberCell
      label={name}
      pointer={`${pointer}/${field}`}
      value={at(request.value, `${pointer}/${field}`) ?? 0}
      unit="mm"
    />
  );
  return (
    <details class="fold">
      <summary>
        <span class="fold-name">Centre and shape</span>
      </summary>
      <div class="field">
        <span>Centre of mass, mm</span>
        {["X", "Y", "Z"].map((axis, k) => cell(`Centre of mass ${axis}`, `com/${k}`))}
      </div>
      <div class="field">
        <span>Shape</span>
        <select
          aria-label="Shape of the payload"
          value={shape ? (String(shape.shape) in SHAPES ? String(shape.shape) : "other") : "none"}
          onChange={(event) => choose(event.currentTarget.value)}
        >
          {Object.keys(SHAPES).map((name) => (
            <option key={name}>{name}</option>
          ))}
          {shape && !(String(shape.shape) in SHAPES) && (
            <option value="other">{String(shape.shape)}, see JSON</option>
          )}
        </select>
        {shape?.shape === "box" &&
          ["X", "Y", "Z"].map((axis, k) => cell(`Payload size ${axis}`, `shape/size/${k}`))}
        {shape && "radius" in shape && cell("Payload radius", "shape/radius")}
        {shape && "length" in shape && cell("Payload length", "shape/length")}
      </div>
      {shape && (
        <div class="field">
          <span>Its middle at, mm</span>
          {["X", "Y", "Z"].map((axis, k) =>
            cell(`Payload middle ${axis}`, `shape/pose/position/${k}`),
          )}
        </div>
      )}
    </details>
  );
}
