"""Arm with a spherical wrist: every configuration is found, next to each singularity and on it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import brentq

from joulepath import BranchFilter, SingularPose, UnreachablePose
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.joint_axes import JointAxes
from joulepath.optimizer.kinematics.six.decomposition import DecomposedArm
from joulepath.optimizer.kinematics.six.spherical_wrist import SphericalWrist
from tests.optimizer.kinematics.six_joints import ACCURACY, FOUND, KUKA, flange, inside, solved
from tests.selection import long_but

IK = required_inverse_kinematics(KUKA, "goal")
WRIST = SphericalWrist.of(JointAxes.of(Chain.of(KUKA.model))) or pytest.fail(
    "the arm has a spherical wrist"
)
# joint error of a pose rounded by 1e-16, times the smallest singular value; larger for the product
# of seven rounded matrices
ROUNDING = 4e-15
# distance from a fold at which both branches count as one [rad]
ON_A_FOLD = 5e-7


def stretched() -> float:
    """Third joint position [rad] with a stretched elbow."""
    return float(
        brentq(lambda q3: WRIST.measures(np.array([0, 0, q3, 0, 0, 0]))[1], -0.3, 0.3, xtol=1e-16)
    )


def overhead(q: Array) -> Array:
    """Configuration with the second joint moved until the wrist is on the first axis, if
    possible.
    """
    angles = np.linspace(-np.pi, np.pi, 60)
    ahead = [WRIST.measures(np.array([0, angle, q[2], 0, 0, 0]))[0] for angle in angles]
    crossing = next((k for k, (a, b) in enumerate(pairwise(ahead)) if a * b < 0), None)
    if crossing is None:
        return overhead(np.array([*q[:2], q[2] / 2, *q[3:]]))
    root = brentq(
        lambda q2: WRIST.measures(np.array([0, q2, q[2], 0, 0, 0]))[0],
        *angles[crossing : crossing + 2],
        xtol=1e-16,
    )
    return np.array([q[0], root, *q[2:]])


@pytest.mark.parametrize("count", long_but((300,), (300, 2_000)))
def test_every_configuration_is_found_once(count: int) -> None:
    rng = np.random.default_rng(7)
    for _ in range(count):
        found = solved(KUKA, inside(KUKA, rng))
        assert found.away < FOUND and found.error < ACCURACY and not found.twice
        assert len(found.branches) in (4, 8)
        assert len({str(each.label) for each in found.branches}) == len(found.branches)
    assert IK.complete


@pytest.mark.parametrize("off", [3e-5, 3e-4, 1.0])
def test_regular_poses_have_the_same_solutions_by_the_general_method(
    off: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The regular and the general method agree on both sides of the threshold between them."""
    rng, folded = np.random.default_rng(8), stretched()
    starts = [inside(KUKA, rng) for _ in range(30)]
    for k, q in enumerate(starts):
        q[(2, 4)[k % 2]] = (folded, 0.0)[k % 2] + off
    poses = [flange(KUKA, q) for q in starts]
    form = DecomposedArm.of(KUKA.model) or pytest.fail("the arm has a decomposition")
    short = [form.solve(T) for T in poses]
    assert [form._regular(form._simple.rows(T), T) is not None for T in poses].count(True) >= (
        15 if off > 1e-4 else 0
    )
    monkeypatch.setattr(DecomposedArm, "_regular", lambda *_: None)
    form = DecomposedArm.of(KUKA.model) or pytest.fail("the arm has a decomposition")
    for T, (q, labels) in zip(poses, short, strict=True):
        q_long, labels_long = form.solve(T)
        assert labels == labels_long
        # Rounding over the smallest singular value, about a tenth of the distance.
        assert np.abs(wrapped(q - q_long)).max() < 1e-13 + 1e-11 * 1e-3 / off


@pytest.mark.parametrize("off", [1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3])
def test_next_to_an_aligned_wrist(off: float) -> None:
    rng = np.random.default_rng(11)
    for side in (off, -off) * 20:
        q = inside(KUKA, rng)
        q[4] = side
        found = solved(KUKA, q)
        smallest = min(each.smallest_singular_value for each in found.branches)
        assert (
            found.away < max(1e-9, ROUNDING / smallest)
            and found.error < ACCURACY
            and not found.twice
        )
        assert all(each.self_motion is None for each in found.branches)


