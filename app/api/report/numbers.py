"""Numbers of a report in digits: bounds round down, gaps and intervals outwards."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping

from joulepath.optimizer.dynamics.losses import share_of

JOULES_PER_KWH = 3.6e6
SPACE = "\u00a0"
"""A no-break space."""
_PLAIN = (-5, 9)
"""Powers of ten of numbers that are written in full; others would not fit into a column."""
_MARKS = str.maketrans({"*": "∗", "`": "ˋ"})
_UNIT = re.compile(r"(?<=\d) (?=(?:J|s|h|W|mm|kg|kWh|%)(?!\w))")
_ROUNDINGS: dict[str, Callable[[float], int]] = {
    "nearest": round,
    "up": math.ceil,
    "down": math.floor,
}


def digits(value: float, count: int = 3) -> str:
    """A number with this many significant digits, or all digits before the point, and commas
    between thousands.
    """
    return _written(value, count, round)


def down(value: float, count: int = 3) -> str:
    """The number rounded down."""
    return _written(value, count, math.floor)


def up(value: float, count: int = 3) -> str:
    """The number rounded up."""
    return _written(value, count, math.ceil)


def amount(value: float) -> str:
    """An amount of money: with cents below 100, and with a digit more below one cent."""
    if not 0.005 <= abs(value) < 99.995:
        return digits(value, 1 if abs(value) < 1 else 3)
    return f"{value:.2f}".replace("-", "−")


def percent(share: float, rounding: str = "nearest") -> str:
    """A share with one digit after the point."""
    whole = _ROUNDINGS[rounding](1000 * share)
    return f"{whole / 10:.1f}{SPACE}%".replace("-", "−")


def share(value: float, energy: float) -> float:
    """A value over the amount of an energy [J]; 0 where there is none."""
    return share_of(value, energy) or 0.0


def interval_of(known: Mapping[str, float] | None, factor: float = 1.0) -> str:
    """The 90 % interval of an energy, as the end of a phrase; empty if it is unknown."""
    if known is None:
        return ""
    ends = f"{down(known['p5'] * factor)} to {up(known['p95'] * factor)}"
    return f", 90{SPACE}% interval {ends}"


def counted(count: int, thing: str) -> str:
    """A number of things, in words."""
    return f"{count:,} {thing}{'' if count == 1 else 's'}"


def unmarked(name: str) -> str:
    """A name for a sentence in which `*` and accents mark words."""
    return name.translate(_MARKS)


def unbroken(text: str) -> str:
    """The text with no-break spaces between numbers and units."""
    return _UNIT.sub(SPACE, text)


def _written(value: float, count: int, rounding: Callable[[float], int]) -> str:
    if value == 0 or not math.isfinite(value):
        return "0" if value == 0 else "–"
    power = math.floor(math.log10(abs(value)))
    if not _PLAIN[0] <= power < _PLAIN[1]:
        # the digits of a whole number are exact, also where they round up to the next power
        whole = f"{rounding(value / 10.0 ** (power + 1 - count)):.{count - 1}e}"
        mantissa, more = whole.split("e")
        return f"{mantissa}e{power + 1 - count + int(more)}".replace("-", "−")
    places = max(count - 1 - power, 0)
    found = rounding(value * 10**places) / 10**places
    return f"{found:,.{places}f}".replace("-", "−")
