import { at, put } from "../store/pointer";
import { kindOf } from "../store/request";
import { edit, request } from "../store/state";
import { words } from "../store/units";

const BRANCHES = { shoulder: ["left", "right"], elbow: ["up", "down"], wrist: ["no_flip", "flip"] };

/** Postures that are allowed. */
export function BranchField() {
  if (kindOf(request.value) === "path") return null;
  return (
    <div class="field">
      <span>Posture</span>
      {Object.entries(BRANCHES).map(([part, options]) => (
        <select
          key={part}
          aria-label={words(part)}
          value={String(at(request.value, `/branch/${part}`) ?? "")}
          onChange={(event) =>
            edit(put(request.value, `/branch/${part}`, event.currentTarget.value || undefined))
          }
        >
          <option value="">any {part}</option>
          {options.map((each) => (
            <option key={each} value={each}>
              {words(each)}
            </option>
          ))}
        </select>
      ))}
    </div>
  );
}
