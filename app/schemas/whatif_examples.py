"""What `POST /whatif` takes, by example; each runs as it is."""

from __future__ import annotations

from fastapi.openapi.models import Example

_HIGH = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
_LOW = [0.5, -2.57, 2.57, -1.07, -1.07, 0.5]

WHATIF_EXAMPLES: dict[str, Example] = {
    "lighter_arm": {
        "summary": "A lift with lighter links, a lighter and a heavier payload",
        "description": "Every change is optimised anew, and the base's own motion is held against it, too.",
        "value": {
            "optimize": {
                "start": {"q": _LOW},
                "goal": {"q": _HIGH},
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
        "summary": "A given motion, on the ceiling and with a bus that feeds back",
        "description": "Nothing is optimised: the same motion is evaluated on each arm.",
        "value": {
            "evaluate": {"configurations": [_HIGH, _LOW, _HIGH], "time_per_segment": 0.8},
            "changes": [
                {"name": "ceiling mount", "arm": {"gravity": [0.0, 0.0, 9.81]}},
                {"name": "recuperating bus", "arm": {"bus": {"mode": "recuperating", "efficiency": 0.8}}},
            ],
        },
    },
}
