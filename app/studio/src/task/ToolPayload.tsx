import { Button } from "../ui/Button";
import { Errors } from "../ui/Errors";
import { NumberCell } from "../ui/NumberCell";
import { untyped } from "../picture/drag";
import { gripped } from "../store/load";
import { at, join, put } from "../store/pointer";
import { isObject, listOf, sixOf, withNumber } from "../store/request";
import { edit, request, typed } from "../store/state";
import type { Pose, Tool } from "../store/types";
import { figure } from "../store/units";
import { dressed, toolNow } from "../store/tools";
import { OverRating } from "./OverRating";
import { PayloadFields } from "./PayloadFields";
import { PoseCells } from "./PoseCells";
import { ToolPicker } from "./ToolPicker";

const NO_TURN: Pose = { position: [0, 0, 0], rotvec: [0, 0, 0] };

/** What is on the flange: the tool with its TCP, and what the arm carries. */
export function ToolPayload() {
  const asked = request.value;
  const named = typeof asked.tool === "string";
  const own = dressed(asked, toolNow.value).tcp;
  const tcp = isObject(own) ? (own as Pose) : NO_TURN;
  const isKnown = !named || toolNow.value?.name === asked.tool;
  const [x = 0, y = 0, z = 0] = listOf<number>(tcp.position);
  const mass = at(asked, "/payload/mass");
  const count = listOf(at(asked, "/tool/capsules")).length;
  return (
    <section class="section" aria-label="Tool and payload">
      <details class="fold" id="tool-fold">
        <summary>
          <span class="fold-name">Tool</span>{" "}
          <b>
            {named
              ? (toolNow.value?.title ?? (asked.tool as string))
              : `TCP ${figure(Math.hypot(x, y, z) * 1000)} mm`}
          </b>
          <small>
            {named
              ? isKnown && `TCP ${figure(Math.hypot(x, y, z) * 1000)} mm`
              : count
                ? `${count} capsules`
                : "no shape"}
          </small>
        </summary>
        <ToolPicker />
        {isKnown && <TcpCells tcp={tcp} />}
        {!named && <Capsules />}
      </details>
      <div class="field payload">
        <span class="fold-name">Payload</span>
        <NumberCell
          label="Payload mass"
          pointer="/payload/mass"
          value={mass ?? 0}
          unit="kg"
          withUnit
          onValue={(value, text) => setMass(value, text)}
        />
        <small>
          {isObject(at(asked, "/payload/shape"))
            ? String(at(asked, "/payload/shape/shape"))
            : mass
              ? "no shape"
              : "no payload"}
        </small>
      </div>
      <OverRating mass={mass} />
      {isObject(asked.payload) && <PayloadFields pointer="/payload" />}
      <Errors under="/tool" />
      <Errors under="/tcp" />
      <Errors under="/payload" />
    </section>
  );
}

/** A payload without mass is none. */
function setMass(value: number, text: string): void {
  const { payload } = request.value;
  const next =
    value === 0
      ? undefined
      : { ...(isObject(payload) ? payload : { com: gripped(request.value) }), mass: value };
  edit(put(request.value, "/payload", next), { ...untyped("/payload"), "/payload/mass": text });
}

function TcpCells({ tcp }: { tcp: Pose }) {
  const six = sixOf({ ...tcp, position: listOf<number>(tcp.position) });
  return (
    <>
      <p class="hint">TCP at the flange</p>
      <PoseCells
        name="TCP"
        pointer="/tcp"
        six={six}
        onNumber={(index, value, text, pointer) =>
          edit(put(request.value, "/tcp", withNumber(tcp, index, value)), {
            ...typed.value,
            [pointer]: text,
          })
        }
      />
    </>
  );
}

function Capsules() {
  const capsules = listOf<NonNullable<Tool["capsules"]>[number]>(
    at(request.value, "/tool/capsules"),
  );
  const set = (next: unknown[]) =>
    edit(
      put(request.value, "/tool", {
        ...(isObject(request.value.tool) ? request.value.tool : {}),
        capsules: next,
      }),
      untyped("/tool"),
    );
  const add = () => set([...capsules, { start: [0, 0, 0.02], end: [0, 0, 0.12], radius: 0.03 }]);
  return (
    <>
      {capsules.map((_, k) => (
        <div class="field" key={k}>
          <span>Capsule {k + 1}, z from</span>
          <NumberCell
            label={`Capsule ${k + 1} start`}
            pointer={join("tool", "capsules", k, "start", 2)}
            value={at(request.value, join("tool", "capsules", k, "start", 2))}
            unit="mm"
          />
          <span>to</span>
          <NumberCell
            label={`Capsule ${k + 1} end`}
            pointer={join("tool", "capsules", k, "end", 2)}
            value={at(request.value, join("tool", "capsules", k, "end", 2))}
            unit="mm"
          />
          <span>radius</span>
          <NumberCell
            label={`Capsule ${k + 1} radius`}
            pointer={join("tool", "capsules", k, "radius")}
            value={at(request.value, join("tool", "capsules", k, "radius"))}
            unit="mm"
            withUnit
          />
          <Button
            kind="quiet"
            small
            icon="trash"
            label={`Remove capsule ${k + 1}`}
            onClick={() => set(capsules.filter((__, other) => other !== k))}
          />
        </div>
      ))}
      <Button kind="link" icon="plus" onClick={add}>
        Add a capsule around the tool
      </Button>
    </>
  );
}
