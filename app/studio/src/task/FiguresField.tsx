import { useState } from "preact/hooks";
import { get } from "../store/client";
import { put } from "../store/pointer";
import { robotName } from "../store/request";
import { edit, request } from "../store/state";
import { when } from "../store/units";

/** Figures that were identified on an arm of this type. */
export function FiguresField() {
  const [known, setKnown] = useState<{ id: string; created: string }[] | null>(null);
  const own = request.value.figures;
  const load = () => {
    if (known) return;
    get<{ figures: { id: string; robot: string; created: string }[] }>("figures")
      .then(({ figures }) =>
        setKnown(figures.filter(({ robot }) => robot === robotName(request.value))),
      )
      .catch(() => setKnown([]));
  };
  return (
    <label class="field">
      <span>Figures</span>
      <select
        value={own ?? ""}
        onFocus={load}
        onChange={(event) =>
          edit(put(request.value, "/figures", event.currentTarget.value || undefined))
        }
      >
        <option value="">of the robot type</option>
        {known?.map(({ id, created }) => (
          <option key={id} value={id}>
            yours, {when(created)}
          </option>
        ))}
        {own && !known?.some(({ id }) => id === own) && (
          <option value={own}>yours, {own.slice(0, 8)}</option>
        )}
      </select>
    </label>
  );
}
