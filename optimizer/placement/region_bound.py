"""Lower bound on the energy of a cycle at every place of a region, of any configurations.

The bound does not know where the base stands. It uses what all places have in common:

**Bus.** As in `bounds.net_energy.electrical`, the energy of a move of duration T is at least
P T + ΔU + Σ_j ∫ φ_j(|v_j|) dt, with the power P of electronics and inverters less the deficit of
the Coulomb friction's knee, and φ_j(v) = v (coulomb + curved asinh(v / s) + viscous v), which is
convex. Copper loss is left out.

**Travel.** Let a point of the tool travel at least d and the tool turn by at least θ. A joint that
turns by dq moves the point by at most r_j dq, where r_j is the greatest distance of the point from
its axis, and turns the tool by at most dq. So Σ_j r_j ∫ |v_j| dt ≥ d and Σ_j ∫ |v_j| dt ≥ θ. For
multipliers λ, κ ≥ 0 with w_j = λ r_j + κ,

    P T + Σ_j ∫ φ_j dt ≥ λ d + κ θ + T (P + Σ_j min_v (φ_j(v) - w_j v)),

over speeds v up to the limits. If the bracket is not negative, the move needs at least
λ d + κ θ + ΔU. The bracket falls with the multipliers: for every ratio of λ and κ, the greatest
ones are found by bisection.

**Time.** The cycle takes at least t_min and at most t_max. If a part μ of the power is taken from
P and from the power at rest, and paid for t_min, the bound holds, too: μ is at most the least power
at any time. A negative μ is paid for t_max.

**Potential.** The arm of a closed cycle ends where it began, and its links gain nothing. A payload
that is carried from one place to another gains m g times the difference of their heights, which
only the places themselves change. For a cycle that is not closed, the links may lose as much as
they can between any two configurations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product

import numpy as np

from joulepath.models.robot import Array, FrictionLaw
from joulepath.optimizer.bounds.net_energy import KNEE_DEFICIT
from joulepath.optimizer.cycle.rest_energy import least_dwell_cost, least_holding_power
from joulepath.optimizer.dynamics.dwell import brake_power
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.kinematics.covers.wrist_geometry import potential_rates
from joulepath.optimizer.kinematics.forward import joint_placements
from joulepath.optimizer.kinematics.tcp import T_last_tcp, tcp_pose
from joulepath.optimizer.placement.extents import Extent, Extents
from joulepath.optimizer.placement.moved_cycle import inverted
from joulepath.optimizer.placement.space import Space
from joulepath.optimizer.problem.arm import Arm, Payload
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import START, Cycle
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.stops import APPROACH, RETREAT, PlannedMove
from joulepath.optimizer.problem.targets import Single, Target, members


@dataclass(frozen=True)
class RegionBoundSettings:
    """Settings of the bound; any values give a valid bound."""

    shares: tuple[float, ...] = (0.0, 0.25, 0.5, 0.75, 1.0)
    """Shares of κ times a metre in the multipliers that are tried."""
    prices: tuple[float, ...] = (-8.0, -4.0, -2.0, -1.0, -0.5, 0.0, 0.25, 0.5, 0.75, 1.0)
    """Shares μ of the least power that are tried."""
    bisections: int = 50
    """Steps of every bisection."""


REGION_BOUND = RegionBoundSettings()


def region_bound(space: Space) -> float | None:
    """Lower bound on the objective of all cycles, times their weights, at every place.

    Args:
        space: the places.

    Returns:
        The bound [J]; None where none is known, as with a friction law that is not convex.
    """
    extents = Extents(space)
    total = 0.0
    for each in space.placement.cycles:
        bound = CycleBound(each.cycle, extents).least()
        if bound is None:
            return None
        total += each.weight * bound
    return total


@dataclass(frozen=True, eq=False)
class _Spot:
    """A place of a cycle: the TCP is within `slack` [m] of a target, which moves with a stop."""

    stop: str
    target: Target
    slack: float = 0.0


@dataclass(frozen=True, eq=False)
class _Travel:
    """Least travel of a move: of the TCP [m], and of the tool's orientation [rad]."""

    arm: Arm
    distance: float
    angle: float


def _spots(cycle: Cycle) -> dict[str, _Spot]:
    """The places of a cycle by their names."""
    spots = {START: _Spot(START, cycle.start)}
    for stop in cycle.stops:
        spots[stop.entry] = _Spot(stop.name, stop.target)
        if stop.path is not None:
            spots[stop.name] = _Spot(stop.name, stop.path.goal)
        if stop.approach is not None:
            outer = replace(spots[stop.entry], slack=stop.approach.distance)
            spots[stop.name + APPROACH] = outer
        if stop.retreat is not None:
            outer = replace(spots[stop.name], slack=stop.retreat.distance)
            spots[stop.name + RETREAT] = outer
    return spots


