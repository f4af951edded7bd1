"""Columns of logs by joint names: ROS drivers publish the joints in any order."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from joulepath.optimizer.exceptions import InvalidTable
from joulepath.optimizer.identify.logs.columns import EFFORTS, NOT_LOGGED, Columns, time_of
from joulepath.optimizer.identify.logs.log_formats import JOINT_NUMBER, ChannelName

_WORDS: Mapping[ChannelName, str] = {
    "q": "position|pos|q",
    "v": "velocity|vel|speed|v|qd",
    "effort": "effort",
    "torque": "torque|tau",
    "current": "current|cur",
}
NAMED = "named"
"""Format of headers with names of joints."""
_DELIMITER = "[^a-z0-9]+"


def by_joint_name(names: Sequence[str], joints: Sequence[str]) -> Columns | None:
    """Columns of a header with the robot's joint names, or with numbers from base to flange.

    Examples are `/joint_states/elbow_joint/position` and `elbow_joint_velocity`; `lbr_A1/position`.

    Args:
        names: names of the columns.
        joints: names of the joints.

    Returns:
        The columns; None if the header has neither.

    Raises:
        InvalidTable: a joint is missing or occurs twice.
    """
    found = {
        group: columns
        for group, word in _WORDS.items()
        if (
            columns := _of_word(names, word, joints, group in EFFORTS)
            or _numbered(names, word, len(joints))
        )
    }
    time = time_of(names)
    if not found and len(names) == len(joints) + len(time):
        # a table of positions only, with the joint names as column names
        found = {"q": _of_word(names, "", joints, False)}
    if not found.get("q") or not time:
        return None
    return Columns(NAMED, names, time, found)


def _of_word(
    names: Sequence[str], word: str, joints: Sequence[str], partial: bool
) -> tuple[int, ...]:
    """Columns of the joints for a word; if it may be `partial`, `NOT_LOGGED` for joints without.

    Raises:
        InvalidTable: a joint is missing or occurs twice.
    """
    every = [[*_matching(names, word, joint.lower())] for joint in joints]
    if not any(every):
        return ()
    for joint, columns in zip(joints, every, strict=True):
        if len(columns) != 1 and not (partial and not columns):
            has = "no column" if not columns else "more than one column"
            raise InvalidTable(
                f"The header has {has} `{word.partition('|')[0]}` of {joint}: a log has every "
                "joint once. Correct the header, or name the columns in `columns`.",
                1,
                None if not columns else names[columns[1]],
            )
    return tuple(columns[0] if columns else NOT_LOGGED for columns in every)


def _numbered(names: Sequence[str], word: str, count: int) -> tuple[int, ...]:
    """Columns with names that count from 0 or 1, if the header has exactly one such list."""
    lists: dict[tuple[str, str], dict[int, int]] = {}
    for k, name in enumerate(names):
        match = re.fullmatch(rf"(.*?[a-z_])([0-9]{{1,2}})(_joint|){_DELIMITER}(?:{word})", name)
        if match is not None:
            lists.setdefault((match[1], match[3]), {})[int(match[2])] = k
    whole = [
        each for each in lists.values() if sorted(each) in ([*range(count)], [*range(1, count + 1)])
    ]
    return tuple(whole[0][number] for number in sorted(whole[0])) if len(whole) == 1 else ()


def _matching(names: Sequence[str], word: str, joint: str) -> Iterator[int]:
    named = re.escape(joint)
    either = f"{named}{_DELIMITER}(?:{word})|(?:{word}){_DELIMITER}{named}" if word else named
    pattern = f"(?:.*[^a-z0-9])?(?:{either})"
    return (k for k, name in enumerate(names) if re.fullmatch(pattern, name))


def in_order_of_joints(columns: Columns, first: Sequence[str], joints: Sequence[str]) -> Columns:
    """Columns in the order of the robot's joints, if the first row has joint names as in a
    JointState, and the header has none."""
    if columns.format == NAMED:
        return columns
    named: dict[int, str] = {}
    for k, name in enumerate(columns.names):
        match = re.fullmatch(rf"(?:.*[./])?name{JOINT_NUMBER}", name)
        if match is not None and k < len(first):
            named[int(match[1])] = first[k].strip().strip('"').lower()
    logged = [named[number] for number in sorted(named)]
    wanted = _with_prefix(logged, [joint.lower() for joint in joints])
    if wanted is None:
        return columns
    order = [logged.index(joint) for joint in wanted]
    groups = {
        group: tuple(indices[k] for k in order)
        for group, indices in columns.groups.items()
        if len(indices) > 1
    }
    return replace(columns, format=NAMED, groups={**columns.groups, **groups})


def _with_prefix(logged: Sequence[str], joints: Sequence[str]) -> list[str] | None:
    """The joint names in a log, with the prefix of the driver for all joints; None for other
    names.
    """
    ends = [joint for joint in joints if logged and logged[0].endswith(joint)]
    for prefix in ["", *(logged[0].removesuffix(joint) for joint in ends)]:
        names = [prefix + joint for joint in joints]
        if sorted(logged) == sorted(names):
            return names
    return None
