"""Self-motions projected from those of a nearby arm with a closed form, for Kinova's Gen3."""

from __future__ import annotations

import numpy as np

from joulepath.optimizer.kinematics.chain import Chain, pose_error, twist_size
from joulepath.optimizer.kinematics.newton import solved
from joulepath.optimizer.kinematics.seven.curve_tracing import trace
from joulepath.optimizer.kinematics.seven.nearby_arm import NearbyArm
from joulepath.optimizer.kinematics.seven.nearby_loops import SETTINGS, project_loops
from joulepath.optimizer.kinematics.seven.traced_arm import TracedArm
from joulepath.optimizer.kinematics.seven.traced_curve import TracedCurve
from joulepath.optimizer.problem.branches import NumberedBranch
from tests.optimizer.kinematics.six_joints import FOUND, flange, inside
from tests.optimizer.kinematics.traced import CHAIN, GEN3, PANDA, away

# configuration of an arm stretched beyond the reach of the simple arm; their axes differ by 0.35 mm
# [rad]
STRETCHED = np.array([-5.237985, 0.035838, 1.066330, -0.002736, -4.184650, -1.781755, -3.956364])
# smallest share of poses whose curves are all projected, without tracing
PROJECTED = 0.9


def test_curves_of_the_simple_arm_are_near_those_of_the_arm() -> None:
    """From its flange, the Gen3 has a spherical shoulder up to 0.35 mm, and so has a calibrated
    Panda from its base.
    """
    rng, panda = np.random.default_rng(57), PANDA.model.copy()
    panda.jointPlacements[6].translation += np.array([1e-4, 2e-4, -1e-4])
    for model, mirrored in ((GEN3.model, True), (panda, False)):
        chain = Chain.of(model)
        nearby = NearbyArm.of(chain)
        assert nearby is not None and nearby.mirrored == mirrored
        for q in rng.uniform(-1.5, 1.5, (5, 7)):
            T = chain.flange(q[None])[0]
            found, rest = nearby.loops(T)
            starts = np.vstack([found.points, *rest])
            assert len(starts) and twist_size(pose_error(chain.flange(starts), T)).max() < 2e-3
        found = TracedArm.of(model)
        assert found is not None and found.self_motions(T)
    assert NearbyArm.of(Chain.of(CHAIN.model)) is None


def test_projected_curves_are_those_traced_point_by_point() -> None:
    rng, chain = np.random.default_rng(59), Chain.of(GEN3.model)
    nearby, count = NearbyArm.of(chain), 0
    assert nearby is not None
    for _ in range(4):
        T = flange(GEN3, inside(GEN3, rng))
        stack, good = project_loops(chain, nearby.loops(T)[0], T)
        assert len(stack.first) == good.sum()
        for first, last in zip(stack.first, stack.last, strict=True):
            start, _ = solved(chain, stack.nodes[[first]], T)
            (other,) = trace(chain, start, T)
            curve = TracedCurve.of(chain, T, other, NumberedBranch(1))
            assert other.closed and all(
                away(curve, q) < SETTINGS.short_newton_step for q in stack.nodes[first : last + 1]
            )
            count += 1
    assert count > 15


def test_nearly_all_poses_have_enough_points_along_their_curves() -> None:
    """A pose with a curve traced step by step takes ten times as long; once, every seventh did."""
    rng, chain, count, poses = np.random.default_rng(61), Chain.of(GEN3.model), 0, 40
    nearby = NearbyArm.of(chain)
    assert nearby is not None
    for _ in range(poses):
        T = flange(GEN3, inside(GEN3, rng))
        loops, rest = nearby.loops(T)
        assert all(
            np.linalg.norm(np.diff(each, axis=0), axis=1).max() < 2 * SETTINGS.long_step
            for each in loops.each()
        )
        count += not rest and project_loops(chain, loops, T)[1].all()
    assert count >= PROJECTED * poses


def test_an_arm_stretched_beyond_the_reach_of_the_simple_arm_is_found() -> None:
    """The simple arm has no curve there, and the seeds of the table led to other curves."""
    arm, T = TracedArm.of(GEN3.model), flange(GEN3, STRETCHED)
    nearby = NearbyArm.of(Chain.of(GEN3.model))
    assert arm is not None and nearby is not None and nearby.beside(T)
    loops, rest = nearby.loops(T)
    assert not loops.counts and not rest
    assert min(away(each, STRETCHED) for each in arm.self_motions(T, GEN3.limits)) < FOUND
