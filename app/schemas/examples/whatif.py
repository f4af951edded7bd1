"""Examples of POST /whatif."""

from __future__ import annotations

from joulepath.app.schemas.examples.files import Example
from joulepath.app.schemas.examples.values import HOME

_LOW = [0.5, -2.57, 2.57, -1.07, -1.07, 0.5]

WHATIF_EXAMPLES: dict[str, Example] = {
    "lighter_arm": {
        "summary": "A lift with lighter links, without payload, and with a heavier payload",
        "description": "For each change the answer has two motions: the motion of the base on the changed arm, and the "
        "best motion found for the changed arm.",
        "value": {
            "optimize": {
                "start": {"q": _LOW},
                "goal": {"q": HOME},
                "payload": {"mass": 2.0, "com": [0.0, 0.0, 0.1]},
            },
            "changes": [
                {"name": "links of half the mass", "arm": {"link_mass_scale": 0.5}},
                {"name": "no payload", "arm": {"payload": None}},
                {"name": "payload of 4 kg", "arm": {"payload": {"mass": 4.0, "com": [0.0, 0.0, 0.1]}}},
            ],
        },
    },
    "given_motion": {
        "summary": "A given motion, on the ceiling and with a recuperating bus",
        "description": "The same motion is evaluated on each changed arm. Nothing is optimised.",
        "value": {
            "evaluate": {"configurations": [HOME, _LOW, HOME], "time_per_segment": 0.8},
            "changes": [
                {"name": "ceiling mount", "arm": {"gravity": [0.0, 0.0, 9.81]}},
                {"name": "recuperating bus", "arm": {"bus": {"mode": "recuperating", "efficiency": 0.8}}},
            ],
        },
    },
}
