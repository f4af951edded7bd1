"""Examples of the routes under `/studies`; each runs as it is."""

from __future__ import annotations

from fastapi.openapi.models import Example

from app.schemas.examples import OPTIMIZE_EXAMPLES

STUDY_EXAMPLES: dict[str, Example] = {
    "electrical": {
        "summary": "Below 60 J from the bus",
        "value": {"name": "Pick and place, cell 4", "robot": "ur5e", "threshold": 60.0},
    },
    "mechanical": {
        "summary": "Below 35 J of mechanical work",
        "value": {"name": "Paper, pose 1", "threshold": 35.0, "objective": "mechanical"},
    },
}

ITERATION_EXAMPLES: dict[str, Example] = {
    "evaluate": {
        "summary": "What the motion costs as it is now",
        "value": {
            "evaluate": {
                "configurations": [[0.0, -1.57, 1.57, -1.57, -1.57, 0.0], [1.2, -1.1, 1.9, -2.2, -1.3, 0.4]],
                "time_per_segment": 3.0,
            }
        },
    }
}
ITERATION_EXAMPLES |= {
    name: {"summary": OPTIMIZE_EXAMPLES[name]["summary"], "value": {"optimize": OPTIMIZE_EXAMPLES[name]["value"]}}
    for name in ("time_scaling", "joint_to_pose")
}

STUDY_CSV = (
    "iteration,created,kind,energy_J,electrical_J,mechanical_J,duration_s,change_from_last_J,change_from_best_J,"
    "threshold_met,answer\n"
    "1,2025-03-14T09:26:53.589793+00:00,optimize,96.1,96.1,31.9,1.33,,,false,7b5f3a52-3a26-4a3e-8f0e-3c1d0e6f5a11\n"
)
