"""Columns of a log and their channels, by the names in the header."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from joulepath.optimizer.exceptions import InvalidProblem, InvalidTable
from joulepath.optimizer.identify.logs.head import NUMBERED
from joulepath.optimizer.identify.logs.log_formats import FORMATS, ChannelName, LogFormat

ColumnMap = Mapping[str, str | int | Sequence[str | int | None]]
"""Names of columns, or their numbers from 1, by the name of the channel; None for a joint whose
effort was not logged."""
NOT_LOGGED = -1
"""In place of the column of a joint whose effort was not logged."""
EFFORTS: tuple[ChannelName, ...] = ("current", "torque", "effort")
"""Channels that may lack joints."""
WRENCH_COLUMNS = 6
"""Columns of a wrench: three of the force, then three of the torque."""


_TIME = (
    r"(?:.*[./])?(?:__|%)?(?:time|timestamp|t|stamp|rosbagtimestamp|duration)(?:[_ "
    r"]?(?:n|u|µ|m)?s(?:ec)?)?"
)
_STAMPS = (("sec", "nanosec"), ("sec", "nsec"), ("secs", "nsecs"), ("secs", "nanosecs"))
"""Ends of the names of the two columns of a stamp of time."""
_KNOWN_HEADERS = (
    "timestamp, actual_q_0, … (RTDE), t, q1, … (this service's own) or time, position1, … (ROS "
    "JointState as CSV). Otherwise name the columns in `columns`"
)


@dataclass(frozen=True)
class Columns:
    """Indices of the columns of a log."""

    format: str
    """Name of the format."""
    names: Sequence[str]
    """Names of all columns."""
    time: tuple[int, ...]
    """Column of the time, or columns of its seconds and nanoseconds."""
    groups: Mapping[ChannelName, tuple[int, ...]]
    """Columns of each channel; one per joint for channels of joints, or `NOT_LOGGED`."""

    MAPPED: ClassVar[tuple[str, ...]] = (
        "time",
        "q",
        "nanoseconds",
        "v",
        "a",
        "current",
        "torque",
        "effort",
        "temperature",
        "power",
        "wrench",
    )
    """Keys of a map of columns."""

    def without_empty(self, first: Sequence[str]) -> tuple[Columns, list[ChannelName]]:
        """Remove channels without a number in the first row, except positions.

        Args:
            first: cells of the first row.

        Returns:
            The remaining columns, and the removed channels.
        """
        removed: list[ChannelName] = [
            group
            for group, indices in self.groups.items()
            if group != "q" and all(_is_empty(first[k]) for k in _logged(indices))
        ]
        groups = {
            group: tuple(NOT_LOGGED if _is_empty(first[k]) else k for k in indices)
            if group in EFFORTS
            else indices
            for group, indices in self.groups.items()
            if group not in removed
        }
        return replace(self, groups=groups), removed

    @property
    def used(self) -> list[int]:
        """Sorted indices of all columns."""
        return sorted({*self.time, *(k for group in self.groups.values() for k in _logged(group))})


def _logged(indices: Sequence[int]) -> list[int]:
    """The columns of the logged joints."""
    return [k for k in indices if k != NOT_LOGGED]


def _is_empty(cell: str) -> bool:
    return cell.strip().strip('"').lower() in ("", "nan", "none", "null")


def recognised(names: Sequence[str], nq: int) -> Columns:
    """Columns of a header in one of the known formats.

    Args:
        names: names of the columns.
        nq: number of joints.

    Raises:
        InvalidTable: the header is in none of the formats, or lacks columns.
    """
    for log_format in FORMATS:
        positions = _numbered(names, log_format.joints["q"])
        if not positions:
            continue
        numbers = _by_number(names, log_format.joints["q"])
        found = {
            group: indices
            for group, pattern in log_format.joints.items()
            if (
                indices := _of_joints(names, pattern, numbers)
                if group in EFFORTS
                else _numbered(names, pattern)
            )
        }
        time = time_of(names, log_format.time)
        if not time:
            raise InvalidTable(
                f"The header has joint positions such as {names[found['q'][0]]}, but no column "
                f"`{log_format.time.strip('%?')}`: a log needs the time [s] of every row.",
                1,
                log_format.time.strip("%?"),
            )
        _check_counts(found, names, nq)
        return Columns(
            log_format.name, names, time, found | dict(_columns_without_joint(log_format, names))
        )
    if NUMBERED.format(1) in names:
        raise InvalidTable(
            "The file has no header: give one, or the numbers of the columns in `columns`, as in "
            '{"time": 1, "q": [2, 3, 4, 5, 6, 7]}.',
            1,
        )
    raise InvalidTable(
        f"The header has no known names of joint positions: begin it with {_KNOWN_HEADERS}.", 1
    )


def other_positions(names: Sequence[str], columns: Columns) -> str | None:
    """Name of an unread column with positions in another format; None without such a column."""
    for log_format in FORMATS:
        for name in names:
            if (
                re.fullmatch(log_format.joints["q"], name)
                and names.index(name) not in columns.groups["q"]
            ):
                return name
    return None


def time_of(names: Sequence[str], first: str = "time") -> tuple[int, ...]:
    """Column of the time, or columns of its seconds and nanoseconds, which are more exact.

    Args:
        names: names of the columns.
        first: preferred name of the column.

    Returns:
        Indices of the columns; empty if there is none.
    """
    return _first(names, first) or _stamp(names) or _first(names, _TIME)


def _first(names: Sequence[str], pattern: str) -> tuple[int, ...]:
    return next(((k,) for k, name in enumerate(names) if re.fullmatch(pattern, name)), ())


def _stamp(names: Sequence[str]) -> tuple[int, ...]:
    for seconds, nano in _STAMPS:
        for k, name in enumerate(names):
            other = name.removesuffix(seconds) + nano
            if name.endswith(seconds) and not name.endswith(nano) and other in names:
                return (k, names.index(other))
    return ()


def _of_joints(names: Sequence[str], pattern: str, numbers: Mapping[int, int]) -> tuple[int, ...]:
    """Columns with names that match a pattern, of the joints with these numbers; `NOT_LOGGED` for
    joints without one, and empty if no joint has one.

    Raises:
        InvalidTable: the numbers are others, and not consecutive from 0 or 1.
    """
    found = _by_number(names, pattern)
    if not found.keys() < numbers.keys():
        return _numbered(names, pattern)
    return tuple(found.get(number, NOT_LOGGED) for number in sorted(numbers)) if found else ()


def _by_number(names: Sequence[str], pattern: str) -> dict[int, int]:
    """Columns with names that match a pattern, by their numbers.

    Raises:
        InvalidTable: a number occurs twice.
    """
    found: dict[int, int] = {}
    for k, name in enumerate(names):
        match = re.fullmatch(pattern, name)
        if match is None:
            continue
        number = int(match[1])
        if number in found:
            raise InvalidTable(
                f"The header has the column {name} twice: delete one of them.", 1, name
            )
        found[number] = k
    return found


def _numbered(names: Sequence[str], pattern: str) -> tuple[int, ...]:
    """Columns with names that match a pattern, in the order of their numbers.

    Raises:
        InvalidTable: the numbers are not consecutive from 0 or 1.
    """
    found = _by_number(names, pattern)
    if found and sorted(found) not in ([*range(len(found))], [*range(1, len(found) + 1)]):
        name = names[found[min(found)]]
        raise InvalidTable(
            f"The columns like {name} are not numbered without gaps from 0 or 1: a log needs "
            "every joint.",
            1,
            name,
        )
    return tuple(found[number] for number in sorted(found))


def _columns_without_joint(
    log_format: LogFormat, names: Sequence[str]
) -> Iterator[tuple[ChannelName, tuple[int, ...]]]:
    """Columns of channels without a joint: power, wrench and payload."""
    if log_format.power and all(name in names for name in log_format.power):
        yield "power", tuple(names.index(name) for name in log_format.power)
    if log_format.wrench and all(name in names for name in log_format.wrench):
        yield "wrench", tuple(names.index(name) for name in log_format.wrench)
    present = tuple(names.index(name) for name in log_format.payload if name in names)
    if log_format.payload and log_format.payload[0] in names:
        # the centre only if all of it is there
        yield "payload", present if len(present) == len(log_format.payload) else present[:1]


def mapped(names: Sequence[str], columns: ColumnMap, nq: int) -> Columns:
    """Columns by a map of names, or of numbers from 1.

    Args:
        names: names of the columns.
        columns: names or numbers of the columns by channel: one column for `time`, `nanoseconds`
            and `power`, six columns for `wrench`, and one column per joint for all other channels;
            None for an effort that was not logged.
        nq: number of joints.

    Raises:
        InvalidProblem: the map is wrong.
        InvalidTable: the header lacks a column.
    """
    unknown = sorted(set(columns) - set(Columns.MAPPED))
    if unknown or not {"time", "q"} <= set(columns):
        raise InvalidProblem(
            "columns",
            f"columns must name `time` and `q`, and may also name {', '.join(Columns.MAPPED[2:])}.",
        )
    found: dict[str, tuple[int, ...]] = {}
    for group, given in columns.items():
        wanted = [given] if isinstance(given, str | int) else [*given]
        if group in ("time", "nanoseconds", "power") and len(wanted) != 1:
            raise InvalidProblem(
                f"columns.{group}", f"columns.{group} must be the name of one column."
            )
        if group == "wrench" and len(wanted) != WRENCH_COLUMNS:
            raise InvalidProblem(
                "columns.wrench",
                "columns.wrench must name six columns: three of the force, then three of the "
                "torque.",
            )
        if None in wanted and (group not in EFFORTS or not any(wanted)):
            raise InvalidProblem(
                f"columns.{group}",
                f"columns.{group} must name a column for each joint; only efforts may be null, and "
                "not those of all joints.",
            )
        found[group] = tuple(NOT_LOGGED if each is None else _index(names, each) for each in wanted)
    used = [k for indices in found.values() for k in _logged(indices)]
    twice = next((k for k in used if used.count(k) > 1), None)
    if twice is not None:
        raise InvalidProblem(
            "columns",
            f"columns must name every column once, but names {names[twice]}, number {twice + 1}, "
            "more often.",
        )
    time = (*found.pop("time"), *found.pop("nanoseconds", ()))
    groups: dict[ChannelName, tuple[int, ...]] = found  # type: ignore[assignment]
    _check_counts(
        {group: indices for group, indices in groups.items() if group not in ("power", "wrench")},
        names,
        nq,
    )
    return Columns("mapped", names, time, groups)


def _index(names: Sequence[str], name: str | int) -> int:
    if isinstance(name, int):
        if not 1 <= name <= len(names):
            raise InvalidTable(
                f"The file has {len(names)} columns, and `columns` names number {name}: columns "
                "are numbered from 1.",
                1,
            )
        return name - 1
    if names.count(name.lower()) != 1:
        has = "does not have" if name.lower() not in names else "has more than once"
        raise InvalidTable(
            f"The header {has} the column {name}: correct `columns` or the header.", 1, name
        )
    return names.index(name.lower())


def _check_counts(
    groups: Mapping[ChannelName, tuple[int, ...]], names: Sequence[str], nq: int
) -> None:
    for indices in groups.values():
        if len(indices) != nq:
            name = names[indices[0]] if indices else None
            raise InvalidTable(
                f"The header has {len(indices)} columns like {name}, but the robot has {nq} "
                "joints: a log belongs to one robot, with one column for each of its joints.",
                1,
                name,
            )
