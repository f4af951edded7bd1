"""Examples of request bodies; a file `examples/<endpoint>/<name>.json` holds the same request as
its namesake here.
"""

from __future__ import annotations

from math import cos, pi

from joulepath.app.schemas.examples.figures import FIGURES_EXAMPLES
from joulepath.app.schemas.examples.files import Example, body_examples, shown
from joulepath.app.schemas.examples.own_arm import NEW_ROBOT_EXAMPLES, PUT_EXAMPLES
from joulepath.app.schemas.examples.values import ITERATION_EXAMPLES, LOG_ID, OTHER_LOG_ID

_PERIOD = 0.05
_ROWS = 61
_REACH = [0.4, 0.5, -0.6, 0.3, 0.2, 0.5]
_HOME = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]


def _there_and_back() -> str:
    """A log of positions: half a second of rest, two seconds of motion, half a second of rest."""
    lines = ["t,q1,q2,q3,q4,q5,q6"]
    for k in range(_ROWS):
        share = min(max((k * _PERIOD - 0.5) / 2.0, 0.0), 1.0)
        q = [
            home + reach * (1 - cos(2 * pi * share)) / 2
            for home, reach in zip(_HOME, _REACH, strict=True)
        ]
        lines.append(",".join(f"{value:.5g}" for value in (k * _PERIOD, *q)))
    return "\n".join(lines) + "\n"


LOG_EXAMPLES: dict[str, Example] = {
    "positions": {
        "summary": "A short log of positions, with ?robot=ur5e&name=short",
        "description": "Velocities and accelerations are made from the positions. To identify "
        "friction, log currents, "
        "too, and at 100 Hz or more.",
        "value": _there_and_back(),
    },
}


IDENTIFY_EXAMPLES: dict[str, Example] = {
    "friction_and_power": {
        "summary": "Friction, rotors and power from one log",
        "description": "A third of the motions is held out, and says how well the figures predict.",
        "value": {"logs": [LOG_ID]},
    },
    "payload": {
        "summary": "A payload, from a log without it and one with it",
        "description": "The last of the logs carries it. What that log says of its payload does "
        "not count.",
        "value": {"logs": [LOG_ID, OTHER_LOG_ID], "fit": ["payload"]},
    },
    "base_parameters": {
        "summary": "Base parameters and friction, without any knowledge of the links",
        "description": "A method of the literature by its name; `automatic` suits nearly every "
        "log.",
        "value": {"logs": [LOG_ID], "method": "base_parameters"},
    },
    "robust_refit": {
        "summary": "With the links' inertials, and outliers that count less",
        "value": {"logs": [LOG_ID], "inertials": "refit", "estimator": "irls", "validate": "moves"},
    },
}


JSON = "application/json"
CSV = "text/csv"
BODY_EXAMPLES: dict[str, dict[str, dict[str, Example]]] = {
    **{path: body_examples(path) for path in shown()},
    "/identifications": {JSON: IDENTIFY_EXAMPLES},
    "/logs": {CSV: LOG_EXAMPLES},
    "/robots": {JSON: NEW_ROBOT_EXAMPLES},
    "/robots/{name}": {JSON: PUT_EXAMPLES},
    "/figures": {JSON: FIGURES_EXAMPLES},
    **{
        f"/{kept}/{{id}}": {
            JSON: {"name": {"summary": "Give it a name", "value": {"name": "Night cell"}}},
        }
        for kept in ("answers", "jobs", "studies", "logs", "identifications")
    },
    "/studies/{id}/iterations": {JSON: ITERATION_EXAMPLES},
}
