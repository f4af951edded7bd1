"""The answer of a replay: a motion, planned and simulated."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from joulepath.models.immutable import ReadOnlyArrays
from joulepath.optimizer.declared import Internal, Joules, NotEmpty, PerJoint, Ratio, Seconds, Unit
from joulepath.optimizer.presentation.result import Result, Rows
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
class AsPlanned(ReadOnlyArrays):
    """Energy of the motion in the answer, without waiting at the goal, and the use of its torque
    limits.
    """

    electrical: Joules
    """Energy drawn from the supply."""
    mechanical: Joules
    """Mechanical work."""
    limit_ratio: Annotated[PerJoint, Unit("1")]
    """Largest torque / limit as planned, per joint."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Replay(Result):
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

    def _headline(self) -> str:
        run = self.runs[0]
        lasting = [each.name for each in self.savings if each.persists]
        parts = [
            f"{run.control} {run.electrical:.4g} J electrical",
            f"{run.electrical_error:+.3%} of the plan",
            f"{1e3 * run.tcp_error:.3g} mm off",
            *(["collides"] if run.collides else []),
            *([f"still saves against {', '.join(lasting)}"] if lasting else []),
        ]
        return ", ".join(parts)

    def _rows(self) -> Rows:
        names = ("control", "change", "electrical", "electrical_error", "tcp_error", "collides")
        columns = self._columns()
        cells = [
            [f"{each:.4g}" if isinstance(each, float) else str(each) for each in row]
            for row in zip(*(columns[name] for name in names), strict=True)
        ]
        head = ("controller", "change", "electrical [J]", "error [1]", "TCP error [m]", "collides")
        return [head, *cells]

    def _shown(self) -> Any:
        return self

    def _columns(self) -> dict[str, Any]:
        """One row per controller, then one per changed arm."""
        outcomes: list[Outcome] = [*self.runs, *self.changes]
        first = self.runs[0].control
        numbers = ("electrical", "mechanical", "electrical_error", "tcp_error", "collides")
        return {
            "control": [*(run.control for run in self.runs), *(first for _ in self.changes)],
            "change": [
                *("" for _ in self.runs),
                *(f"{each.quantity} × {each.factor:.4g}" for each in self.changes),
            ],
            **{name: [getattr(each, name) for each in outcomes] for name in numbers},
        }
