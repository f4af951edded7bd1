"""The answer of a replay: a motion, planned and simulated."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from joulepath.optimizer.declared import Internal, Joules, NotEmpty, PerJoint, Ratio, Seconds, Unit
from joulepath.optimizer.replay.controller import ControlName
from joulepath.optimizer.replay.outcome import Outcome
from joulepath.optimizer.result.baseline import BaselineName

Quantity = Literal["payload", "friction"]


@dataclass(frozen=True, kw_only=True)
class ReplayedRun(Outcome):
    """The motion under one controller."""

    control: ControlName
    """The controller."""


@dataclass(frozen=True)
class SimulatedSaving:
    """Saving of the motion against a baseline."""

    name: BaselineName
    """Name of the baseline."""
    saving: Ratio
    """1 - energy of the motion / energy of the baseline, both simulated."""


@dataclass(frozen=True, kw_only=True)
class ReplayedChange(Outcome):
    """The motion on a changed arm, under the first controller, which does not know the change."""

    quantity: Quantity
    """Changed quantity."""
    factor: Ratio
    """Factor on the quantity."""
    savings: list[SimulatedSaving]
    """Savings on this arm, against every baseline on this arm."""


@dataclass(frozen=True, kw_only=True)
class SavingRange:
    """Saving of the answer against a baseline, as planned and as simulated."""

    name: BaselineName
    """Name of the baseline."""
    planned: Ratio
    """Saving in the answer."""
    simulated: Ratio
    """Saving on the unchanged arm."""
    least: Ratio
    """Smallest saving over the unchanged and all changed arms."""
    most: Ratio
    """Largest saving over these."""
    persists: bool | None = field(init=False)
    """Whether `least` is above zero; null if nothing is saved as planned."""
    range: Ratio = field(init=False)
    """`most` - `least`, in percentage points."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "persists", self.least > 0 if self.planned > 0 else None)
        object.__setattr__(self, "range", 100 * (self.most - self.least))


@dataclass(frozen=True)
class AsPlanned:
    """Energy of the motion in the answer, without waiting at the goal, and the use of its torque
    limits.
    """

    electrical: Joules
    """Energy drawn from the supply."""
    mechanical: Joules
    """Mechanical work."""
    limit_ratio: Annotated[PerJoint, Unit("1")]
    """Largest torque / limit as planned, per joint."""


@dataclass(frozen=True, kw_only=True)
class Replay:
    """A motion, planned and simulated."""

    step: Annotated[Seconds, Internal]
    """Step of the simulation."""
    duration: Seconds
    """Duration of the motion."""
    planned: AsPlanned
    """Energies and torques in the answer."""
    torque_error: Ratio | None
    """Largest difference of MuJoCo's torques from the torques of the answer's samples / limit; null
    without samples."""
    runs: Annotated[list[ReplayedRun], NotEmpty]
    """The motion under each controller."""
    changes: list[ReplayedChange]
    """The motion on changed arms; empty without `perturb`."""
    savings: list[SavingRange]
    """Savings against each baseline; empty without `perturb`."""

    def under(self, control: ControlName) -> ReplayedRun:
        """The run under a controller.

        Raises:
            LookupError: the controller was not requested.
        """
        for run in self.runs:
            if run.control == control:
                return run
        raise LookupError(control)