class CycleBound:
    """The bound of one cycle."""

    def __init__(self, cycle: Cycle, extents: Extents) -> None:
        self.cycle, self.extents, self.spots = cycle, extents, _spots(cycle)
        # by the power and the greatest speeds
        self._prices: dict[tuple[float, bytes], tuple[Array, Array]] = {}

    def least(self) -> float | None:
        """The bound [J]; None where none is known."""
        cycle, law = self.cycle, self.cycle.arm.friction_law
        never_negative = cycle.arm.regeneration == 0 and cycle.arm.bus.mode != "storage"
        if min(law.coulomb.min(), law.curved.min(), law.viscous.min()) < 0:
            return None
        if cycle.order is not None:
            # what is carried where depends on the order
            return 0.0 if never_negative else None
        gain = self.gain
        if cycle.objective == "mechanical":
            return max(gain, 0.0)
        value = self._electrical(gain)
        return max(value, 0.0) if never_negative else value

    def _electrical(self, gain: float) -> float:
        cycle = self.cycle
        moves, power = cycle.moves, _moving_power(cycle.arm)
        rests = [(move, least_holding_power(move)) for move in moves]
        least = min([power, *(hold for _, hold in rests)])
        if cycle.hold == "brakes":
            least = min(least, *(brake_power(cycle.dwell_of(1.0), m.arm_after) for m in moves))
        travels, best = [self._travel(move) for move in moves], -np.inf
        for share in REGION_BOUND.prices:
            price = share * max(least, 0.0)
            time = cycle.duration_min if price > 0 else cycle.duration_max
            if time is None and price != 0:
                continue
            paid = price * ((time or 0.0) - cycle.dwell_time)
            moving = sum(self._moving(each, power - price) for each in travels)
            best = max(best, gain + self.dwells + paid + moving)
        return best

    def _moving(self, travel: _Travel, power: float) -> float:
        """Least energy of a move without its gain of potential energy [J]."""
        key = power, travel.arm.active_limits.v_max.tobytes()
        if key not in self._prices:
            self._prices[key] = prices_of_travel(travel.arm, power)
        per_metre, per_radian = self._prices[key]
        return float((per_metre * travel.distance + per_radian * travel.angle).max())

    def _travel(self, move: PlannedMove) -> _Travel:
        between = [self._apart(*ends) for ends in pairwise((move.start, *move.through, move.goal))]
        return _Travel(move.arm, sum(d for d, _ in between), sum(angle for _, angle in between))

    def _apart(self, a: str, b: str) -> tuple[float, float]:
        """Least distance [m] of the TCP and least angle [rad] between two places."""
        start, goal = self.spots[a], self.spots[b]
        if start.stop == goal.stop and start.slack != goal.slack:
            # a line from a stop to its outer end, or back
            return abs(start.slack - goal.slack), 0.0
        slack = start.slack + goal.slack
        pairs = list(product(members(start.target), members(goal.target)))
        angles = [self._angle(start, first, goal, second) for first, second in pairs]
        apart = [self._distance(start, first, goal, second) for first, second in pairs]
        return max(min(apart) - slack, 0.0), min(angles)

    def _together(self, start: _Spot, goal: _Spot) -> bool:
        """Whether two places move with the same body."""
        bodies = [self.extents.body_of_stop(each.stop) for each in (start, goal)]
        return bodies[0] == bodies[1]

    def _angle(self, start: _Spot, first: Single, goal: _Spot, second: Single) -> float:
        """Least angle between the orientations of two targets [rad]."""
        if not (isinstance(first, Pose) and isinstance(second, Pose)):
            return 0.0
        return angle_between(first, second) if self._together(start, goal) else 0.0

    def _distance(self, start: _Spot, first: Single, goal: _Spot, second: Single) -> float:
        """Least distance between two targets [m]."""
        posed = [isinstance(each, Pose | ConeOrientedPose) for each in (first, second)]
        if not any(posed) or (all(posed) and self._together(start, goal)):
            return float(np.linalg.norm(self._point(first) - self._point(second)))
        ends = self._extent(start.stop, first), self._extent(goal.stop, second)
        return ends[0].distance(ends[1])

    def _point(self, target: Single, offset: Array | None = None) -> Array:
        """Position (3,) [m] of the TCP: in the base frame of joint positions, else in the world.

        With an `offset` (3,) [m], it is that of a point fixed to the TCP.
        """
        if isinstance(target, ConeOrientedPose):
            return target.position
        T = target.T if isinstance(target, Pose) else tcp_pose(self.cycle.arm, target)
        return np.asarray(T[:3, 3] if offset is None else T[:3, :3] @ offset + T[:3, 3])

    def _extent(self, stop: str, target: Single, offset: Array | None = None) -> Extent:
        """Box of the point of `_point`."""
        point = self._point(target, offset)
        if isinstance(target, Pose | ConeOrientedPose):
            return self.extents.of_stop(stop, point)
        return self.extents.of_base(point)

    @cached_property
    def dwells(self) -> float:
        """Least energy of all dwells [J]."""
        return sum(least_dwell_cost(self.cycle, move) for move in self.cycle.moves)

    @cached_property
    def gain(self) -> float:
        """Least gain of potential energy over the cycle [J]."""
        cycle, gain = self.cycle, 0.0
        if not cycle.closed:
            # no two configurations differ by more than half a turn of every joint, but for turns
            empty = replace(cycle.arm, payload=Payload())
            gain -= np.pi * float(potential_rates(Plant(empty).model, cycle.arm.gravity).sum())
        moves = cycle.moves
        for first, last in _runs([move.arm.payload for move in moves], cycle.closed):
            payload = moves[first].arm.payload
            if payload.mass > 0:
                _, most = self._height(moves[first].start, payload)
                least, _ = self._height(moves[last].goal, payload)
                gain += payload.mass * (least - most)
        return gain

    def _height(self, place: str, payload: Payload) -> tuple[float, float]:
        """Least and greatest height of a payload at a place times gravity [m²/s²]."""
        spot, up = self.spots[place], -self.cycle.arm.gravity
        offset = (inverted(self.cycle.arm.T_flange_tcp) @ np.append(payload.com, 1.0))[:3]
        low, high = np.inf, -np.inf
        for target in members(spot.target):
            slack = spot.slack
            if isinstance(target, ConeOrientedPose):
                slack += float(np.linalg.norm(offset))
            least, most = self._extent(spot.stop, target, offset).along(up)
            low = min(low, least - slack * float(np.linalg.norm(up)))
            high = max(high, most + slack * float(np.linalg.norm(up)))
        return low, high


