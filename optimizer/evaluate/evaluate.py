"""Public entry point: `evaluate(arm, motion)` computes the energy and checks the limits of a
motion.

At a velocity step, acceleration, torque and power are infinite, and no model gives the power drawn.
Energy is therefore summed over the open intervals between the steps. `kinetic` is the change of
kinetic energy within these intervals, so that the parts add up to the total as they do for a smooth
motion.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, checkpoint, watch
from joulepath.optimizer.dynamics.bus_flow import charges
from joulepath.optimizer.dynamics.interval import arm_spread, with_interval
from joulepath.optimizer.dynamics.losses import breakdown, power_flow
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.dynamics.sensitivity import energy_sensitivity
from joulepath.optimizer.evaluate.interval_energy import IntervalEnergy, joined
from joulepath.optimizer.evaluate.limit_report import LimitMonitor, LimitReport
from joulepath.optimizer.evaluate.nearest_contact import ClearanceMonitor, LeastClearance
from joulepath.optimizer.evaluate.piecewise_motion import (
    Indices,
    Motion,
    PiecewiseMotion,
    piecewise_motion,
)
from joulepath.optimizer.evaluate.recording import BLOCK
from joulepath.optimizer.evaluate.sampler import Sampler
from joulepath.optimizer.exceptions import DeadlineExceeded
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.motion.quadrature import lobatto_panels
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.result.certificate import Clearance
from joulepath.optimizer.result.energy import Energy, Sensitivity
from joulepath.optimizer.result.solution import Samples, Solution

# quadrature panels: their greatest length [s], unless a polynomial piece would have more than
# MOST_PANELS of them
LONGEST_PANEL, MOST_PANELS = 0.2, 256
MOST_SEGMENTS = 10_000
"""Most segments of a motion that are listed one by one."""
MOST_INTERVALS = 200
"""Most segments whose energies each get an interval: one takes about a millisecond."""
# segments between two looks at the deadline: some ten milliseconds
SEGMENTS_PER_CHECK = 64


@dataclass(frozen=True)
class Evaluation:
    """Energy and limits of a given motion. `segments` is empty if `segment_count` exceeds
    MOST_SEGMENTS.

    `speed_jumps` counts the velocity steps inside the motion. `nearest` has the margins subtracted;
    it is None if collisions are not checked. `close_pass` has none subtracted; it is None unless it
    is below 2 mm. `unmodelled` is that of a `Solution`.
    """

    total: IntervalEnergy
    segments: list[IntervalEnergy]
    segment_count: int
    speed_jumps: int
    limits: list[LimitReport]
    samples: Samples | None
    nearest: LeastClearance | None
    close_pass: LeastClearance | None
    unmodelled: list[Clearance]


@one_thread()
def evaluate(
    arm: Arm,
    motion: Motion | Solution,
    sample_period: float | None = None,
    deadline: float = np.inf,
    clock: Clock = time.perf_counter,
) -> Evaluation:
    """Compute the energy of a given motion, and how far it uses every limit of the arm.

    Nothing is optimised, and the motion may violate the limits. It is processed in blocks of some
    two thousand polynomial pieces, so that memory does not grow with its length.

    Args:
        arm: arm that makes the motion. It may be another one than a solution was found for.
        motion: joint positions with times, a recording, a spline, or the motion of a solution
            (without the time that the arm waits after it).
        sample_period: period of the samples in the result [s]; without one there are no samples.
        deadline: wall time after which the computation is given up [s].
        clock: function that returns the time [s].

    Returns:
        Energy of the whole motion and of each segment [J], the worst use of each limit, and the
        least clearance.

    Raises:
        InvalidProblem: the motion does not fit the arm, or has too many samples.
        InvalidTable: a row of the motion is wrong.
        DeadlineExceeded: the deadline passed first.
    """
    end = Deadline.after(deadline, clock)
    given = motion.trajectory.spline if isinstance(motion, Solution) else motion
    evaluator = _Evaluator(arm, given, sample_period)
    try:
        with watch(end):
            for block in piecewise_motion(arm, given):
                checkpoint()
                evaluator.update(block)
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None
    return evaluator.finish()


@dataclass(frozen=True)
class _Nodes:
    """Quadrature nodes (k,) of a block in order of time. The first and the last node of each piece
    are its ends.

    `piece` (k,) is the index of the polynomial piece, t and `weights` (k,) are in seconds; q, v, a,
    jerk, tau (k, nq) describe the motion there, with tau [N·m] the torque of rigid bodies and
    rotors.
    """

    piece: Indices
    t: Array
    weights: Array
    q: Array
    v: Array
    a: Array
    jerk: Array
    tau: Array

    @staticmethod
    def of(plant: Plant, motion: PiecewiseMotion) -> _Nodes:
        lengths = np.diff(motion.breakpoints)
        # more panels per piece if there are few pieces
        least = max(BLOCK // len(lengths), 1)
        panels = np.clip(np.ceil(lengths / LONGEST_PANEL), least, max(MOST_PANELS, least)).astype(
            np.int64
        )
        piece, offset, weights = lobatto_panels(motion.breakpoints, panels)
        q, v, a, jerk = motion.at(piece, offset)
        tau = plant.torques(q, v, a)
        return _Nodes(piece, motion.breakpoints[piece] + offset, weights, q, v, a, jerk, tau)


class _Evaluator:
    """Sums of a motion that is processed block after block."""

    def __init__(self, arm: Arm, motion: Motion, period: float | None) -> None:
        self._arm, self._plant = arm, Plant(arm)
        self._data = self._plant.model.createData()
        self._limits = LimitMonitor(arm)
        self._clearance = ClearanceMonitor(arm) if arm.collisions else None
        self._sampler = None if period is None else Sampler(self._plant, period)
        self._segment_count = 1 if isinstance(motion, Spline) else motion.segments
        self._intervals: dict[int, IntervalEnergy] = {}
        self._speed_jumps = 0
        self._spread = arm_spread(arm)
        self._sensitivity = Sensitivity(np.zeros_like(self._spread.mean), 0.0)
        self._sensitivities: dict[int, Sensitivity] = {}
        self._charge = arm.bus.initial
        self._last: PiecewiseMotion | None = None

    def update(self, block: PiecewiseMotion) -> None:
        """Add the next block."""
        nodes = _Nodes.of(self._plant, block)
        self._limits.update(nodes.t, nodes.q, nodes.v, nodes.a, nodes.jerk, nodes.tau)
        if self._clearance is not None:
            self._clearance.update(block)
        steps = self._limits.update_breakpoints(block, self._last)
        self._speed_jumps += len(steps)
        charge = self._charge_course(nodes)
        if self._sampler is not None:
            known = np.append(0.0, nodes.weights.cumsum()) + block.breakpoints[0]
            self._sampler.update(block, lambda t: np.interp(t, known, charge))
        self._add_energies(block, nodes, steps, charge)
        if self._segment_count > MOST_INTERVALS:
            self._sensitivity += self._sensitivity_of(nodes, slice(None), float(charge[0]))
        self._last = block

    def finish(self) -> Evaluation:
        """The evaluation of all blocks."""
        assert self._last is not None  # motions without a block are refused
        segments = [self._intervals[k] for k in sorted(self._intervals)]
        total = self._known(joined(segments), self._sensitivity)
        segments = [
            self._known(segment, self._sensitivities[k]) if self._sensitivities else segment
            for k, segment in zip(sorted(self._intervals), segments, strict=True)
        ]
        return Evaluation(
            total=total,
            segments=segments if self._segment_count <= MOST_SEGMENTS else [],
            segment_count=self._segment_count,
            speed_jumps=self._speed_jumps,
            limits=self._limits.report(),
            samples=None
            if self._sampler is None
            else self._sampler.finish(self._last, self._charge),
            nearest=None if self._clearance is None else self._clearance.nearest,
            close_pass=None if self._clearance is None else self._clearance.close_pass,
            unmodelled=[] if self._clearance is None else self._clearance.unmodelled,
        )

    def _known(self, part: IntervalEnergy, sensitivity: Sensitivity) -> IntervalEnergy:
        """A part of the motion, with the interval of its energy."""
        energy = with_interval(part.energy, sensitivity, part.duration, self._arm)
        return replace(part, energy=energy)

    def _sensitivity_of(self, nodes: _Nodes, inside: slice, charge: float) -> Sensitivity:
        """That of the energy of some nodes, which begin with a charge [J] of the storage."""
        weights, q, v, a, tau = (
            part[inside] for part in (nodes.weights, nodes.q, nodes.v, nodes.a, nodes.tau)
        )
        return energy_sensitivity(weights, q, v, a, tau, self._charged(charge), self._spread)

    def _charge_course(self, nodes: _Nodes) -> Array:
        """Charge (k + 1,) [J] of the energy storage before each node and after the last."""
        joints = power_flow(
            nodes.tau, nodes.v, nodes.a, self._arm.drives, self._arm.friction_law
        ).joints
        net = nodes.weights * (self._arm.base_power + joints.sum(axis=1))
        charge = charges(replace(self._arm.bus, initial=self._charge), net, nodes.weights)
        self._charge = float(charge[-1])
        return charge

    def _add_energies(
        self, block: PiecewiseMotion, nodes: _Nodes, steps: Indices, charge: Array
    ) -> None:
        """Add the energy of each segment in a block; `steps` are the pieces that begin with a
        velocity step.
        """
        # the first node of every piece, and the end
        first = np.searchsorted(nodes.piece, np.arange(len(block.segment) + 1))
        segment = (
            block.segment if self._segment_count <= MOST_SEGMENTS else np.zeros_like(block.segment)
        )
        edges = np.append(np.flatnonzero(np.diff(segment, prepend=-1)), len(segment))
        for k, (low, high) in enumerate(pairwise(edges.tolist()), 1):
            if k % SEGMENTS_PER_CHECK == 0:
                checkpoint()
            inside = first[steps[(steps > low) & (steps < high)]]
            energy = self._energy(
                nodes, int(first[low]), int(first[high]), inside, float(charge[first[low]])
            )
            kinetic = (
                self._kinetic(nodes, int(first[low])),
                self._kinetic(nodes, int(first[high]) - 1),
            )
            part = IntervalEnergy(
                float(block.breakpoints[low]), float(block.breakpoints[high]), energy, *kinetic
            )
            if self._segment_count <= MOST_INTERVALS:
                nodes_inside = slice(int(first[low]), int(first[high]))
                own = self._sensitivity_of(nodes, nodes_inside, float(charge[first[low]]))
                known = self._sensitivities.get(int(segment[low]))
                self._sensitivities[int(segment[low])] = own if known is None else known + own
                self._sensitivity += own
            before = self._intervals.get(int(segment[low]))
            self._intervals[int(segment[low])] = part if before is None else joined([before, part])

    def _energy(self, nodes: _Nodes, begin: int, end: int, steps: Indices, charge: float) -> Energy:
        """Energy from node `begin` to before node `end`; `steps` are the nodes in between just
        after a velocity step.

        `charge` [J] is that of the energy storage at the beginning.
        """
        plant, inside, last = self._plant, slice(begin, end), end - 1
        at_steps = sum(
            self._kinetic(nodes, int(k)) - self._kinetic(nodes, int(k) - 1) for k in steps
        )
        return breakdown(
            nodes.weights[inside],
            nodes.v[inside],
            nodes.a[inside],
            nodes.tau[inside],
            plant.potential(nodes.q[last]) - plant.potential(nodes.q[begin]),
            self._charged(charge),
            kinetic=self._kinetic(nodes, last) - self._kinetic(nodes, begin) - at_steps,
        )

    def _kinetic(self, nodes: _Nodes, k: int) -> float:
        """Kinetic energy [J] of arm, payload and rotors at a node."""
        return float(
            pin.computeKineticEnergy(self._plant.model, self._data, nodes.q[k], nodes.v[k])
        )

    def _charged(self, charge: float) -> Arm:
        """The arm with a charge [J] of its energy storage, if it has one."""
        bus = self._arm.bus
        return (
            replace(self._arm, bus=replace(bus, initial=charge))
            if bus.mode == "storage"
            else self._arm
        )
