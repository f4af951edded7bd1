"""Public entry point: `evaluate(arm, motion)` computes the energy and checks the limits of a
motion.

At a velocity step, acceleration, torque and power are infinite, and no model gives the power drawn.
Energy is therefore summed over the open intervals between the steps. `kinetic` is the change of
kinetic energy within these intervals, so the parts add up to the total as for a smooth motion.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import reduce
from itertools import pairwise
from operator import add

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, checkpoint, watch
from joulepath.optimizer.dynamics.bus_flow import charges
from joulepath.optimizer.dynamics.interval import arm_spread, with_interval
from joulepath.optimizer.dynamics.losses import breakdown, power_flow
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.dynamics.sensitivity import energy_sensitivity
from joulepath.optimizer.evaluate.evaluation import Evaluation
from joulepath.optimizer.evaluate.interval_energy import IntervalEnergy, join_intervals
from joulepath.optimizer.evaluate.limit_report import LimitMonitor
from joulepath.optimizer.evaluate.nearest_contact import ClearanceMonitor
from joulepath.optimizer.evaluate.piecewise_motion import (
    Indices,
    Motion,
    PiecewiseMotion,
    piecewise_motion,
)
from joulepath.optimizer.evaluate.recording import MOTION_LIMITS, Recording, Waypoints
from joulepath.optimizer.evaluate.sampler import Sampler
from joulepath.optimizer.exceptions import DeadlineExceeded
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.motion.quadrature import lobatto_panels
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.declared_types import checked_arguments
from joulepath.optimizer.problem.scalars import check_number
from joulepath.optimizer.progress import Steps, TellSteps, no_listener
from joulepath.optimizer.result.energy import (
    Energy,
    Sensitivity,
)
from joulepath.optimizer.result.solution import Solution


@dataclass(frozen=True)
class QuadratureSettings:
    """Settings of the quadrature of powers."""

    max_panel: float = 0.2
    """Largest length of a quadrature panel [s]."""
    max_panels: int = 256
    """Largest number of panels of a polynomial piece, which takes precedence over their length."""
    segments_per_check: int = 64
    """Segments between two checks of the deadline: some ten milliseconds."""


QUADRATURE = QuadratureSettings()


@checked_arguments
@one_thread()
def evaluate(
    arm: Arm,
    motion: Motion | Solution,
    sample_period: float | None = None,
    deadline: float = np.inf,
    clock: Clock = time.perf_counter,
    tell: TellSteps = no_listener,
    progress: bool = True,
) -> Evaluation:
    """Compute the energy of a given motion, and its use of every limit of the arm.

    Nothing is optimised, and the motion may exceed the limits. It is processed in blocks of some
    two thousand polynomial pieces, so memory does not grow with its length.

    Args:
        arm: arm of the motion; it may differ from the arm that a solution was found for.
        motion: joint positions with times, a recording, a spline, or the motion of a solution
            (without the time that the arm waits after it).
        sample_period: period of the samples in the result [s]; None for no samples.
        deadline: wall time after which the computation is given up [s].
        clock: function for the current time [s].
        tell: gets the progress, in seconds of the motion.
        progress: whether a bar may show the progress, on a terminal or in a notebook, unless
            `tell` is given.

    Returns:
        Energy of the whole motion and of each segment [J], the largest use of each limit, and the
        least clearance.

    Raises:
        InvalidProblem: the motion does not fit the arm, or has too many samples.
        InvalidTable: a row of the motion is wrong.
        DeadlineExceeded: the deadline passed first.
    """
    check_number("sample_period", sample_period, "seconds", positive=True, optional=True)
    end = Deadline.after(deadline, clock)
    given = motion.trajectory.spline if isinstance(motion, Solution) else motion
    evaluator = _Evaluator(arm, given, sample_period)
    try:
        with watch(end), progress_bar("Evaluating", tell, progress) as tell:
            steps = Steps("s of the motion", _duration(given), tell)
            for block in piecewise_motion(arm, given):
                checkpoint()
                evaluator.update(block)
                steps.add(float(np.ptp(block.breakpoints)))
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None
    return evaluator.finish()


def _duration(motion: Motion) -> float | None:
    """Duration of a motion [s]; None if it is not known before the motion is read."""
    return float(motion.times.sum()) if isinstance(motion, Waypoints) else motion.duration


@dataclass(frozen=True)
class _Nodes:
    """Quadrature nodes (k,) of a block in order of time, among them the ends of each piece.

    Attributes:
        piece: index of the polynomial piece (k,).
        t: time (k,) [s].
        weights: weights of the quadrature (k,) [s].
        tau: torque of rigid bodies and rotors (k, nq) [N·m].
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
        least = max(MOTION_LIMITS.block_rows // len(lengths), 1)
        panels = np.clip(
            np.ceil(lengths / QUADRATURE.max_panel), least, max(QUADRATURE.max_panels, least)
        ).astype(np.int64)
        piece, offset, weights = lobatto_panels(motion.breakpoints, panels)
        q, v, a, jerk = motion.at(piece, offset)
        tau = plant.torques(q, v, a)
        return _Nodes(piece, motion.breakpoints[piece] + offset, weights, q, v, a, jerk, tau)


class _Evaluator:
    """Sums over the blocks of a motion."""

    def __init__(self, arm: Arm, motion: Motion, period: float | None) -> None:
        self._arm, self._plant = arm, Plant(arm)
        self._data = self._plant.model.createData()
        self._limits = LimitMonitor(arm)
        self._clearance = ClearanceMonitor(arm) if arm.collisions else None
        self._sampler = None if period is None else Sampler(self._plant, period)
        self._segment_count = 1 if isinstance(motion, Spline) else motion.segments
        self._cycles = motion.cycles if isinstance(motion, Recording) else ()
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
        charge = self._charge_at_nodes(nodes)
        if self._sampler is not None:
            known = np.append(0.0, nodes.weights.cumsum()) + block.breakpoints[0]
            self._sampler.update(block, lambda t: np.interp(t, known, charge))
        self._add_energies(block, nodes, steps, charge)
        if self._segment_count > MOTION_LIMITS.max_intervals:
            self._sensitivity += self._sensitivity_of(nodes, slice(None), float(charge[0]))
        self._last = block

    def finish(self) -> Evaluation:
        """The evaluation of all blocks."""
        assert self._last is not None  # motions without a block are refused
        whole = self._with_interval(join_intervals([*self._intervals.values()]), self._sensitivity)
        listed = self._segment_count <= MOTION_LIMITS.max_segments
        limits = self._limits.report()
        nearest = None if self._clearance is None else self._clearance.nearest
        return Evaluation(
            duration=whole.duration,
            total=whole,
            segments=[self._part(k, k + 1) for k in self._intervals] if listed else [],
            cycles=[self._part(*ends) for ends in pairwise(self._cycles)] if listed else [],
            segment_count=self._segment_count,
            speed_jumps=self._speed_jumps,
            within_limits=all(each.held for each in limits),
            limits=limits,
            samples=None
            if self._sampler is None
            else self._sampler.finish(self._last, self._charge),
            collides=None if nearest is None else nearest.distance < 0,
            nearest=nearest,
            close_pass=None if self._clearance is None else self._clearance.close_pass,
            unmodelled=() if self._clearance is None else self._clearance.unmodelled,
        )

    def _part(self, first: int, end: int) -> IntervalEnergy:
        """Consecutive segments, with the interval of their energy if segments have intervals."""
        parts = [self._intervals[k] for k in range(first, end)]
        part = parts[0] if len(parts) == 1 else join_intervals(parts)
        if not self._sensitivities:
            return part
        known = reduce(add, [self._sensitivities[k] for k in range(first, end)])
        return self._with_interval(part, known)

    def _with_interval(self, part: IntervalEnergy, sensitivity: Sensitivity) -> IntervalEnergy:
        """A part of the motion with the interval of its energy."""
        energy = with_interval(part.energy, sensitivity, part.duration, self._arm)
        return replace(part, energy=energy)

    def _sensitivity_of(self, nodes: _Nodes, inside: slice, charge: float) -> Sensitivity:
        """Sensitivity of the energy of some nodes, with the initial charge [J] of a storage."""
        weights, q, v, a, tau = (
            part[inside] for part in (nodes.weights, nodes.q, nodes.v, nodes.a, nodes.tau)
        )
        return energy_sensitivity(
            weights, q, v, a, tau, self._arm_with_charge(charge), self._spread
        )

    def _charge_at_nodes(self, nodes: _Nodes) -> Array:
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
        """Add the energies of the segments of a block.

        Args:
            block: the block.
            nodes: its quadrature nodes.
            steps: pieces with a velocity step at their start.
            charge: charge of the energy storage at the nodes [J].
        """
        # the first node of every piece, and the end
        first = np.searchsorted(nodes.piece, np.arange(len(block.segment) + 1))
        segment = (
            block.segment
            if self._segment_count <= MOTION_LIMITS.max_segments
            else np.zeros_like(block.segment)
        )
        edges = np.append(np.flatnonzero(np.diff(segment, prepend=-1)), len(segment))
        for k, (low, high) in enumerate(pairwise(edges.tolist()), 1):
            if k % QUADRATURE.segments_per_check == 0:
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
            if self._segment_count <= MOTION_LIMITS.max_intervals:
                nodes_inside = slice(int(first[low]), int(first[high]))
                own = self._sensitivity_of(nodes, nodes_inside, float(charge[first[low]]))
                known = self._sensitivities.get(int(segment[low]))
                self._sensitivities[int(segment[low])] = own if known is None else known + own
                self._sensitivity += own
            before = self._intervals.get(int(segment[low]))
            self._intervals[int(segment[low])] = (
                part if before is None else join_intervals([before, part])
            )

    def _energy(self, nodes: _Nodes, begin: int, end: int, steps: Indices, charge: float) -> Energy:
        """Energy from node `begin` to before node `end`.

        Args:
            nodes: the quadrature nodes.
            begin: first node.
            end: node behind the last one.
            steps: nodes in between that follow a velocity step.
            charge: charge of the energy storage at the beginning [J].
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
            self._arm_with_charge(charge),
            kinetic=self._kinetic(nodes, last) - self._kinetic(nodes, begin) - at_steps,
        )

    def _kinetic(self, nodes: _Nodes, k: int) -> float:
        """Kinetic energy [J] of arm, payload and rotors at a node."""
        coupling = self._arm.robot.coupling
        q, v = coupling.positions(nodes.q[k]), coupling.rates(nodes.v[k])
        return float(pin.computeKineticEnergy(self._plant.model, self._data, q, v))

    def _arm_with_charge(self, charge: float) -> Arm:
        """The arm with a charge [J] of its energy storage, if it has one."""
        bus = self._arm.bus
        return (
            replace(self._arm, bus=replace(bus, initial=charge))
            if bus.mode == "storage"
            else self._arm
        )
