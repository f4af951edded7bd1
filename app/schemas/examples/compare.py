"""Examples of POST /compare."""

from __future__ import annotations

from joulepath.app.schemas.examples.files import Example
from joulepath.app.schemas.examples.values import HOME, OPTIMIZE

COMPARE_EXAMPLES: dict[str, Example] = {
    "all_methods": {
        "summary": "One motion by every method",
        "description": "The answer is a table of energies, durations and computing times.",
        "value": {"start": {"q": HOME}, "goal": {"q": [1.2, -1.1, 1.9, -2.2, -1.3, 0.4]}},
    },
    "two_methods_to_a_pose": {
        "summary": "Two methods to a pose, with complete answers",
        "description": "Each row also contains the answer of `POST /optimize` by this method.",
        "value": {**OPTIMIZE, "methods": ["bspline", "lagrange"], "answers": True, "windings": False},
    },
}
