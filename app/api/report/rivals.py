"""Rivals of an answer, the parts of its energy and its limits, in the words of a report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from joulepath.app.api.report.numbers import digits, down, percent, share
from joulepath.app.api.report.report import Part

_PARTS = {
    "friction": ("Friction in the joints", "#e08e2b"),
    "idle": ("Electronics (idle power)", "#66778a"),
    "dwell": ("Waiting at standstill", "#c3cbd3"),
    "copper": ("Copper loss in the motors", "#8c3b2a"),
    "potential": ("Lifting", "#3b8fc2"),
    "inverter": ("Loss in the inverters", "#b9a24a"),
    "braking": ("Brake resistor", "#b3261e"),
    "kinetic": ("Kinetic energy at the end", "#5b7fa6"),
    "storage_loss": ("Loss in the energy storage", "#6c5b7b"),
    "recovered": ("Fed back to the supply", "#14805f"),
}
_RIVALS = {
    "trapezoid": "Trapezoidal speed",
    "quintic": "Quintic polynomial",
    "ruckig": "Time-optimal motion",
    "ruckig_slowed": "Time-optimal, slowed",
    "straight": "Straight in joint space",
    "controller_default": "Controller default",
    "waypoints": "Via points with stops",
    "blended": "Rounded via points",
    "even_speed": "Constant speed on path",
    "stopping": "Rest at every stop",
    "move_by_move": "Each move chosen alone",
    "same_factor": "All moves scaled equally",
    "fastest_then_wait": "Fastest cycle, then a wait",
    "given_order": "Stops in the given order",
    "without_storage": "Without energy storage",
}
LIMITS = {
    "velocity": "joint speed",
    "acceleration": "acceleration",
    "jerk": "jerk",
    "torque": "torque",
    "tcp_speed": "TCP speed",
    "elbow_speed": "elbow speed",
}


@dataclass(frozen=True)
class ReportSettings:
    """Settings of what a report says of figures."""

    equal: float = 0.0005
    """Largest saving that is none, to the digit after the point that is written."""
    as_fast: float = 1.05
    """Ratio of a rival's duration to the answer's up to which it is about as fast."""
    least_part: float = 0.003
    """Least share of the energy of a part with a line of its own."""
    fully: float = 0.99
    """Least ratio of a quantity to its limit at which the limit is fully used."""


REPORT = ReportSettings()


def rival_name(rival: Mapping[str, Any]) -> str:
    """The name of a baseline in words."""
    name: str = rival["name"]
    return _RIVALS.get(name, name)


def nearest_rival(answer: Mapping[str, Any], period: float | None = None) -> dict[str, Any] | None:
    """The rival within the limits with the least saving.

    Args:
        answer: the answer with its baselines.
        period: longest duration of the rival [s]. None: about the duration of the answer, or any
            duration if no rival is as fast.

    Returns:
        The rival, or None if no rival is within the limits and the period.
    """
    claimed = [each for each in answer["baselines"] if each["saving"] is not None]
    time = REPORT.as_fast * answer["duration"] if period is None else period
    fast = [each for each in claimed if each["duration"] <= time]
    found = fast if fast or period is not None else claimed
    return min(found, key=lambda each: float(each["saving"]), default=None)


def their_energy(ours: float, saving: float) -> float:
    """The energy of a rival [J], of which an answer saves this share of its amount."""
    left = 1 + saving if ours < 0 and saving <= 1 else 1 - saving
    return ours / left if left else 0.0


def saved(saving: float) -> str:
    """A saving in words."""
    if abs(saving) < REPORT.equal:
        return "no saving"
    return f"saving {percent(saving)}" if saving > 0 else f"needs {percent(-saving)} less"


def above_least(subject: str, total: float, bound: float) -> str:
    """A sentence about the gap between an energy and its proven lower bound [J]."""
    if bound <= 0:
        return "No positive lower bound is known for this task."
    return (
        f"{subject} needs less than {down(bound)} J, so this is at most "
        f"{percent(max(total / bound - 1, 0.0), 'up')} above the least possible."
    )


def parts_of(electrical: Mapping[str, Any]) -> tuple[Part, ...]:
    """The parts of an electrical energy, largest first."""
    total = electrical["total"]
    known = {name: float(electrical.get(name) or 0.0) for name in _PARTS}
    shown = {
        name: value for name, value in known.items() if abs(value) > REPORT.least_part * abs(total)
    }
    rest = total - sum(shown.values())
    rows = sorted(shown.items(), key=lambda each: -each[1])
    parts = [Part(*_PARTS[name], *_in_joules(value, total)) for name, value in rows]
    if abs(rest) > REPORT.least_part * abs(total):
        parts.append(Part("Other", "#e2e7ec", *_in_joules(rest, total)))
    return tuple(parts)


def _in_joules(value: float, total: float) -> tuple[str, str]:
    written = digits(value, 2 if abs(value) < 10 else 3)
    return f"{written} J", f"{share(value, total):.0%}".replace("%", " %").replace("-", "−")


def limits_used(worst_ratio: Mapping[str, float | None]) -> str:
    """The largest use of every limit, as a sentence."""
    ratios = {
        name: value for name, value in worst_ratio.items() if name in LIMITS and value is not None
    }
    full = [LIMITS[name] for name, value in ratios.items() if value >= REPORT.fully]
    others = [
        f"{LIMITS[name]} {100 * value:.0f} %"
        for name, value in ratios.items()
        if value < REPORT.fully
    ]
    used = ", ".join(([f"{listed(full)} fully"] if full else []) + others)
    return f"Largest use of each limit: {used}."


def listed(words: list[str]) -> str:
    """Words with commas, and `and` before the last."""
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last