def angle_between(first: Pose, second: Pose) -> float:
    """Angle between the orientations of two poses [rad]."""
    cosine = (np.trace(first.T[:3, :3].T @ second.T[:3, :3]) - 1) / 2
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _runs(payloads: Sequence[Payload], closed: bool) -> list[tuple[int, int]]:
    """First and last move of every run of moves with the same payload.

    A closed cycle may begin within a run; one with a single payload has none.
    """
    count = len(payloads)
    starts = [
        k
        for k in range(count)
        if (k > 0 or closed) and not payloads[k].is_same_body(payloads[k - 1])
    ]
    if not closed:
        starts = [0, *starts]
    ends = [(each - 1) % count for each in starts[1:] + starts[:1]]
    return list(zip(starts, ends, strict=True))


def _moving_power(arm: Arm) -> float:
    """Power drawn at all times of a motion [W], less the deficit of the friction's knee."""
    law = arm.friction_law
    deficit = KNEE_DEFICIT * law.knee * float(law.coulomb.sum())
    return arm.base_power + float(arm.drives.inverter_constant.sum()) - deficit


def levers(arm: Arm) -> Array:
    """Greatest distance of the TCP from the axis of every joint, shape (nq,) [m]."""
    links = [*joint_placements(arm.robot.model)[1:], T_last_tcp(arm)]
    along = [float(np.linalg.norm(link[:3, 3])) for link in links]
    across = [float(np.hypot(link[0, 3], link[1, 3])) for link in links]
    return np.array([across[j] + sum(along[j + 1 :]) for j in range(len(links))])


def prices_of_travel(arm: Arm, power: float) -> tuple[Array, Array]:
    """Multipliers λ and κ of travel at a power of `power` [W], for every share that is tried.

    Returns:
        λ (k,) [J/m] and κ (k,) [J/rad]; -inf for a negative power, at which a longer move draws
        less.
    """
    law, v_max = arm.friction_law, arm.active_limits.v_max
    share = np.array(REGION_BOUND.shares)
    if power < 0:
        return np.full_like(share, -np.inf), np.zeros_like(share)
    weights = (1 - share)[:, None] * levers(arm) + share[:, None]
    steepest = (power / v_max + law.coulomb + law.loss_slope(v_max)).sum()
    low, high = np.zeros_like(share), steepest / weights.max(axis=1)
    for _ in range(REGION_BOUND.bisections):
        middle = (low + high) / 2
        holds = power + _least_power(law, middle[:, None] * weights, v_max) >= 0
        low, high = np.where(holds, middle, low), np.where(holds, high, middle)
    return low * (1 - share), low * share


def _least_power(law: FrictionLaw, weights: Array, v_max: Array) -> Array:
    """Lower bounds (k,) of Σ_j min_v (φ_j(v) - weights_j v) [W] over speeds from 0 to v_max (nq,).

    φ is convex: it lies above its tangent at the speed where the bisection ends.
    """
    low, high = np.zeros_like(weights), np.broadcast_to(v_max, weights.shape)
    for _ in range(REGION_BOUND.bisections):
        middle = (low + high) / 2
        falls = law.coulomb + law.loss_slope(middle) < weights
        low, high = np.where(falls, middle, low), np.where(falls, high, middle)
    v = (low + high) / 2
    value = v * (law.coulomb + law.curved * np.arcsinh(v / law.speed) + law.viscous * v)
    slope = law.coulomb + law.loss_slope(v) - weights
    least = np.minimum(-slope * v, slope * (v_max - v))
    return np.asarray((value - weights * v + np.minimum(least, 0.0)).sum(axis=-1))
