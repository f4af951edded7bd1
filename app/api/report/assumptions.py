"""Assumptions behind the figures of a report, with their trust letters."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from joulepath.app.api.report.report import Assumption
from joulepath.app.api.report.rivals import listed
from joulepath.models.robot import Robot
from joulepath.models.tools.registry import tool_figures
from joulepath.models.trust import figures_by_letter, worst_letter

Json = dict[str, Any]
YOURS = "Y"
ASSUMED = "E"
NOT_COUNTED = "–"
_LETTERS = {
    "A": "manufacturer",
    "B": "fitted to measured data",
    "C": "second-hand source",
    "T": "sister robot",
    "E": "engineering default",
}
_SOURCES = {
    "cycles_per_shift": "{} repetitions per shift",
    "shifts_per_year": "{} shifts per year",
    "price": "{} {currency} per kWh",
    "carbon": "{} kg CO2e per kWh",
    "control_box": "Control box, {} W",
}
_WORDS = {
    "idle_power": "idle power",
    "friction": "friction",
    "copper": "copper loss",
    "load": "load-dependent friction",
    "session": "day-to-day changes of friction",
    "move": "effects outside the model",
    "torque_constant": "torque constants",
    "rotor_inertia": "rotor inertias",
}
_LARGE = 0.9
_MOST_MASSES = 5


def assumptions(
    request: Json,
    costs: Json | None,
    robot: Robot,
    masses: Sequence[float],
    payload_from: str = "yours",
    period: float | None = None,
) -> tuple[Assumption, ...]:
    """Figures of the robot by letter, of the tool, given numbers, and missing numbers.

    Args:
        request: a request with figures and tool.
        costs: the numbers for costs; None if nothing is priced.
        robot: the robot.
        masses: masses of the payloads in the motions [kg].
        payload_from: source of the masses.
        period: time from one start to the next [s]; None: one directly after the other.
    """
    priced = () if costs is None else _of_costs(costs, period)
    return (*_of_robot(request, robot), *_of_request(request, masses, payload_from), *priced)


def _of_robot(request: Json, robot: Robot) -> Iterator[Assumption]:
    identified = request.get("figures") is not None
    for letter, names in figures_by_letter(robot.figures).items():
        source = "identified on your arm" if letter == "B" and identified else _LETTERS[letter]
        yield Assumption(letter, _sentence(names), source)


def _of_request(request: Json, masses: Sequence[float], payload_from: str) -> Iterator[Assumption]:
    tool = request.get("tool")
    if isinstance(tool, str):
        figures = tool_figures(tool)
        mass = figures["mass"]
        letter = worst_letter({name: figures[name] for name in ("mass", "center_of_mass")})
        yield Assumption(letter, f"Tool {figures['title']}, {mass['value']:g} kg", _LETTERS[letter])
    different = sorted({round(mass, 3) for mass in masses} - {0.0})
    loads = ", ".join(f"{mass:g}" for mass in different[:_MOST_MASSES])
    if len(different) > _MOST_MASSES:
        loads = f"{different[0]:g} to {different[-1]:g}"
    with_tool = ", tool included" if isinstance(tool, str) else ""
    words = f"Payload {loads} kg{with_tool}" if different else "No payload"
    yield Assumption(YOURS, words, payload_from)


def _of_costs(costs: Json, period: float | None) -> Iterator[Assumption]:
    if costs.get("cycles_per_shift") is None:
        often = "No pause" if period is None else f"One every {period:g} s"
        yield Assumption(ASSUMED, f"{often} in a shift of 8 h", "assumed")
    for name, words in _SOURCES.items():
        given = costs.get(name)
        if given is not None:
            text = words.format(f"{given['value']:g}", currency=costs.get("currency") or "€")
            yield Assumption(given.get("letter") or YOURS, text, given["source"])
    if costs.get("control_box") is None:
        yield Assumption(NOT_COUNTED, "Control box and mains losses", "not included")


def _sentence(names: list[str]) -> str:
    text = ", ".join(names)
    return text[:1].upper() + text[1:]


def interval_note(interval: dict[str, Any] | None) -> str:
    """Main sources of the interval: the fewest sources with nearly all of its width."""
    if interval is None or not interval["shares"]:
        return ""
    made, names = 0.0, list[str]()
    for name, share in sorted(interval["shares"].items(), key=lambda each: -each[1]):
        made += share
        names.append(_WORDS.get(name, name.replace("_", " ")))
        if made >= _LARGE:
            break
    words = listed(names)
    return (
        f"{words[:1].upper()}{words[1:]} cause {100 * made:.0f} % of the width of the 90 % "
        "interval. Figures identified from logs of this arm would replace them."
    )
