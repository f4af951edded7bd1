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
from joulepath.optimizer.problem.declared_types import check_fields

Interpolation = Literal["linear", "trapezoid", "quintic", "spline"]


@dataclass(frozen=True)
class GivenMotionLimits:
    """Limits of given motions and of their evaluation."""

    block_rows: int = 2048
    """Rows that are processed at a time."""
    max_rows: int = 1_000_000
    """Largest number of rows of a motion."""
    max_spline_points: int = 10_000
    """Largest number of configurations on one smooth curve, whose equations are solved at once."""
    min_time_step: float = 1e-6
    """Smallest time between two rows [s]."""
    max_time: float = 1e12
    """Largest absolute time [s]."""
    max_speed: float = 1e4
    """Largest speed of a joint in a log; no robot exceeds it [rad/s]."""
    max_acceleration: float = 1e7
    """Largest acceleration of a joint in a log; no robot exceeds it [rad/s²]."""
    max_position_ratio: float = 2.0
    """Position over the largest position of the joint, above which positions are not in radians
    [1]."""
    max_segments: int = 10_000
    """Largest number of segments that are listed one by one."""
    max_intervals: int = 200
    """Largest number of segments with intervals of their energies, a millisecond each."""
    max_samples: int = 20_000
    """Largest number of samples in an answer: some 13 MB of JSON for six joints."""
    period_tolerance: float = 1e-6
    """Remainder over a sample period, up to which it is a rounding error [1]."""


MOTION_LIMITS = GivenMotionLimits()


@dataclass(frozen=True)
class Waypoints:
    """Joint positions q (n, nq) [rad] on a motion, in order, with the times of its segments.

    `first_row` is the number of the first row in error messages.

    Raises:
        InvalidProblem: positions or times have a wrong shape or value.
    """

    q: Array
    times: Array
    """Durations of the segments (n - 1,), or one number for all segments [s]."""
    interpolation: Interpolation = "quintic"
    """Interpolation within segments, see `piecewise_motion`."""
    first_row: int = 0

    def __post_init__(self) -> None:
        check_fields(self)
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
        if self.interpolation == "spline" and len(self.q) > MOTION_LIMITS.max_spline_points:
            raise InvalidProblem(
                "interpolation",
                f"A spline passes at most {MOTION_LIMITS.max_spline_points} configurations: send "
                "more as a trajectory with t.",
            )

    @property
    def segments(self) -> int:
        """Number of segments."""
        return len(self.times)

    def check(self, arm: Arm) -> None:
        """Check that the joint positions can be those of the arm.

        Raises:
            InvalidProblem: the number of joints is wrong.
            InvalidTable: a position is far beyond its range.
        """
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
        """Channels by name; None if not recorded."""
        return {"q": self.q, "v": self.v, "a": self.a}


