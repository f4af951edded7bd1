"""Inverse kinematics of any seven-joint arm: the curves of configurations that hold a pose,
followed point by point.

Where the closed form of an arm nearby is known (`nearby_arm`), its curves are led onto those of the
arm, all points at once (`nearby_loops`). Next to a singularity they only give starts, and for other
arms a table of configurations inside the joint ranges does (`seed_table`). Newton's method leads
starts onto curves, and each curve is followed all around (`curve_tracing`). A curve that no start
leads to is missed, and so may be what passes a singularity: nothing here is `complete`.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import SingularPose
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.newton import solved
from joulepath.optimizer.kinematics.seven.curve_tracing import TracedPath, traced
from joulepath.optimizer.kinematics.seven.nearby_arm import NearbyArm
from joulepath.optimizer.kinematics.seven.nearby_loops import followed, spread_over
from joulepath.optimizer.kinematics.seven.seed_table import SeedTable
from joulepath.optimizer.kinematics.seven.traced_curve import TracedCurve
from joulepath.optimizer.kinematics.seven.traced_limits import within
from joulepath.optimizer.kinematics.seven.traced_stack import TracedStack
from joulepath.optimizer.problem.branches import BranchLabel, NumberedBranch

JOINTS = 7
# Newton steps of a start, and its error [m, rad] from which on it is on a curve; if none is, few
# starts get more steps
STEPS, SOLVED, FEW, MOST_STEPS = 12, 1e-9, 24, 60
# error [m, rad] of starts that came near and no further; so many of them have so many around them,
# so far away [rad]
NEARLY, NEAREST, AROUND, SPREAD = 1e-5, 8, 40, 0.1
# error [m, rad] after many steps of a pose at the edge of reach
ON_EDGE = 1e-6
# smallest singular value below which no curve is followed: configurations may go off in several
# directions
SINGULAR = 1e-4
# poses whose curves are kept
KEPT = 32


class TracedArm:
    """`ClosedForm` of an arm with one joint too many and without a closed form. It has no isolated
    configurations.
    """

    complete, confirmed = False, False

    def __init__(self, chain: Chain, seeds: SeedTable, nearby: NearbyArm | None) -> None:
        self._chain, self._seeds, self._nearby = chain, seeds, nearby
        self._found = lru_cache(maxsize=KEPT)(self._curves)

    @classmethod
    def of(cls, model: pin.Model) -> TracedArm | None:
        """The inverse kinematics of a Pinocchio model with a frame `flange`; None if it has not
        seven joints.
        """
        if model.nq != JOINTS:
            return None
        chain, q_min, q_max = (
            Chain.of(model),
            model.lowerPositionLimit.copy(),
            model.upperPositionLimit.copy(),
        )
        turns = q_max / 2 - q_min / 2 >= np.pi
        seeds = SeedTable(chain, np.where(turns, -np.pi, q_min), np.where(turns, np.pi, q_max))
        return cls(chain, seeds, NearbyArm.of(chain))

    def label(self, q: Array) -> NumberedBranch:
        """The number of the curve nearest to a configuration (7,) [rad] among those of its pose; 1
        if it has none.
        """
        try:
            curves = self.self_motions(self._chain.flange(q[None])[0])
        except SingularPose:
            return NumberedBranch(1)
        for number, each in enumerate(curves, start=1):
            if each.passes(q):
                return NumberedBranch(number)
        away = [
            float(np.abs(wrapped(each.at(np.array([each.parameter(q)]))[0] - q)).max())
            for each in curves
        ]
        return NumberedBranch(int(np.argmin(away)) + 1 if away else 1)

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """None: the branches have no parts."""
        return ()

    def solve(self, T: Array) -> tuple[Array, list[BranchLabel]]:
        """No configuration: all are on self-motions."""
        return np.zeros((0, JOINTS)), []

    def self_motions(self, T: Array, limits: Limits | None = None) -> list[TracedCurve]:
        """The curves that were found to hold the flange at T (4, 4), cut to the limits.

        Raises SingularPose if T was reached in singular configurations only, which no curve leads
        away from.
        """
        curves = self._found(np.ascontiguousarray(T, dtype=float).tobytes())
        return curves if limits is None else within(curves, limits.q_min, limits.q_max)

    def distance_to_reach(self, T: Array) -> None:
        """None: not known."""
        return

    def _with_near(self, q: Array, missed: Array, T: Array) -> tuple[Array, Array]:
        """The starts, and what is found around those that came near the pose T (4, 4), and not to
        it.

        Next to a singularity Newton's method is slow from most starts, but not from all.
        """
        near = q[np.argsort(np.where(missed < SOLVED, np.inf, missed))[:NEAREST]]
        near = near[: int(((missed >= SOLVED) & (missed < NEARLY)).sum())]
        around = near[:, None] + SPREAD * np.random.default_rng(0).normal(
            size=(len(near), AROUND, JOINTS)
        )
        found = solved(self._chain, around.reshape(-1, JOINTS), T, STEPS)
        return np.concatenate([q, found[0]]), np.concatenate([missed, found[1]])

    def _beside_nearby(self, T: Array) -> tuple[TracedStack, Array]:
        """The curves along those of the arm nearby with the flange at T (4, 4), and starts (n, 7)
        near the others.
        """
        none = np.zeros((0, JOINTS))
        if self._nearby is None:
            return TracedStack.of([]), none
        loops, rest = self._nearby.loops(T)
        stack, good = followed(self._chain, loops, T)
        if good.all() and not rest:
            return stack, none
        left = [
            each[:-1] for each, held in zip(loops.each(), good.tolist(), strict=True) if not held
        ]
        return stack, np.vstack([none, *map(spread_over, [*rest, *left])])

    def _beside(self, T: Array) -> list[Array]:
        """Starts (n, 7) of the arm nearby, beside the pose T (4, 4): the arm itself may reach a
        little further.
        """
        return (
            [] if self._nearby is None else [spread_over(each) for each in self._nearby.beside(T)]
        )

    def _curves(self, matrix: bytes) -> list[TracedCurve]:
        T = np.frombuffer(matrix).reshape(4, 4)
        checkpoint()
        stack, starts = self._beside_nearby(T)
        count = len(stack.first)
        if len(starts) or not count:
            stack = stack.joined(self._through(starts, T, count > 0))
        return self._different(stack, T)

    def _through(self, starts: Array, T: Array, others: bool) -> list[TracedPath]:
        """The curves with the flange at T (4, 4) that starts (n, 7) lead to, and if there are no
        others, those that the table's starts and those of the arm nearby beside T lead to."""
        q, missed = solved(self._chain, starts, T, STEPS)
        if not others and not (missed < SOLVED).any():
            starts = np.vstack([self._seeds.starts(T), *self._beside(T)])
            q, missed = solved(self._chain, starts, T, STEPS)
        q, missed = self._with_near(q, missed, T)
        if not others and not (missed < SOLVED).any():
            q, missed = solved(self._chain, starts[:FEW], T, MOST_STEPS)
        # what Newton's method nearly reaches after many steps is on a singularity
        q = q[missed < (SOLVED if others or (missed < SOLVED).any() else ON_EDGE)]
        smallest = np.linalg.svd(self._chain.flange_and_jacobian(q)[1], compute_uv=False)[:, -1]
        regular = smallest > SINGULAR
        if len(q) and not others and not regular.any():
            raise SingularPose("goal", float(smallest.min()))
        return traced(self._chain, q[regular], T)

    def _different(self, stack: TracedStack, T: Array) -> list[TracedCurve]:
        """The curves of a stack, in their order, each once."""
        if not len(stack.first):
            return []
        found = list[TracedCurve]()
        places, beside = stack.places_and_near()
        near = beside.tolist()
        for row in np.argsort(places, kind="stable").tolist():
            # where a curve bends, one start may pass another unseen
            if not any(
                near[row][each.row] and each.passes(stack.nodes[stack.first[row]]) for each in found
            ):
                half = float(stack.half[row])
                label = NumberedBranch(len(found) + 1)
                found.append(TracedCurve(self._chain, T, stack, row, label, [(-half, half)]))
        return found
