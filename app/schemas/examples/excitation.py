"""Examples of POST /excitation."""

from __future__ import annotations

from joulepath.app.schemas.examples.files import Example

EXCITATION_EXAMPLES: dict[str, Example] = {
    "friction_and_rotors": {
        "summary": "A short motion that tells friction and rotor inertias, with a payload",
        "description": "One start, a few seconds of search. With the defaults, three starts share a minute.",
        "value": {
            "parameters": ["rotor", "friction"],
            "period": 6.0,
            "harmonics": 3,
            "payload": {"mass": 2.0, "com": [0.0, 0.0, 0.05]},
            "starts": 1,
            "deadline": 5.0,
        },
    },
}
