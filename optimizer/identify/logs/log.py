"""Log of one arm: channels on a uniform grid of time, divided into moves and rests."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np

from joulepath.models.robot import UPRIGHT, Array, Mask, TorqueSide
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.evaluate.recording import Recording
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.logs.cycles import cycle_edges
from joulepath.optimizer.problem.arm import Payload

EffortMeaning = Literal["current", "torque", "external"]
"""Meaning of logged efforts: motor currents [A], torques at the joints [N·m], or external torques
[N·m], without gravity, rigid body and friction."""


@dataclass(frozen=True)
class LogMove:
    """A move or a rest."""

    start: int
    """First row."""
    end: int
    """Row behind the last one."""
    at_rest: bool
    """Whether no joint moves."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Log:
    """Log of one arm in SI units, with n rows; compared by identity.

    All arrays are read-only and share their rows, in single or double precision. A channel is None
    if it was not logged.

    Raises:
        InvalidProblem: an array does not have the shape of the grid.
    """

    robot: str
    time: Array
    """Uniform grid (n,) from 0 in steps of 1 / `rate` [s]."""
    q: Array
    """Positions (n, joints) [rad]."""
    v: Array
    """Velocities (n, joints) [rad/s]."""
    a: Array
    """Accelerations (n, joints) [rad/s²]."""
    effort: Array | None = None
    """Efforts (n, joints), in the unit of their meaning; NaN for a joint whose effort was not
    logged."""
    effort_meaning: EffortMeaning | None = None
    torque_side: TorqueSide = "motor"
    """Where torques were measured: `motor`, with rotor and friction, or `link`, by sensors behind
    the gears, without them. Currents are always those of the motors."""
    power: Array | None = None
    """Power drawn from the arm's bus (n,) [W]."""
    temperature: Array | None = None
    """Temperatures of the joints (n, joints) [°C]."""
    wrench: Array | None = None
    """Force [N] and torque [N·m] of the arm on a sensor beneath its base (n, 6), about the origin
    of the base frame and in its axes."""
    payload: Payload = field(default_factory=Payload)
    payload_known: bool = True
    """Whether the payload was stated or logged."""
    gravity: Array = field(default_factory=UPRIGHT.copy)
    """Gravity (3,) in the base frame [m/s²]."""
    rate: float
    """Rate of the grid [Hz]."""
    moves: tuple[LogMove, ...]
    """Moves and rests, which cover all rows in order, apart from the gaps between blocks of a log
    that never rests."""
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
        if self.torque_side == "link" and self.effort_meaning == "current":
            raise InvalidProblem(
                "torque_side", "Currents are those of the motors: torque_side must be motor."
            )

    @property
    def carries_weight(self) -> bool:
        """Whether the logged efforts contain gravity, as the identification requires."""
        return self.effort_meaning in ("current", "torque")

    @property
    def has_all_efforts(self) -> bool:
        """Whether the efforts of all joints were logged."""
        return self.effort is not None and bool(np.isfinite(self.effort[0]).all())

    @property
    def joints(self) -> int:
        """Number of joints."""
        return int(self.q.shape[1])

    @cached_property
    def cycle_rows(self) -> Indices:
        """First row of each cycle of a repetitive log, and the end of the last cycle; empty if the
        motion does not repeat."""
        return cycle_edges(self.q, self.v, self.rests, self.rate, self._moves_and_rests)

    @property
    def segment_rows(self) -> list[int]:
        """Boundaries of the segments: the first row, the starts of motions, rests and cycles, and
        the last row."""
        return sorted({*self._moves_and_rests, *self.cycle_rows.tolist()})

    @property
    def _moves_and_rests(self) -> list[int]:
        """The first row, the starts of motions and rests, and the last row."""
        begins = [
            move.start for before, move in pairwise(self.moves) if move.at_rest != before.at_rest
        ]
        last = len(self.time) - 1
        return [0, *(row for row in begins if 0 < row < last), last]

    @property
    def rests(self) -> Mask:
        """Whether the arm rests (n,)."""
        rest = np.zeros(len(self.time), dtype=bool)
        for move in self.moves:
            rest[move.start : move.end] = move.at_rest
        return rest

    def recording(self) -> Recording:
        """The logged motion in the form of `evaluate`, divided into moves, rests and cycles."""
        rows = self.segment_rows
        edges = (self.time[rows[1:-1]] - self.time[0]).tolist()
        q, v, a = (channel.astype(float) for channel in (self.q, self.v, self.a))
        cycles = tuple(np.searchsorted(rows, self.cycle_rows).tolist())
        return Recording.of(self.time, q, v, a, edges, cycles)

    @property
    def duration(self) -> float:
        """Time from the first to the last row [s]."""
        return float(self.time[-1] - self.time[0])


def _view(values: Array, shape: tuple[int, ...], name: str) -> Array:
    """A read-only view, because a log can be too large to be copied.

    Raises:
        InvalidProblem: the array has another shape.
    """
    view = np.asarray(
        values, dtype=None if np.asarray(values).dtype == np.float32 else float
    ).view()
    if view.shape != shape:
        raise InvalidProblem(
            name, f"{name} of a log must have the shape {shape}, not {view.shape}."
        )
    view.setflags(write=False)
    return view
