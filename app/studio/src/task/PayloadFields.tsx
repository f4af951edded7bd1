import { NumberCell } from "../ui/NumberCell";
import { Segment } from "../ui/Segment";
import { centreOf, gripped } from "../store/load";
import { at, put, type Pointer } from "../store/pointer";
import { isObject, listOf } from "../store/request";
import { edit, request } from "../store/state";
import type { Payload, Shape } from "../store/types";
import { untyped } from "../picture/drag";

const SHAPES: Record<string, Shape> = {
  box: { shape: "box", size: [0.06, 0.06, 0.1] },
  cylinder: { shape: "cylinder", radius: 0.03, length: 0.1 },
  sphere: { shape: "sphere", radius: 0.04 },
};
const CENTRES = [
  { value: "even", text: "evenly filled" },
  { value: "own", text: "own centre" },
] as const;

const sizesOf = ({ size, radius, length }: Shape): number[] =>
  Array.isArray(size) ? size : [radius, length].filter((each) => each !== undefined);

/** Shape and mass distribution of a part, in a few words. */
function wordsOf({ com, inertia, shape }: Payload): string {
  if (!shape) return inertia ? "own inertia" : "point mass";
  const sizes = sizesOf(shape).map((each) => Number((each * 1000).toFixed(1)));
  const filled = com || inertia ? "" : ", evenly filled";
  return `${shape.shape} ${sizes.length ? `${sizes.join(" × ")} mm` : ""}${filled}`;
}

/** Shape and centre of mass of the payload, at its place in the request. */
export function PayloadFields({ pointer }: { pointer: Pointer }) {
  const payload = at(request.value, pointer) as Payload;
  const shape = isObject(payload.shape) ? (payload.shape as Shape) : null;
  const even = shape !== null && !payload.com;
  const set = (next: Payload) => edit(put(request.value, pointer, next), untyped(pointer));
  const { com, inertia, ...rest } = payload;
  const centre = () => centreOf(payload) ?? gripped(request.value);
  const choose = (name: string) => {
    const next = SHAPES[name];
    const pose = { position: centre(), rotvec: [0, 0, 0] };
    // a part of which the size is known is evenly filled until it is said otherwise
    set(next ? { ...rest, shape: { ...next, pose } } : { ...rest, com: centre(), shape: null });
  };
  const cell = (name: string, field: string) => (
    <NumberCell
      label={name}
      pointer={`${pointer}/${field}`}
      value={at(request.value, `${pointer}/${field}`) ?? 0}
      unit="mm"
    />
  );
  const three = (name: string, field: string) =>
    ["X", "Y", "Z"].map((axis, k) => cell(`${name} ${axis}`, `${field}/${k}`));
  return (
    <details class="fold payload-form">
      <summary>
        <span class="fold-name">Shape</span> <b>{wordsOf(payload)}</b>
      </summary>
      <div class="field">
        <span>Shape</span>
        <select
          aria-label="Shape of the payload"
          value={shape ? (shape.shape in SHAPES ? shape.shape : "other") : "none"}
          onChange={(event) => choose(event.currentTarget.value)}
        >
          <option>none</option>
          {Object.keys(SHAPES).map((name) => (
            <option key={name}>{name}</option>
          ))}
          {shape && !(shape.shape in SHAPES) && (
            <option value="other">{shape.shape}, see JSON</option>
          )}
        </select>
      </div>
      {shape && (
        <>
          <div class="field">
            <span>Size, mm</span>
            {shape.shape === "box" && three("Payload size", "shape/size")}
            {"radius" in shape && <>radius {cell("Payload radius", "shape/radius")}</>}
            {"length" in shape && <>length {cell("Payload length", "shape/length")}</>}
          </div>
          <div class="field">
            <span>Centre of shape, mm</span>
            {three("Payload centre", "shape/pose/position")}
          </div>
          <div class="field">
            <span>Mass</span>
            <Segment
              label="Distribution of the mass"
              options={CENTRES}
              value={even ? "even" : "own"}
              onChange={(next) => set(next === "even" ? rest : { ...payload, com: centre() })}
            />
          </div>
        </>
      )}
      {!even && (
        <div class="field">
          <span>Centre of mass, mm</span>
          {three("Centre of mass", "com")}
        </div>
      )}
      <p class="hint">
        Positions are in the flange frame.{" "}
        {even
          ? "Centre and inertia are computed from mass and size."
          : listOf(inertia).length
            ? "The inertia is set in the JSON."
            : "The mass is a point mass; an evenly filled shape adds its inertia."}
      </p>
    </details>
  );
}
