"""Examples of the routes under /studies."""

from __future__ import annotations

from joulepath.app.schemas.examples.files import Example, body_examples
from joulepath.app.schemas.examples.values import ANSWER_ID, HOME

_OPTIMIZE = body_examples("/optimize")["application/json"]
ITERATION_EXAMPLES: dict[str, Example] = {
    "evaluate": {
        "summary": "The energy of the present motion",
        "value": {
            "evaluate": {
                "configurations": [HOME, [1.2, -1.1, 1.9, -2.2, -1.3, 0.4]],
                "time_per_segment": 3.0,
            }
        },
    }
}
ITERATION_EXAMPLES |= {
    name: {"summary": _OPTIMIZE[name]["summary"], "value": {"optimize": _OPTIMIZE[name]["value"]}}
    for name in ("time_scaling", "joint_to_pose")
}

STUDY_CSV = (
    "iteration,created,kind,energy_J,electrical_J,mechanical_J,duration_s,change_from_last_J,"
    "change_from_best_J,threshold_met,answer\n"
    f"1,2025-03-14T09:26:53.589793+00:00,optimize,96.1,96.1,31.9,1.33,,,false,{ANSWER_ID}\n"
)
"""The history of a study as CSV."""