@pytest.mark.parametrize("off", [0.0, 1e-12, 1e-10])
def test_an_aligned_wrist_is_a_self_motion(off: float) -> None:
    rng = np.random.default_rng(12)
    for _ in range(20):
        q = inside(KUKA, rng)
        q[4] = off
        found = solved(KUKA, q)
        assert found.away < FOUND and found.error < ACCURACY and not found.twice
        motions = {
            id(each.self_motion): each.self_motion
            for each in found.branches
            if each.self_motion is not None
        }
        assert motions
        for motion in motions.values():
            assert motion.free == (3, 5)
            members = np.array([each.q for each in found.branches if each.self_motion is motion])
            apart = np.abs(wrapped(members[:, None] - members)).max(axis=2) + np.eye(len(members))
            assert apart.min() > 0.1, "a member is there twice"


def test_the_boxes_of_a_self_motion_hold_it() -> None:
    q = np.array([0.3, -1.2, 1.4, 0.5, 0.0, -0.4])
    motion = next(
        each.self_motion for each in IK.branches(flange(KUKA, q)) if each.self_motion is not None
    )
    rng = np.random.default_rng(13)
    parameter, half = rng.uniform(-np.pi, np.pi, 200), rng.uniform(0, 1, 200)
    centre, sides = motion.boxes(parameter, half)
    members = motion.at(np.clip(wrapped(parameter + rng.uniform(-1, 1, 200) * half), -np.pi, np.pi))
    assert (np.abs(wrapped(members - centre)) <= sides + 1e-12).all()
    # The boxes are no larger than necessary.
    assert np.abs(sides.max(axis=1) - half).max() < 1e-12


@pytest.mark.parametrize("off", [0.0, 1e-10, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3])
def test_next_to_a_stretched_elbow(off: float) -> None:
    rng, edge = np.random.default_rng(14), stretched()
    for side in (off, -off) * 20:
        q = inside(KUKA, rng)
        q[2] = edge + side
        found = solved(KUKA, q)
        assert found.away < FOUND and found.error < ACCURACY and not found.twice
        here = [each for each in found.branches if abs(each.q[2] - edge) < 2 * off + 1e-6]
        # Half of the branches meet: two wrists of one or two shoulders remain, or twice as many
        # next to the edge.
        assert len(here) in ((2, 4) if off < ON_A_FOLD else (4, 8))


@pytest.mark.parametrize("off", [1e-8, 1e-6, 1e-5, 1e-4, 1e-3])
def test_next_to_the_first_axis(off: float) -> None:
    rng = np.random.default_rng(15)
    for side in (off, -off) * 20:
        q = overhead(inside(KUKA, rng))
        q[1] += side
        found = solved(KUKA, q)
        assert found.away < max(1e-9, 1e-14 / off) and found.error < ACCURACY and not found.twice


def test_a_wrist_on_the_first_axis_is_refused() -> None:
    """A wrist on the first axis has a self-motion of unknown form and is refused.

    The first axis turns and the wrist compensates.
    """
    rng = np.random.default_rng(16)
    for _ in range(20):
        with pytest.raises(SingularPose, match="start"):
            IK.solve(flange(KUKA, overhead(inside(KUKA, rng))), target="start")


def test_a_label_changes_only_across_its_singularity() -> None:
    """Along random paths, labels change only at singularities.

    A change of the shoulder also changes the elbow.
    """
    rng = np.random.default_rng(17)
    changes = 0
    for _ in range(100):
        ends = np.array([inside(KUKA, rng), inside(KUKA, rng)])
        path = ends[0] + np.linspace(0, 1, 400)[:, None] * (ends[1] - ends[0])
        labels, measures = [IK.label(q) for q in path], np.array([WRIST.measures(q) for q in path])
        for k, (one, other) in enumerate(pairwise(labels)):
            shoulder, elbow, wrist = (measures[k : k + 2] < 0).T.tolist()
            assert (one.shoulder != other.shoulder) == (shoulder[0] != shoulder[1])
            assert (one.wrist != other.wrist) == (wrist[0] != wrist[1])
            assert (one.elbow != other.elbow) == (
                (shoulder[0] != shoulder[1]) != (elbow[0] != elbow[1])
            )
            changes += one != other
    assert changes > 100


