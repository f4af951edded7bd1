"""Examples of identified figures."""

from __future__ import annotations

from typing import Any

from joulepath.app.schemas.examples.files import Example

# id of the example, derived from its content
FIGURES_ID = "26d7fc46-dfa6-58dc-957c-af3337058506"
UNKNOWN_ID = "9d1f4f1c-0a43-5f4a-8ad0-d1b75c0a0e0f"


def _identified(value: list[float], unit: str, sd: list[float] | None = None) -> dict[str, Any]:
    figure = {
        "value": value,
        "unit": unit,
        "source": "identified from logs, 2025-03-14",
        "trust": "B",
    }
    return figure if sd is None else figure | {"sd": sd}


FRICTION: dict[str, Any] = {
    "identified": {
        "coulomb": _identified(
            [6.1, 7.2, 5.3, 1.5, 1.3, 1.4], "N·m", [0.2, 0.3, 0.2, 0.1, 0.1, 0.1]
        ),
        "curved": _identified([0.0] * 6, "N·m"),
        "speed": _identified([1.0] * 6, "rad/s"),
        "viscous": _identified([4.1, 5.0, 4.6, 1.0, 0.9, 0.9], "N·m·s/rad"),
        "load": _identified(
            [0.0, 0.067, 0.071, 0.0, 0.0, 0.0], "1", [0.0, 0.008, 0.01, 0.0, 0.0, 0.0]
        ),
    }
}
DRIVES: dict[str, Any] = {"rotor_inertia": _identified([1.9, 1.95, 1.9, 0.21, 0.2, 0.2], "kg·m²")}
MAINS: dict[str, Any] = {
    "factor": {"value": 1.12, "unit": "1", "source": "wattmeter, 2025-03-14", "trust": "B"},
    "constant": {"value": 74.0, "unit": "W", "source": "wattmeter, 2025-03-14", "trust": "B"},
}
COVARIANCE: dict[str, Any] = {
    "names": ["friction_laws.identified.coulomb.1", "friction_laws.identified.load.1"],
    "matrix": [[0.09, -0.001], [-0.001, 0.000064]],
}
FIGURES: dict[str, Any] = {
    "robot": "ur5e",
    "friction_laws": FRICTION,
    "drives": DRIVES,
    "covariance": COVARIANCE,
    "session_sd": 0.03,
    "move_sd": 1.5,
}
FIGURES_EXAMPLES: dict[str, Example] = {
    "identified_friction": {"summary": "Friction and rotor inertia of one UR5e", "value": FIGURES},
}
