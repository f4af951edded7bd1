"""Given motions: waypoints with times, or a log of joint positions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem, InvalidTable
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.arrays import frozen

Interpolation = Literal["linear", "trapezoid", "quintic", "spline"]

BLOCK = 2048
"""Rows that are processed at a time."""
MOST_ROWS = 1_000_000
"""Most rows of a motion."""
MOST_SPLINE_POINTS = 10_000
"""Most configurations that one smooth curve passes through: its equations are solved all at
once."""
CLOSEST_TIMES = 1e-6
"""Least time between rows [s]."""
MOST_SPEED, MOST_ACCELERATION = 1e4, 1e7
"""Greatest |v| [rad/s] and |a| [rad/s²] that a log may have: no robot exceeds them."""
# joint positions beyond this multiple of the largest joint position allowed are not in radians
FAR_OUT = 2.0


@dataclass(frozen=True)
class Waypoints:
    """Joint positions q (n, nq) [rad] that a motion passes in this order, with a time for each
    segment between them.

    `times` (n - 1,) [s] may be one number for all segments. `piecewise_motion` describes the
    interpolations. Errors count rows from `first_row`. Raises InvalidProblem.
    """

    q: Array
    times: Array
    interpolation: Interpolation = "quintic"
    first_row: int = 0

    def __post_init__(self) -> None:
        if np.ndim(self.q) != 2 or len(self.q) < 2:
            raise InvalidProblem(
                "configurations", "configurations must be a list of two or more joint positions."
            )
        object.__setattr__(self, "q", frozen(self.q, np.shape(self.q), "configurations"))
        segments = len(self.q) - 1
        times = np.full(segments, self.times) if np.ndim(self.times) == 0 else self.times
        if np.shape(times) != (segments,):
            raise InvalidProblem(
                "time_per_segment",
                f"time_per_segment must be one number or a list of {segments}, one per segment.",
            )
        object.__setattr__(self, "times", frozen(times, (segments,), "time_per_segment"))
        if (self.times <= 0).any():
            raise InvalidProblem("time_per_segment", "time_per_segment must be positive.")
        if self.interpolation == "spline" and len(self.q) > MOST_SPLINE_POINTS:
            raise InvalidProblem(
                "interpolation",
                f"A spline passes at most {MOST_SPLINE_POINTS} configurations: send more as a "
                "trajectory with t.",
            )

    @property
    def segments(self) -> int:
        """Number of segments."""
        return len(self.times)

    def check(self, arm: Arm) -> None:
        """Raise InvalidProblem or InvalidTable if the joint positions cannot be those of the
        arm."""
        check_joints(arm, self.q, self.first_row)


@dataclass(frozen=True)
class RecordedRows:
    """Consecutive rows of a recording: t (n,) [s], q (n, nq) [rad], and v [rad/s], a [rad/s²].

    v and a are None if they were not recorded.
    """

    t: Array
    q: Array
    v: Array | None = None
    a: Array | None = None

    @property
    def groups(self) -> dict[str, Array | None]:
        """The columns by name; None if not logged."""
        return {"q": self.q, "v": self.v, "a": self.a}


@dataclass(frozen=True)
class Recording:
    """A recorded motion as a stream of blocks of rows, which is read once.

    `Recording.of(t, q)` makes one of arrays. All blocks have the same columns. Errors count rows
    from `first_row`. Segments after the first one begin at `edges` [s], which increase, after the
    first row.
    """

    blocks: Iterable[RecordedRows]
    first_row: int = 0
    edges: Sequence[float] = ()

    @classmethod
    def of(
        cls,
        t: Array,
        q: Array,
        v: Array | None = None,
        a: Array | None = None,
        edges: Sequence[float] = (),
    ) -> Recording:
        """A recording that is in memory.

        Args:
            t: times, increasing, shape (n,) [s].
            q: joint positions, shape (n, nq) [rad].
            v: joint velocities if they were recorded, shape (n, nq) [rad/s].
            a: joint accelerations if they were recorded, shape (n, nq) [rad/s²].
            edges: times at which a new segment begins, after the first row [s].

        Returns:
            The recording, in blocks of at most BLOCK rows.

        Raises:
            InvalidProblem: the arrays have different numbers of rows.
        """
        columns = [None if each is None else np.asarray(each, dtype=float) for each in (t, q, v, a)]
        if len({len(each) for each in columns if each is not None}) > 1:
            raise InvalidProblem(
                "trajectory", "t, q, v and a must have as many rows as each other."
            )
        rows = [slice(low, high) for low, high in pairwise([*range(0, len(t), BLOCK), len(t)])]
        blocks = [
            RecordedRows(*(None if each is None else each[part] for each in columns))  # type: ignore[arg-type]
            for part in rows
        ]
        return cls(blocks, edges=edges)

    @property
    def segments(self) -> int:
        """Number of segments."""
        return len(self.edges) + 1

    def checked(self, arm: Arm) -> Iterator[RecordedRows]:
        """The blocks, with times since the first row.

        Raises InvalidTable at the first invalid row, and InvalidProblem.
        """
        row, last, origin = self.first_row, -np.inf, None
        for block in self.blocks:
            if not len(block.t):
                continue
            if row + len(block.t) - self.first_row > MOST_ROWS:
                raise InvalidTable(
                    f"A trajectory has at most {MOST_ROWS} rows: send fewer rows, or send it in "
                    "parts."
                )
            origin = float(block.t[0]) if origin is None else origin
            _check_finite(block, row)
            t = block.t - origin
            steps = np.diff(t, prepend=last)
            if (steps < CLOSEST_TIMES).any():
                at = int(np.argmax(steps < CLOSEST_TIMES))
                raise InvalidTable(
                    f"t must increase from row to row by {CLOSEST_TIMES:g} s or more, and does not "
                    f"at row {row + at}: "
                    "sort the rows and drop repeated ones.",
                    row + at,
                    "t",
                )
            check_joints(arm, block.q, row)
            yield RecordedRows(t, block.q, block.v, block.a)
            row, last = row + len(t), float(t[-1])
        if row - self.first_row < 2:
            raise InvalidTable(
                "A trajectory needs two or more rows: there is no motion in fewer.", None, None
            )


def _check_finite(block: RecordedRows, first_row: int) -> None:
    most = {"t": 1e12, "q": np.inf, "v": MOST_SPEED, "a": MOST_ACCELERATION}
    for name, values in {"t": block.t[:, None], **block.groups}.items():
        if values is None:
            continue
        with np.errstate(invalid="ignore"):
            wrong = np.argwhere(~(np.isfinite(values) & (np.abs(values) <= most[name])))
        if len(wrong):
            row, joint = wrong[0].tolist()
            column = name if name == "t" else f"{name}{joint + 1}"
            raise InvalidTable(
                f"{column} at row {first_row + row} is not finite, or too large to be a robot's: "
                "correct it or drop "
                "the row.",
                first_row + row,
                column,
            )


def check_joints(arm: Arm, q: Array, first_row: int = 0) -> None:
    """Raises InvalidProblem or InvalidTable for joint positions q (k, n) [rad] of another arm."""
    if q.shape[1] != arm.robot.nq:
        raise InvalidProblem(
            "q", f"Every row must have {arm.robot.nq} joint positions, one per joint."
        )
    limits = arm.robot.limits
    wrong = np.argwhere(
        np.abs(q) > FAR_OUT * np.maximum(np.abs(limits.q_min), np.abs(limits.q_max))
    )
    if len(wrong):
        row, joint = wrong[0].tolist()
        raise InvalidTable(
            f"q{joint + 1} at row {first_row + row} is far beyond the joint's range and looks like "
            "degrees: give "
            "radians, or a CSV with units=deg.",
            first_row + row,
            f"q{joint + 1}",
        )
