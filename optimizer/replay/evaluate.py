"""evaluate(arm, motion): what a given motion costs, and which limits it holds.

Energy is summed over the open stretches between the instants at which speed jumps: there acceleration, and with it
torque and power, are not finite, and no model says what the arm would draw. `kinetic` is then the change of kinetic
energy within these stretches, and the parts add up to the total as they do for a smooth motion.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import reduce
from typing import TypeVar

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from models.robot import Array
from optimizer.certificate import ENERGY_FLOOR
from optimizer.energy.bus_flow import charges, drawn_at
from optimizer.energy.losses import breakdown, power_flow
from optimizer.energy.plant import Plant
from optimizer.exceptions import DeadlineExceeded, InvalidProblem
from optimizer.problem.arm import Arm
from optimizer.replay.limit_report import LimitMonitor, LimitReport
from optimizer.replay.nearest_contact import ClearanceMonitor, LeastClearance
from optimizer.replay.piecewise_motion import PiecewiseMotion, piecewise_motion
from optimizer.replay.recording import BLOCK, Log, Waypoints
from optimizer.solution import Energy, StorageUse
from optimizer.trajectories.quadrature import LOBATTO, LOBATTO_WEIGHTS

# quadrature panels: as long as this at most [s], unless a piece would have more than MOST_PANELS of them
LONGEST_PANEL, MOST_PANELS = 0.2, 256
MOST_SEGMENTS = 10_000
"""Segments of a motion with more of them are not listed one by one."""
MOST_SAMPLES = 100_000
"""Most samples that are returned."""

Sum = TypeVar("Sum")


@dataclass(frozen=True)
class IntervalEnergy:
    """Energy of a segment, or of the whole motion, from `start` to `end` [s] after the motion's start.

    `kinetic_start`, `kinetic_end` [J]: kinetic energy, rotors included, just after the start and just before the end.
    """

    start: float
    end: float
    energy: Energy
    kinetic_start: float
    kinetic_end: float

    @property
    def duration(self) -> float:
        """Length [s]."""
        return self.end - self.start

    @property
    def mean_mechanical_power(self) -> float:
        """Mean of Σ_j |tau_j v_j| [W]: Eq. 3 of the paper over the duration."""
        return self.energy.mechanical.total / self.duration

    @property
    def balance_error(self) -> float:
        """|sum of the parts - total| / total: quadrature's error, and how badly a log's v and a fit its q."""
        electrical = self.energy.electrical
        return abs(electrical.parts_sum - electrical.total) / max(abs(electrical.total), ENERGY_FLOOR)


@dataclass(frozen=True)
class Samples:
    """A motion at equal steps and at its end: t (k,), q, v, a, tau, tau_motor (k, nq), power (k,) [W].

    `charge` (k,) [J] is that of the energy storage on the bus, None without one.
    """

    t: Array
    q: Array
    v: Array
    a: Array
    tau: Array
    tau_motor: Array
    power: Array
    charge: Array | None = None


@dataclass(frozen=True)
class Evaluation:
    """What a given motion costs. `segments` is empty where there are more than MOST_SEGMENTS of `segment_count`.

    `speed_jumps` counts the instants inside the motion at which speed jumps. `nearest` is None where nothing is
    compared.
    """

    total: IntervalEnergy
    segments: list[IntervalEnergy]
    segment_count: int
    speed_jumps: int
    limits: list[LimitReport]
    samples: Samples | None
    nearest: LeastClearance | None


def evaluate(
    arm: Arm, motion: Waypoints | Log, sample_period: float | None = None, deadline: float = np.inf
) -> Evaluation:
    """Energy, limits and, with a `sample_period` [s], samples of a motion, in `deadline` seconds of wall time.

    The motion is worked through some two thousand pieces at a time: memory does not grow with its length.
    Raises InvalidProblem, InvalidTable, DeadlineExceeded.
    """
    return _Evaluator(Plant(arm), motion, sample_period, time.monotonic() + deadline).run()


class _Evaluator:
    def __init__(self, plant: Plant, motion: Waypoints | Log, period: float | None, end: float) -> None:
        self._plant, self._motion, self._period, self._end = plant, motion, period, end
        self._arm, self._charge = plant.arm, plant.arm.bus.initial
        self._data = plant.model.createData()
        self._watch = LimitMonitor(plant.arm)
        self._contact = ClearanceMonitor(plant.arm) if plant.arm.collisions else None
        self._count = motion.segments if isinstance(motion, Waypoints) else 1
        self._stretches: dict[int, IntervalEnergy] = {}
        self._samples: list[Samples] = []
        self._sampled = 0
        self._jumps = 0

    def run(self) -> Evaluation:
        last = None
        for stretch in piecewise_motion(self._plant.arm, self._motion):
            if time.monotonic() > self._end:
                raise DeadlineExceeded([])
            self._account(stretch, last)
            last = stretch
        assert last is not None
        if self._period is not None:
            self._add_samples(last, np.array([last.breaks[-1]]), np.array([self._charge]))
        segments = [self._stretches[k] for k in sorted(self._stretches)]
        return Evaluation(
            total=_joined(segments),
            segments=segments if self._count <= MOST_SEGMENTS else [],
            segment_count=self._count,
            speed_jumps=self._jumps,
            limits=self._watch.report(),
            samples=_concatenated(self._samples, self._arm.bus.mode == "storage") if self._samples else None,
            nearest=None if self._contact is None else self._contact.nearest,
        )

    def _account(self, stretch: PiecewiseMotion, before: PiecewiseMotion | None) -> None:
        """Adds energy and limits of some pieces; `before` are those that came just before."""
        panels = _panels(stretch)
        lengths = np.repeat(np.diff(stretch.breaks) / panels, panels)
        piece = np.repeat(np.arange(len(panels)), panels)
        first = np.cumsum(panels) - panels
        into = (np.arange(len(piece)) - np.repeat(first, panels)) * lengths
        x = (into[:, None] + lengths[:, None] * LOBATTO).ravel()
        weights = (lengths[:, None] * LOBATTO_WEIGHTS).ravel()
        piece = np.repeat(piece, len(LOBATTO))
        q, v, a, jerk = stretch.at(piece, x)
        tau = self._plant.torques(q, v, a)
        self._watch.update(stretch.breaks[piece] + x, q, v, a, jerk, tau)

        if self._contact is not None:
            self._contact.update(stretch)
        jumps = self._watch.see_breaks(stretch, before)
        self._jumps += len(jumps)
        joints = power_flow(tau, v, self._arm.drives, self._arm.friction_law).joints
        net = weights * (self._arm.base_power + joints.sum(axis=1))
        charge = charges(replace(self._arm.bus, initial=self._charge), net, weights)
        self._charge = float(charge[-1])
        if self._period is not None:
            known = np.append(0.0, weights.cumsum()) + stretch.breaks[0]
            self._sample(stretch, self._period, lambda t: np.interp(t, known, charge))
        # nodes begin and end every piece, and Lobatto's first and last are the piece's ends
        starts = np.searchsorted(piece, np.arange(len(panels) + 1))
        merged = self._count > MOST_SEGMENTS
        segment = np.zeros_like(stretch.segment) if merged else stretch.segment
        edges = np.flatnonzero(np.diff(segment, prepend=-1))
        for low, high in zip(edges, np.append(edges[1:], len(segment)), strict=True):
            nodes = slice(starts[low], starts[high])
            begin, end = starts[low], starts[high] - 1
            kinetic_start, kinetic_end = self._kinetic(q[begin], v[begin]), self._kinetic(q[end], v[end])
            inside = starts[jumps[(jumps > low) & (jumps < high)]]
            jumped = sum(self._kinetic(q[k], v[k]) - self._kinetic(q[k - 1], v[k - 1]) for k in inside)
            energy = breakdown(
                weights[nodes],
                v[nodes],
                tau[nodes],
                self._plant.potential(q[end]) - self._plant.potential(q[begin]),
                self._charged(float(charge[begin])),
                kinetic=kinetic_end - kinetic_start - jumped,
            )
            part = IntervalEnergy(
                float(stretch.breaks[low]), float(stretch.breaks[high]), energy, kinetic_start, kinetic_end
            )
            known = self._stretches.get(int(segment[low]))
            self._stretches[int(segment[low])] = part if known is None else _joined([known, part])

    def _kinetic(self, q: Array, v: Array) -> float:
        """Kinetic energy [J] of arm, payload and rotors."""
        return float(pin.computeKineticEnergy(self._plant.model, self._data, q, v))

    def _charged(self, charge: float) -> Arm:
        """The arm with its store at a charge [J]."""
        bus = self._arm.bus
        return replace(self._arm, bus=replace(bus, initial=charge)) if bus.mode == "storage" else self._arm

    def _sample(self, stretch: PiecewiseMotion, period: float, charge: Callable[[Array], Array]) -> None:
        """Adds the samples that lie before the pieces' end; `charge` of the store [J] at a time."""
        # what lies within a millionth of a period of the end is rounding, not a sample of its own
        stop = int(np.ceil(stretch.breaks[-1] / period - 1e-6))
        if stop >= MOST_SAMPLES:
            raise InvalidProblem(
                "sample_period", f"An answer holds at most {MOST_SAMPLES} samples: lengthen sample_period or leave it."
            )
        t = np.asarray(np.arange(self._sampled, stop) * period, dtype=float)
        self._add_samples(stretch, t, charge(t))
        self._sampled = max(stop, self._sampled)

    def _add_samples(self, stretch: PiecewiseMotion, t: Array, charge: Array) -> None:
        if not len(t):
            return
        piece = np.clip(np.searchsorted(stretch.breaks, t, side="right") - 1, 0, len(stretch.segment) - 1)
        q, v, a, _ = stretch.at(piece, t - stretch.breaks[piece])
        tau = self._plant.torques(q, v, a)
        arm = self._arm
        flow = power_flow(tau, v, arm.drives, arm.friction_law)
        power = drawn_at(arm.bus, arm.regeneration, arm.base_power, flow.joints, charge)
        self._samples.append(Samples(t, q, v, a, tau, flow.tau_motor, power, charge))


