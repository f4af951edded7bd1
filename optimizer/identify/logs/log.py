"""A log of one arm: its channels on one uniform grid of time, and the moves that it consists of."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.evaluate.recording import Recording
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arm import Payload

EffortMeaning = Literal["current", "torque", "external"]
"""What the channel of efforts has: motor currents [A], motor torques at the joints [N·m], or
torques from outside [N·m], which are those without gravity, rigid body and friction."""


@dataclass(frozen=True)
class LogMove:
    """Rows `start` to `end` of a log, the latter not among them; `at_rest`: no joint moves in
    them."""

    start: int
    end: int
    at_rest: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class Log:
    """One log of the arm `robot`, in SI units. Compared by identity. All arrays are read-only and
    share their rows, in single or double precision.

    `time` (n,) [s] is the uniform grid, from 0 in steps of 1 / `rate` [Hz]. `q` [rad], `v` [rad/s]
    and `a` [rad/s²] are (n, joints). `effort` (n, joints) is what `effort_meaning` says: both are
    None where no effort was logged. `power` (n,) [W] is drawn from the arm's bus, `temperature` (n,
    joints) [°C] that of the joints; None where not logged. `wrench` (n, 6) is the force [N] and the
    torque [N·m], about the origin of the base frame and in its axes, that the arm exerts on a
    sensor beneath its base; None where not logged. `payload` is what the arm carried, and
    `payload_known` whether anybody said so. `gravity` (3,) [m/s²] is in the base frame. `moves`
    cover all rows in their order, apart from pauses between blocks of a log that never rests.

    Raises InvalidProblem if an array has another shape than the grid asks for.
    """

    robot: str
    time: Array
    q: Array
    v: Array
    a: Array
    effort: Array | None = None
    effort_meaning: EffortMeaning | None = None
    power: Array | None = None
    temperature: Array | None = None
    wrench: Array | None = None
    payload: Payload = field(default_factory=Payload)
    payload_known: bool = True
    gravity: Array = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))
    rate: float
    moves: tuple[LogMove, ...]
    name: str | None = None
    tags: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        rows, joints = len(self.time), np.shape(self.q)[-1]
        shapes: dict[str, tuple[int, ...]] = {
            "time": (rows,),
            "power": (rows,),
            "wrench": (rows, 6),
            "gravity": (3,),
        }
        shapes |= dict.fromkeys(("q", "v", "a", "effort", "temperature"), (rows, joints))
        for name, shape in shapes.items():
            values = getattr(self, name)
            if values is not None:
                object.__setattr__(self, name, _view(values, shape, name))
        if (self.effort is None) != (self.effort_meaning is None):
            raise InvalidProblem(
                "effort", "effort and effort_meaning must be given together, or neither of them."
            )

    @property
    def joints(self) -> int:
        """Number of joints."""
        return int(self.q.shape[1])

    @property
    def segment_rows(self) -> list[int]:
        """Rows that bound the segments: the first, each in which motion or rest begins, the
        last."""
        begins = [
            move.start for before, move in pairwise(self.moves) if move.at_rest != before.at_rest
        ]
        last = len(self.time) - 1
        return [0, *(row for row in begins if 0 < row < last), last]

    def recording(self) -> Recording:
        """The logged motion, as `evaluate` takes it, with a segment for each move and each rest."""
        edges = (self.time[self.segment_rows[1:-1]] - self.time[0]).tolist()
        q, v, a = (channel.astype(float) for channel in (self.q, self.v, self.a))
        return Recording.of(self.time, q, v, a, edges)

    @property
    def duration(self) -> float:
        """Time [s] from the first row to the last one."""
        return float(self.time[-1] - self.time[0])


def _view(values: Array, shape: tuple[int, ...], name: str) -> Array:
    """A read-only view: a log can be too large to be copied. Raises InvalidProblem."""
    view = np.asarray(
        values, dtype=None if np.asarray(values).dtype == np.float32 else float
    ).view()
    if view.shape != shape:
        raise InvalidProblem(
            name, f"{name} of a log must have the shape {shape}, not {view.shape}."
        )
    view.setflags(write=False)
    return view
