"""Examples of POST /pareto."""

from __future__ import annotations

from joulepath.app.schemas.examples.files import Example
from joulepath.app.schemas.examples.values import HOME, OPTIMIZE

PARETO_EXAMPLES: dict[str, Example] = {
    "lift": {
        "summary": "A lift with a payload",
        "description": "The front goes from the fastest motion to the motion of least energy.",
        "value": {
            "start": {"q": [0.5, -2.57, 2.57, -1.07, -1.07, 0.5]},
            "goal": {"q": HOME},
            "payload": {"mass": 2.0, "com": [0.0, 0.0, 0.1]},
            "points": 8,
        },
    },
    "branch_switch": {
        "summary": "Mechanical work, with a change of the arm configuration",
        "description": "From a certain duration on, another arm configuration can reach the goal and needs much less "
        "work. The mechanical objective needs a largest duration.",
        "value": {**OPTIMIZE, "objective": "mechanical", "duration": {"max": 2.0}, "windings": False, "points": 10},
    },
}
