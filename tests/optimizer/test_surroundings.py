"""Surroundings: clearance of motions, constrained pairs and planned paths of an arm among
obstacles.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import Arm, Box, Obstacle, Scene, Sphere
from joulepath.models.robot import Array
from joulepath.optimizer.collision.clearance_proof import CLEARANCE_PROOF, proven_clearance
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.collision.planner.path_planner import Effort
from joulepath.optimizer.collision.planner.planning_result import PlanningEnd
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.motion.spline import sample
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.surroundings import CONTACT, Surroundings
from tests.optimizer.cells import LOADS, arm_in_cell, at, cell
from tests.optimizer.moves import ROBOT

START = np.array([-0.8, -1.4, 1.6, -1.7, -1.57, 0.0])
GOAL = START + np.array([1.6, 0.0, 0.0, 0.0, 0.0, 0.0])
MOTION = quintic_spline(START, GOAL, 1.0)
AMPLE = 60.0  # s: the seed and not the load of the machine determines the result


def wrist(q: Array) -> Array:
    """Position (3,) [m] of the third wrist joint."""
    return np.asarray(Surroundings(Arm(robot=ROBOT)).model.frames(q[None])[0, 6, :3, 3])


def with_post(offset: float) -> Surroundings:
    """A ball of 1 cm on the radius of the wrist half way through MOTION, `offset` [m] above it."""
    middle = wrist((START + GOAL) / 2) + np.array([0.0, 0.0, offset])
    return Surroundings(Arm(robot=ROBOT, scene=Scene([Obstacle("post", Sphere(0.01), at(middle))])))


def test_a_motion_that_stays_clear_violates_nothing() -> None:
    alone = Surroundings(Arm(robot=ROBOT))
    assert alone.model.least_distance(sample(MOTION, np.linspace(0, 1, 500))[0], 0.02) > 0
    assert alone.worst_violation(MOTION) is None
    assert alone.is_collision_free(sample(MOTION, np.linspace(0, 1, 500))[0])


def test_a_collision_is_named_with_its_time() -> None:
    found = with_post(0.0).worst_violation(MOTION)
    assert found is not None
    assert found.min_clearance == found.sampled < -0.01
    assert found.pair[0] == "post" and found.pair[1].startswith("wrist")
    # the motion passes the post half way; samples are 1/95 s apart
    assert found.time == pytest.approx(0.5, abs=0.05)


def test_a_motion_that_passes_closely_needs_its_proof() -> None:
    """All samples keep the margin; whether the motion is accepted depends on the proof alone."""
    near = with_post(0.19)
    proof = proven_clearance(near.model, MOTION)
    assert proof is not None and 0 < proof.min_clearance < proof.sampled
    assert near.worst_violation(MOTION) is None
    (post,) = near.arm.scene.obstacles
    # the proof ends at a bound no lower than the least sample less the gap: here the bound is below
    # zero
    margin = post.margin + proof.sampled - CLEARANCE_PROOF.gap / 4
    closer = Surroundings(replace(near.arm, scene=Scene([replace(post, margin=margin)])))
    assert closer.is_collision_free(sample(MOTION, np.linspace(0, 1, 500))[0])
    found = closer.worst_violation(MOTION)
    assert found is not None and found.min_clearance < 0 < found.sampled
    assert "post" in found.pair


def test_nothing_collides_if_collisions_are_not_checked() -> None:
    unchecked = Surroundings(replace(with_post(0.0).arm, collisions=False))
    q = sample(MOTION, np.linspace(0, 1, 500))[0]
    assert not with_post(0.0).is_collision_free(q) and with_post(0.0).is_near_contact(q)
    assert unchecked.worst_violation(MOTION) is None
    assert unchecked.is_collision_free(q) and not unchecked.is_near_contact(q)


def test_active_pairs_are_those_that_come_near() -> None:
    surroundings = with_post(0.0)
    active = surroundings.active_pairs(MOTION)
    q = sample(MOTION, np.linspace(0, 1, 500))[0]
    least = surroundings.model.signed_distances(q)[0].min(axis=0)
    # between two of the samples a joint at 1.9 rad/s moves a point 1 m away by less than 2 cm
    assert (
        set(np.flatnonzero(least < CONTACT.active_distance - 0.02))
        <= set(active.tolist())
        <= set(np.flatnonzero(least < CONTACT.active_distance))
    )
    constraints = surroundings.with_clearance(active)
    assert len(constraints.names) == len(active)


@pytest.mark.parametrize("seed", range(3))
def test_pairs_within_a_distance_are_those_that_come_so_near_anywhere(seed: int) -> None:
    model = CollisionModel(arm_in_cell(LOADS[seed], cell(seed)))
    rng, within = np.random.default_rng(seed), 0.1
    q = START + rng.uniform(-1.5, 1.5, (20, len(START)))
    expected = (model.signed_distances(q)[0] < within).any(axis=0)
    assert 0 < expected.sum() < len(expected)
    np.testing.assert_array_equal(model.pairs_within(model.frames(q), within), expected)


def behind_a_wall() -> Surroundings:
    """A wall across MOTION."""
    wall = Obstacle("wall", Box(np.array([0.4, 0.02, 1.0])), at([-0.6, 0.0, 0.3]))
    return Surroundings(Arm(robot=ROBOT, scene=Scene([wall])))


def test_paths_are_planned_once() -> None:
    surroundings = behind_a_wall()
    assert not surroundings.has_planned_paths(START, GOAL)
    planned = surroundings.planned_paths(START, GOAL, Deadline.after(AMPLE))
    assert planned.paths and surroundings.has_planned_paths(START, GOAL)
    assert not surroundings.has_planned_paths(GOAL, START)
    # after the deadline there is no time for planning
    again = surroundings.planned_paths(START, GOAL, Deadline.after(-1.0))
    assert [path.tolist() for path in again.paths] == [path.tolist() for path in planned.paths]


def test_a_planning_that_the_deadline_ended_is_not_kept() -> None:
    surroundings = behind_a_wall()
    assert (
        surroundings.planned_paths(START, GOAL, Deadline.after(-1.0)).end is PlanningEnd.CUT_SHORT
    )
    assert surroundings.planned_paths(START, GOAL, Deadline.after(AMPLE)).paths


def test_a_planning_that_ran_out_of_states_is_kept_until_more_are_allowed() -> None:
    surroundings, few = behind_a_wall(), 1
    first = surroundings.planned_paths(START, GOAL, Deadline.after(AMPLE), effort=Effort(few))
    assert first.end is PlanningEnd.EXHAUSTED and not first.paths
    assert (
        surroundings.planned_paths(START, GOAL, Deadline.after(AMPLE), effort=Effort(few)) is first
    )
    assert surroundings.planned_paths(START, GOAL, Deadline.after(AMPLE)).paths


def test_a_path_to_another_goal_is_kept_for_that_goal() -> None:
    """The first goal is within the wall."""
    surroundings = behind_a_wall()
    within = next(
        q for q in np.linspace(START, GOAL, 50) if not surroundings.is_collision_free(q[None])
    )
    planned = surroundings.planned_paths(START, within, Deadline.after(AMPLE), [GOAL])
    assert planned.paths and not planned.ending_at(within)
    assert all((path[-1] == GOAL).all() for path in planned.paths)
    assert surroundings.has_planned_paths(START, GOAL) and not surroundings.has_planned_paths(
        START, within
    )


def test_a_planning_stands_for_all_goals_that_differ_by_full_turns() -> None:
    """Without a path, none is looked for again; with one, the next is found in fewer states."""
    surroundings, few = behind_a_wall(), 1
    turned = GOAL + 2 * np.pi * np.eye(6)[4]
    first = surroundings.planned_paths(START, GOAL, Deadline.after(AMPLE), effort=Effort(few))
    assert surroundings.seems_enclosed(START, turned) and not surroundings.has_planned_paths(
        START, turned
    )
    assert (
        surroundings.planned_paths(START, turned, Deadline.after(AMPLE), effort=Effort(few))
        is first
    )
    found = surroundings.planned_paths(START, GOAL, Deadline.after(AMPLE))
    assert found.paths and not surroundings.seems_enclosed(START, turned)
    (path,) = surroundings.planned_paths(START, turned, Deadline.after(AMPLE)).paths
    np.testing.assert_array_equal(path[[0, -1]], [START, turned])
    assert surroundings.has_planned_paths(START, turned) and not surroundings.seems_enclosed(
        GOAL, START
    )
