"""Examples of POST /identifications."""

from __future__ import annotations

from joulepath.app.schemas.examples.files import Example
from joulepath.app.schemas.examples.values import LOG_ID, OTHER_LOG_ID

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
