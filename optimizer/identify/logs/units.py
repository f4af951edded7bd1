"""Units that a log names, in its header as `q1 [deg]` or in a line below it: they must be those
that it is read in.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from joulepath.optimizer.exceptions import InvalidTable
from joulepath.optimizer.identify.logs.columns import Columns, Group
from joulepath.optimizer.identify.logs.head import number

_DIGITS = frozenset("0123456789")
_BEGINS = re.compile(r"[-+]?[.,]?[0-9]")  # of what is rather a number, or several
_ANGLES: tuple[Group, ...] = ("q", "v", "a", "commanded")


def _unit(pattern: str) -> re.Pattern[str]:
    return re.compile(rf"\W*(?:{pattern})\W*", re.IGNORECASE)


_DEGREES, _RADIANS = (
    _unit(r"(?:deg|degrees?|°|º)(?:\W.*|s|s\^?2)?"),
    _unit(r"(?:rad|radians?)(?:\W.*|s|s\^?2)?"),
)
_OTHER_UNITS: tuple[tuple[tuple[Group, ...], re.Pattern[str], re.Pattern[str], str, str], ...] = (
    (_ANGLES, _DEGREES, _RADIANS, "units=deg", "units=rad"),
    (
        ("current",),
        _unit(r"ma|milliamp\w*"),
        _unit(r"a|amps?|amperes?"),
        "current_units=mA",
        "current_units=A",
    ),
    (("power",), _unit("[km]w"), _unit("w"), "W", "W"),
    (("torque", "effort"), _unit(r"[km]n\W?m|n\W?mm"), _unit(r"n\W?m"), "N·m", "N·m"),
)
"""Of groups: units that are not SI, the SI unit, and what to give where the one or the other is not
read as it is.
"""


def parted(names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Names of columns without the units behind them, in brackets, and these units; empty where
    there are none.
    """
    found = [_parted(name) for name in names]
    return [bare for bare, _ in found], [unit for _, unit in found]


def _parted(name: str) -> tuple[str, str]:
    """A name without the unit in brackets behind it, and the unit; a number there is that of a
    joint.
    """
    begin = max(name.rfind("["), name.rfind("("))
    bare, unit = name[: max(begin, 0)].rstrip(), name[begin + 1 : -1]
    is_unit = bare and name.endswith((")", "]")) and not {*unit} & {*")]"}
    if is_unit and any(each not in _DIGITS and not each.isspace() for each in unit):
        return bare, unit
    return name, ""


def is_line_of_units(cells: Sequence[str]) -> bool:
    """Whether a line below the header has words alone, which are units then."""
    said = [cell.strip().strip("\"'").lower() for cell in cells]
    words = any(cell not in ("", "nan", "none", "null") for cell in said)
    return words and not any(_BEGINS.match(cell) or number(cell) for cell in said)


def check_units(
    columns: Columns, said: Sequence[str], row: int, scales: Mapping[Group, float]
) -> None:
    """Raises InvalidTable where units (one per column of the file, of line `row`) are not those
    that the columns are read in: SI units, apart from the groups that `scales` turns into them."""
    for groups, other, si, of_other, of_si in _OTHER_UNITS:
        for group in groups:
            alien, remedy = (other, of_other) if scales.get(group, 1.0) == 1.0 else (si, of_si)
            for k in columns.groups.get(group, ()):
                if k < len(said) and alien.fullmatch(said[k].strip()):
                    name = columns.names[k]
                    raise InvalidTable(
                        f"{name} is in another unit by line {row} than it is read in: give "
                        f"{remedy}.",
                        row,
                        name,
                    )