def _panels(stretch: PiecewiseMotion) -> npt.NDArray[np.int64]:
    """How many quadrature panels (m,) each piece is divided into: more where there are few pieces."""
    lengths = np.diff(stretch.breaks)
    even = max(BLOCK // len(lengths), 1)
    return np.clip(np.ceil(lengths / LONGEST_PANEL), even, max(MOST_PANELS, even)).astype(np.int64)


def _joined(parts: Iterable[IntervalEnergy]) -> IntervalEnergy:
    """Stretches that follow each other as one."""
    parts = list(parts)
    first, last = parts[0], parts[-1]
    duration = last.end - first.start
    energies = [part.energy for part in parts]
    energy = replace(
        reduce(_sum, [replace(energy, storage=None) for energy in energies]),
        peak_power=max(energy.peak_power for energy in energies),
        mean_power=sum(part.energy.mean_power * part.duration for part in parts) / duration,
        storage=_storage([energy.storage for energy in energies if energy.storage is not None]),
    )
    return IntervalEnergy(first.start, last.end, energy, first.kinetic_start, last.kinetic_end)


def _storage(uses: list[StorageUse]) -> StorageUse | None:
    """A store's use over stretches that follow each other; None without one."""
    if not uses:
        return None
    charged, discharged = (sum(getattr(use, name) for use in uses) for name in ("charged", "discharged"))
    return StorageUse(uses[0].initial, uses[-1].final, charged, discharged)


def _sum(one: Sum, other: Sum) -> Sum:
    """The sum of two figures, of two dataclasses of figures, field by field, or of nothing."""
    if one is None:
        return one
    if is_dataclass(one) and not isinstance(one, type):
        sums = {each.name: _sum(getattr(one, each.name), getattr(other, each.name)) for each in fields(one)}
        return type(one)(**sums)
    return one + other  # type: ignore[no-any-return, operator]


def _concatenated(samples: list[Samples], with_charge: bool) -> Samples:
    names = [each.name for each in fields(Samples) if with_charge or each.name != "charge"]
    return Samples(**{name: np.concatenate([getattr(part, name) for part in samples]) for name in names})
