import { Section } from "../ui/Section";
import { goTo } from "../picture/clock";
import { answered } from "../store/state";
import { figure } from "../store/units";

/** How the motion was checked, apart from the solver. */
export function Certificate() {
  const shown = answered.value;
  if (!shown) return null;
  const { clearance, goal_error: error } = shown.solution.certificate;
  return (
    <Section title="Certificate" id="certificate">
      {clearance && (
        <p>
          <button type="button" class="plain" onClick={() => goTo(clearance.time)}>
            Clearance beyond the margins: proven {figure(clearance.min_clearance * 1000)} mm,
            sampled {figure(clearance.sampled * 1000)} mm ({clearance.pair.join(" – ")}).
          </button>
        </p>
      )}
      <p class="hint">
        The goal is reached within {figure(error.position * 1000, 2)} mm and{" "}
        {figure(error.rotation, 2)} rad. Pinocchio replayed the motion, independently of the solver.{" "}
        {shown.solution.id && (
          <>
            Stored as <code>{shown.solution.id.slice(0, 8)}</code>.
          </>
        )}
      </p>
    </Section>
  );
}