@dataclass(frozen=True)
class Recording:
    """A recorded motion as a stream of blocks of rows, which is read once.

    `Recording.of(t, q)` creates a recording from arrays. All blocks have the same channels.
    `first_row` is the number of the first row in error messages. `edges` are the increasing start
    times [s] of all segments but the first, after the first row. `cycles` are the numbers of the
    first segments of the cycles of a repeated motion, and the number behind the last segment of the
    last cycle.
    """

    blocks: Iterable[RecordedRows]
    first_row: int = 0
    edges: Sequence[float] = ()
    cycles: Sequence[int] = ()

    def __post_init__(self) -> None:
        if isinstance(self.blocks, np.ndarray):
            raise InvalidProblem(
                "trajectory", "A Recording takes blocks of rows: use Recording.of(t, q) for arrays."
            )

    @classmethod
    def of(
        cls,
        t: Array,
        q: Array,
        v: Array | None = None,
        a: Array | None = None,
        edges: Sequence[float] = (),
        cycles: Sequence[int] = (),
    ) -> Recording:
        """A recording in memory.

        Args:
            t: times, increasing, shape (n,) [s].
            q: joint positions, shape (n, nq) [rad].
            v: joint velocities if they were recorded, shape (n, nq) [rad/s].
            a: joint accelerations if they were recorded, shape (n, nq) [rad/s²].
            edges: start times of all segments but the first, after the first row [s].
            cycles: numbers of the first segments of the cycles, and the number behind the last
                segment of the last cycle.

        Raises:
            InvalidProblem: the arrays have different numbers of rows.
        """
        columns = [None if each is None else np.asarray(each, dtype=float) for each in (t, q, v, a)]
        if len({len(each) for each in columns if each is not None}) > 1:
            raise InvalidProblem("trajectory", "t, q, v and a must have the same number of rows.")
        rows = [
            slice(low, high)
            for low, high in pairwise([*range(0, len(t), MOTION_LIMITS.block_rows), len(t)])
        ]
        blocks = [
            RecordedRows(
                *(None if c is None else c[part] for c in columns)  # type: ignore[arg-type]
            )
            for part in rows
        ]
        return cls(blocks, edges=edges, cycles=cycles)

    @property
    def segments(self) -> int:
        """Number of segments."""
        return len(self.edges) + 1

    @property
    def duration(self) -> float | None:
        """Time from the first row to the last [s]; None if the rows are read from a stream."""
        if not isinstance(self.blocks, list) or not self.blocks:
            return None
        return float(self.blocks[-1].t[-1] - self.blocks[0].t[0])

    def checked(self, arm: Arm) -> Iterator[RecordedRows]:
        """Checked blocks, with times since the first row.

        Raises:
            InvalidTable: a row is invalid, or the number of rows is.
            InvalidProblem: the number of joints is wrong.
        """
        row, last, origin = self.first_row, -np.inf, None
        for block in self.blocks:
            if not len(block.t):
                continue
            if row + len(block.t) - self.first_row > MOTION_LIMITS.max_rows:
                raise InvalidTable(
                    f"A trajectory has at most {MOTION_LIMITS.max_rows} rows: send fewer rows, or "
                    "send it in parts."
                )
            origin = float(block.t[0]) if origin is None else origin
            _check_finite(block, row)
            t = block.t - origin
            least = MOTION_LIMITS.min_time_step
            too_short = np.diff(t, prepend=last) < least
            if too_short.any():
                at = int(np.argmax(too_short))
                raise InvalidTable(
                    f"t must increase from row to row by {least:g} s or more, and does not "
                    f"at row {row + at}: sort the rows and drop repeated ones.",
                    row + at,
                    "t",
                )
            check_joints(arm, block.q, row)
            yield RecordedRows(t, block.q, block.v, block.a)
            row, last = row + len(t), float(t[-1])
        if row - self.first_row < 2:
            raise InvalidTable("A trajectory needs two or more rows.", None, None)


def _check_finite(block: RecordedRows, first_row: int) -> None:
    largest = {
        "t": MOTION_LIMITS.max_time,
        "q": np.inf,
        "v": MOTION_LIMITS.max_speed,
        "a": MOTION_LIMITS.max_acceleration,
    }
    for name, values in {"t": block.t[:, None], **block.groups}.items():
        if values is None:
            continue
        with np.errstate(invalid="ignore"):
            wrong = np.argwhere(~(np.isfinite(values) & (np.abs(values) <= largest[name])))
        if len(wrong):
            row, joint = wrong[0].tolist()
            column = name if name == "t" else f"{name}{joint + 1}"
            raise InvalidTable(
                f"{column} at row {first_row + row} is not finite, or too large for a robot: "
                "correct it or drop the row.",
                first_row + row,
                column,
            )


def check_joints(arm: Arm, q: Array, first_row: int = 0) -> None:
    """Check that joint positions can be those of an arm.

    Args:
        arm: the arm.
        q: joint positions (k, n) [rad].
        first_row: number of the first row in error messages.

    Raises:
        InvalidProblem: the number of joints is wrong.
        InvalidTable: a position is far beyond its range.
    """
    if q.shape[1] != arm.robot.nq:
        raise InvalidProblem(
            "q", f"Every row must have {arm.robot.nq} joint positions, one per joint."
        )
    limits = arm.robot.limits
    wrong = np.argwhere(
        np.abs(q)
        > MOTION_LIMITS.max_position_ratio * np.maximum(np.abs(limits.q_min), np.abs(limits.q_max))
    )
    if len(wrong):
        row, joint = wrong[0].tolist()
        raise InvalidTable(
            f"q{joint + 1} at row {first_row + row} is far beyond the joint's range and looks "
            "like degrees: give radians, or a CSV with units=deg.",
            first_row + row,
            f"q{joint + 1}",
        )
