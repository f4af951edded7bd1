"""Examples of POST /logs."""

from __future__ import annotations

from math import cos, pi

from joulepath.app.schemas.examples.files import Example

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
