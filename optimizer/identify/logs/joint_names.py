"""Columns of a log by the names of the joints, which drivers of ROS publish in an order of their
own.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from joulepath.optimizer.exceptions import InvalidTable
from joulepath.optimizer.identify.logs.columns import AT, Columns, Group, time_of

_WORDS: Mapping[Group, str] = {
    "q": "position|pos|q",
    "v": "velocity|vel|speed|v|qd",
    "effort": "effort",
    "torque": "torque|tau",
    "current": "current|cur",
}
_BETWEEN = "[^a-z0-9]+"


def by_joint_name(names: Sequence[str], joints: Sequence[str]) -> Columns | None:
    """The columns of a header whose names hold those of the robot's `joints`, as
    `/joint_states/elbow_joint/position` or `elbow_joint_velocity`; None if they do not. Raises
    InvalidTable for a joint that is missing, or there twice."""
    found = {
        group: columns
        for group, word in _WORDS.items()
        if (columns := _of_word(names, word, joints))
    }
    time = time_of(names)
    if "q" not in found or not time:
        return None
    return Columns("named", names, time, found)


def _of_word(names: Sequence[str], word: str, joints: Sequence[str]) -> tuple[int, ...]:
    every = [[*_matching(names, word, joint.lower())] for joint in joints]
    if not any(every):
        return ()
    for joint, columns in zip(joints, every, strict=True):
        if len(columns) != 1:
            has = "no column" if not columns else "more than one column"
            raise InvalidTable(
                f"The header has {has} `{word.partition('|')[0]}` of {joint}: a log has every "
                "joint once. Correct the "
                "header, or name the columns in `columns`.",
                1,
                None if not columns else names[columns[1]],
            )
    return tuple(columns[0] for columns in every)


def _matching(names: Sequence[str], word: str, joint: str) -> Iterator[int]:
    named = re.escape(joint)
    pattern = f"(?:.*[^a-z0-9])?(?:{named}{_BETWEEN}(?:{word})|(?:{word}){_BETWEEN}{named})"
    return (k for k, name in enumerate(names) if re.fullmatch(pattern, name))


def in_order_of_joints(columns: Columns, first: Sequence[str], joints: Sequence[str]) -> Columns:
    """The columns in the order of the robot's `joints`, where the `first` row has their names, as a
    JointState does.
    """
    named: dict[int, str] = {}
    for k, name in enumerate(columns.names):
        match = re.fullmatch(rf"(?:.*[./])?name{AT}", name)
        if match is not None and k < len(first):
            named[int(match[1])] = first[k].strip().strip('"').lower()
    logged = [named[number] for number in sorted(named)]
    wanted = [joint.lower() for joint in joints]
    if sorted(logged) != sorted(wanted):
        return columns
    order = [logged.index(joint) for joint in wanted]
    groups = {
        group: tuple(indices[k] for k in order)
        for group, indices in columns.groups.items()
        if len(indices) > 1
    }
    return replace(columns, form="named", groups={**columns.groups, **groups})