def test_parts_of_the_label_are_where_the_jacobian_is_singular() -> None:
    """The determinant of the Jacobian is a constant times the product of the label measures."""
    rng, ratios = np.random.default_rng(18), []
    model, data = KUKA.model, KUKA.model.createData()
    for _ in range(50):
        q = inside(KUKA, rng)
        J = pin.computeFrameJacobian(model, data, q, model.getFrameId("flange"))
        ratios.append(abs(np.linalg.det(J) / np.prod(WRIST.measures(q))))
    # relative rounding of a determinant with a condition number up to 1e5
    assert np.ptp(ratios) < 1e-9 * np.mean(ratios)


def test_the_everyday_posture_has_the_everyday_names() -> None:
    """A forward reach with the elbow above the line from shoulder to wrist has the usual names."""
    q = np.array([0.2, -1.2, 1.6, 0.1, 0.6, 0.3])
    assert str(IK.label(q)).startswith("right/up")
    chosen = [
        each
        for each in IK.branches(flange(KUKA, q))
        if BranchFilter(elbow="up", shoulder="right").allows(each.label)
    ]
    assert len(chosen) == 2


def test_the_distance_out_of_reach_is_that_of_the_wrist() -> None:
    """The distance out of reach is the least shift towards the second axis to reach the pose."""
    T = np.eye(4)
    for position in ([1.6, 0.3, 0.5], [0.2, 0.1, 2.0], [-0.7, 0.9, -0.6]):
        T[:3, 3] = position
        with pytest.raises(UnreachablePose) as refusal:
            IK.solve(T)
        distance = refusal.value.distance
        assert distance is not None and distance > 0
        away = T[:3, :3] @ WRIST.wrist + T[:3, 3] - WRIST.origin
        forward = np.array([*away[:2], 0.0]) / max(np.linalg.norm(away[:2]), 1e-300)
        shoulder = WRIST.origin + WRIST.shoulder[0] * forward + WRIST.shoulder[1] * WRIST.up
        outward = away + WRIST.origin - shoulder
        outward *= np.sign(WRIST.upper[0] - np.linalg.norm(outward)) / np.linalg.norm(outward)
        for share, reached in ((0.999, False), (1.001, True)):
            moved = T.copy()
            moved[:3, 3] += share * distance * outward
            assert bool(IK.branches(moved)) == reached


@pytest.mark.parametrize("off", [1e-5, 1e-4])
@pytest.mark.parametrize("other", ["elbow", "shoulder"])
def test_next_to_two_singularities_solutions_are_as_accurate_as_the_pose(
    other: str, off: float
) -> None:
    """Near two singularities, solutions are as accurate as double precision of the pose allows.

    One of the singularities is a nearly aligned wrist.
    """
    rng, edge = np.random.default_rng(19), stretched()
    for _ in range(20):
        q = inside(KUKA, rng)
        if other == "shoulder":
            q = overhead(q)
            q[1] += off
        else:
            q[2] = edge + off
        q[4] = off
        J = pin.computeFrameJacobian(
            KUKA.model, KUKA.model.createData(), q, KUKA.model.getFrameId("flange")
        )
        found = solved(KUKA, q)
        assert found.error < ACCURACY and not found.twice
        assert found.away < max(FOUND, ROUNDING / np.linalg.svd(J, compute_uv=False)[-1])


@pytest.mark.parametrize("off", [0.0, 1e-9, 1e-7, 1e-6])
@pytest.mark.parametrize("parts", ["elbow wrist", "shoulder wrist", "elbow shoulder"])
def test_on_two_singularities_at_once_no_branch_is_lost_in_silence(parts: str, off: float) -> None:
    """At two singularities at once, the solver raises an error.

    The formulas for a single singularity lose branches there.
    """
    rng = np.random.default_rng(8)
    for _ in range(10):
        q = inside(KUKA, rng)
        if "elbow" in parts:
            q[2] = stretched() + off
        if "shoulder" in parts:
            q = overhead(q) + np.array([0, off, 0, 0, 0, 0])
        if "wrist" in parts:
            q[4] = off
        with pytest.raises(SingularPose):
            IK.branches(flange(KUKA, q))
