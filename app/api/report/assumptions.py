"""Assumptions behind the figures of a report, with their trust letters."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from joulepath.app.api.report.bundle import Bundle
from joulepath.app.api.report.report import Assumption
from joulepath.models.tools.registry import tool_figures
from joulepath.models.trust import figures_by_letter, worst_letter
from joulepath.optimizer.export.program import Program

YOURS = "Y"
NOT_COUNTED = "–"
_LETTERS = {
    "A": "the maker's files",
    "B": "fitted to measured data",
    "C": "second-hand",
    "T": "from a sister robot",
    "E": "default, no source",
}
_SOURCES = {
    "cycles_per_shift": "{} a shift",
    "shifts_per_year": "{} shifts a year",
    "price": "{} {currency} a kWh",
    "carbon": "{} kg CO2e a kWh",
    "control_box": "Control box, {} W",
}
_WORDS = {
    "idle_power": "the electronics",
    "friction": "the friction",
    "copper": "the copper loss",
    "load": "the friction under load",
    "session": "the friction from day to day",
    "move": "what the model cannot express",
    "torque_constant": "the torque constants",
    "rotor_inertia": "the rotors",
}
_LARGE = 0.9


def assumptions(bundle: Bundle, program: Program) -> tuple[Assumption, ...]:
    """Figures of the robot by letter, of the tool, given numbers, and missing numbers."""
    return (*_of_robot(bundle, program), *_of_request(bundle, program), *_of_costs(bundle))


def _of_robot(bundle: Bundle, program: Program) -> Iterator[Assumption]:
    identified = bundle.request.get("figures") is not None
    for letter, names in figures_by_letter(program.robot.figures).items():
        source = "your own arm" if letter == "B" and identified else _LETTERS[letter]
        yield Assumption(letter, _sentence(names), source)


def _of_request(bundle: Bundle, program: Program) -> Iterator[Assumption]:
    tool = bundle.request.get("tool")
    if isinstance(tool, str):
        figures = tool_figures(tool)
        mass = figures["mass"]
        letter = worst_letter({name: figures[name] for name in ("mass", "center_of_mass")})
        yield Assumption(letter, f"Tool {figures['title']}, {mass['value']:g} kg", _LETTERS[letter])
    masses = sorted({round(move.arm.payload.mass, 3) for move in program.moves} - {0.0})
    loads = ", ".join(f"{mass:g}" for mass in masses)
    with_tool = ", tool included" if isinstance(tool, str) else ""
    yield Assumption(YOURS, f"Payload {loads} kg{with_tool}" if masses else "No payload", "yours")


def _of_costs(bundle: Bundle) -> Iterator[Assumption]:
    costs = bundle.costs
    if costs.get("cycles_per_shift") is None:
        yield Assumption(YOURS, "One directly after the other, for 8 h a shift", "assumed")
    for name, words in _SOURCES.items():
        given = costs.get(name)
        if given is not None:
            text = words.format(f"{given['value']:g}", currency=costs.get("currency") or "€")
            yield Assumption(YOURS, text, given["source"])
    if costs.get("control_box") is None:
        yield Assumption(NOT_COUNTED, "Control box, mains loss", "not counted: no reading")


def _sentence(names: list[str]) -> str:
    text = ", ".join(names)
    return text[:1].upper() + text[1:]


def interval_note(interval: dict[str, Any] | None) -> str:
    """Main sources of the interval: the fewest sources with nearly all of its width."""
    if interval is None:
        return ""
    made, names = 0.0, list[str]()
    for name, share in sorted(interval["shares"].items(), key=lambda each: -each[1]):
        made += share
        names.append(_WORDS.get(name, name.replace("_", " ")))
        if made >= _LARGE:
            break
    *first, last = names
    words = f"{', '.join(first)} and {last}" if first else last
    return (
        f"{words[:1].upper()}{words[1:]} make {made:.0%} of the interval. ".replace("%", " %")
        + "A log of this arm replaces them."
    )
