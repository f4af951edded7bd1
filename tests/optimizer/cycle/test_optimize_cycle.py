"""Cycles: the best of all chains, certified, and at least as good as a choice move by move."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest

from joulepath import (
    AnyOf,
    Arm,
    Box,
    BranchFilter,
    ConeOrientedPose,
    Cycle,
    CycleSolution,
    DeadlineExceeded,
    NoSequence,
    Obstacle,
    OutsideLimits,
    Payload,
    Pose,
    Problem,
    Scene,
    Stop,
    StopInCollision,
    UnreachablePose,
    load_robot,
    optimize,
    plan_cycle,
)
from joulepath.models.robot import Array
from joulepath.optimizer.cycle.stop_layers import layers_of
from joulepath.optimizer.dynamics.dwell import holding_power
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.tcp import tcp_pose
from tests.optimizer.clocks import CountingClock
from tests.optimizer.cycle.cycles import HOME, pick_and_place, poses
from tests.optimizer.moves import AMPLE, ROBOT, torques
from tests.refusals import refusal_of
from tests.selection import long_but

# relative: sums of the same numbers in another order
ROUNDING = 1e-9
# relative difference of two optima, from the search's rough motion and from scratch
CONVERGED = 2e-3


def assert_true(asked: Cycle, found: CycleSolution) -> None:
    """Check the promises of every cycle."""
    assert all(move.solution.certificate.valid for move in found.moves)
    assert found.joins < 1e-9
    electrical = found.energy.electrical
    own = sum(
        move.solution.energy.electrical.total + move.dwell_energy + move.wait_energy
        for move in found.moves
    )
    assert electrical.total == pytest.approx(own, rel=ROUNDING)
    assert electrical.parts_sum == pytest.approx(electrical.total, rel=1e-3)
    assert found.lower_bound <= electrical.total
    assert found.duration == pytest.approx(found.moves[-1].t0 + found.moves[-1].duration)
    places = [(move.planned.start, move.planned.goal) for move in found.moves]
    names = [
        "start",
        *(place for stop in asked.stops for place in stop.places),
        *(["start"] if asked.closed else []),
    ]
    assert places == list(pairwise(names))
    if asked.closed:
        assert (found.moves[-1].solution.goal.q == found.moves[0].solution.start.q).all()
    for baseline in found.baselines:
        if baseline.within_limits:
            assert electrical.total <= baseline.electrical * (1 + ROUNDING)


def planned(asked: Cycle) -> CycleSolution:
    """The answer to a cycle, after a check of all promises."""
    found = plan_cycle(asked)
    assert_true(asked, found)
    return found


def energy_of(asked: Cycle, k: int, start: Array, goal: Array) -> float:
    """Energy [J] of move k between joint positions, by `optimize`."""
    problem = Problem(arm=asked.arms[k], start=start, goal=goal, windings=False, deadline=AMPLE)
    return optimize(problem).energy.electrical.total


@pytest.mark.parametrize("seed", long_but(range(1), range(100)))
def test_it_is_the_least_of_all_chains(seed: int) -> None:
    """The answer is the best of all chains, with every chain solved by `optimize`.

    The cycles have two or three stops with two or three branches.
    """
    asked = pick_and_place(seed, 2 + seed % 2, windings=False)
    only = BranchFilter(elbow="up", wrist="no_flip" if seed % 2 else None)
    asked = replace(asked, stops=[replace(stop, branch=only, dwell=0.0) for stop in asked.stops])
    found = planned(asked)
    layers = [layer.q for layer in list(layers_of(asked).values())]
    goals = [*layers[1:], layers[0]]
    known = {
        (k, a, b): energy_of(asked, k, layers[k][a], goals[k][b])
        for k in range(len(layers))
        for a, b in product(range(len(layers[k])), range(len(goals[k])))
    }
    best = min(
        sum(
            known[k, a, b]
            for k, (a, b) in enumerate(zip(chain, [*chain[1:], chain[0]], strict=True))
        )
        for chain in product(*(range(len(layer)) for layer in layers))
    )
    assert found.status == "optimal"
    assert found.energy.electrical.total == pytest.approx(best, rel=CONVERGED)
    assert found.lower_bound <= best


@pytest.mark.parametrize(
    ("seed", "count"), long_but([(1, 3)], [(1, 3), *((seed, 6) for seed in range(20))])
)
def test_cycles_are_true_and_not_above_move_by_move(seed: int, count: int) -> None:
    asked = pick_and_place(seed, count)
    found = planned(asked)
    assert found.status == "optimal"
    names = {"move_by_move", "controller_default", "ruckig_slowed", "straight"}
    assert {each.name for each in found.baselines} == names
    (greedy,) = (each for each in found.baselines if each.name == "move_by_move")
    own = found.energy.electrical.total
    assert greedy.electrical >= own * (1 - ROUNDING)
    for each in found.baselines:
        assert (each.saving is None) == (not each.within_limits)
        if each.saving is not None and each.duration == found.duration:
            assert each.saving == pytest.approx(1 - own / each.electrical, abs=ROUNDING)
    # the same configurations and times, by the motions of the answers of its moves
    rests = sum(move.dwell_energy + move.wait_energy for move in found.moves)
    for name in ("ruckig_slowed", "straight"):
        (whole,) = (each for each in found.baselines if each.name == name)
        parts = [
            each for move in found.moves for each in move.solution.baselines if each.name == name
        ]
        assert whole.duration == found.duration
        assert whole.electrical == pytest.approx(
            rests + sum(each.electrical for each in parts), rel=ROUNDING
        )
        named = zip(found.moves, parts, strict=True)
        assert [(each.start, each.goal, each.reason) for each in whole.broken] == [
            (move.planned.start, move.planned.goal, part.reason)
            for move, part in named
            if part.reason is not None
        ]
        assert whole.within_limits == (not whole.broken)


@pytest.mark.long
@pytest.mark.parametrize(
    "start",
    [
        pytest.param(HOME, id="joint positions"),
        pytest.param(poses(1, 4)[3], id="pose", marks=pytest.mark.long),
    ],
)
def test_move_by_move_is_what_successive_calls_of_optimize_give(start: Array | Pose) -> None:
    """The move-by-move baseline equals successive calls of `optimize`.

    From a pose, the first call also chooses the best configuration at the start for its own move.
    """
    asked = pick_and_place(1, 3, start=start)
    found = plan_cycle(asked)
    q, total, visited = start, 0.0, list[Array]()
    for k, stop in enumerate(asked.stops):
        move = optimize(Problem(arm=asked.arms[k], start=q, goal=stop.target, deadline=AMPLE))
        visited += [move.start.q] * (k == 0) + [move.goal.q]
        q, total = move.goal.q, total + move.energy.electrical.total
    total += energy_of(asked, len(asked.stops), visited[-1], visited[0])
    total += sum(move.dwell_energy for move in found.moves)
    (greedy,) = (each for each in found.baselines if each.name == "move_by_move")
    assert greedy.electrical == pytest.approx(
        total, rel=0.01
    )  # either may take the other of two equal moves
    # the shorter cycle waits at its cheapest stop until the end of the longer one
    wait = greedy.duration - found.duration
    powers = [
        float(holding_power(arm, Plant(arm).torques(q[None], *np.zeros((2, 1, len(q))))[0]))
        for q, arm in (
            (move.solution.goal.q, move.planned.arm_after)
            for move in found.moves
            if move.planned.at_stop
        )
    ]
    ours, theirs = found.energy.electrical.total, greedy.electrical
    ours, theirs = ours + max(wait, 0.0) * min(powers), theirs + max(-wait, 0.0) * min(powers)
    assert greedy.saving == pytest.approx(1 - ours / theirs, abs=ROUNDING)


def test_the_part_is_carried_where_it_is_and_held_while_the_arm_dwells() -> None:
    asked = pick_and_place(2, 2, windings=False)
    found = plan_cycle(asked)
    assert [move.planned.arm.payload.mass for move in found.moves] == [0.0, 2.0, 0.0]
    for k, move in enumerate(found.moves[:-1]):
        loaded = Problem(arm=asked.arms[k + 1], start=HOME, goal=HOME)
        q, still = move.solution.goal.q[None], np.zeros((1, 6))
        hold = float(holding_power(loaded.arm, torques(loaded, q, still, still))[0])
        assert move.dwell_energy == pytest.approx(0.3 * hold, rel=ROUNDING)
    braked = plan_cycle(replace(asked, hold="brakes", brake_delay=0.1, brake_power=5.0))
    for with_motors, with_brakes in zip(found.moves[:-1], braked.moves[:-1], strict=True):
        assert with_brakes.dwell_energy == pytest.approx(
            with_motors.dwell_energy / 3 + 5.0 * 0.2, rel=ROUNDING
        )


@pytest.mark.long
@pytest.mark.parametrize("others", [8])
def test_a_redundant_arm_goes_round_with_a_bound_that_covers_all_postures(others: int) -> None:
    """The bound of a redundant arm covers all postures, not just the sampled ones.

    The answer is never `optimal`, and fixed postures need more than the bound.
    """
    robot = load_robot("panda")
    q = np.array([[0.3, -0.4, 0.2, -2.0, 0.1, 1.8, 0.5], [-0.6, 0.2, 0.1, -1.7, -0.2, 2.0, 0.9]])
    arm = Arm(robot=robot, collisions=False)
    stops = [
        Stop(name="a", target=Pose(tcp_pose(arm, q[0]))),
        Stop(name="b", target=Pose(tcp_pose(arm, q[1]))),
    ]
    asked = Cycle(arm=arm, start=q[0] * 0.9, stops=stops, deadline=AMPLE)
    found = planned(asked)
    assert found.status == "feasible"
    assert found.lower_bound > 0.3 * found.energy.electrical.total
    rng, layers = np.random.default_rng(5), list(layers_of(asked).values())[1:]
    postures = [q, *([_member(layer.ends, rng) for layer in layers] for _ in range(others))]
    for chosen in postures:
        given = replace(
            asked,
            stops=[replace(stop, target=each) for stop, each in zip(stops, chosen, strict=True)],
        )
        assert found.lower_bound <= plan_cycle(given).energy.electrical.total


def _member(ends: list[EndConfiguration], rng: np.random.Generator) -> Array:
    """A random member of the self-motions within the limits."""
    limits = load_robot("panda").limits
    while True:
        curve = ends[rng.integers(len(ends))].self_motion
        assert curve is not None
        lower, upper = curve.arcs[rng.integers(len(curve.arcs))]
        q = curve.at(np.array([rng.uniform(lower, upper)]))[0]
        if (limits.q_min <= q).all() and (q <= limits.q_max).all():
            return q


@pytest.mark.parametrize("readings", long_but([40, 1000], [40, 200, 1000, 4000]))
def test_a_deadline_gives_the_best_cycle_so_far_or_says_so(readings: int) -> None:
    """At a deadline, the result is the best certified cycle so far, or a clear refusal.

    A clock with counted readings passes the deadline at many points of the search.
    """
    asked = replace(pick_and_place(1, 3, windings=False), deadline=float(readings))
    try:
        found = plan_cycle(asked, clock=CountingClock())
    except DeadlineExceeded:
        return
    assert_true(asked, found)


def test_what_is_wrong_names_the_stop() -> None:
    arm = Arm(robot=ROBOT)
    far = Pose.from_rotation([1.5, 0.0, 0.2], np.eye(3))
    asked = pick_and_place(1, 2)
    with pytest.raises(UnreachablePose) as unreachable:
        plan_cycle(replace(asked, stops=[asked.stops[0], Stop(name="far", target=far)]))
    assert unreachable.value.target == "stops/far"
    place = np.eye(4)
    place[:3, 3] = poses(1, 1)[0].T[:3, 3]
    wall = Obstacle(name="wall", shape=Box(np.full(3, 0.2)), T_base_shape=place)
    blocked = replace(arm, scene=Scene((wall,)))
    with pytest.raises(StopInCollision) as collision:
        plan_cycle(replace(asked, arm=blocked))
    assert collision.value.target == "stops/stop 0" and "stops/stop 0 is in collision" in str(
        collision.value
    )


def test_stops_that_no_chain_connects_are_named() -> None:
    """The error names the stops without a connecting chain.

    Without windings, no motion leads from one range of a joint to another a full turn away.
    """
    narrow = replace(ROBOT.limits, v_max=np.full(6, 1e-2))
    arm = Arm(robot=ROBOT, collisions=False, limits=narrow)
    stops = [Stop(name="away", target=HOME + np.array([6.1, 0, 0, 0, 0, 0]))]
    with pytest.raises(NoSequence) as refusal:
        plan_cycle(Cycle(arm=arm, start=HOME, stops=stops, deadline=AMPLE))
    assert refusal.value.stop == "stops/away" and refusal.value.reached and refusal.value.open


WRONG: dict[str, tuple[str, dict[str, Any]]] = {
    "no stops": ("stops", {"stops": []}),
    "too many stops": ("stops", {"stops": [Stop(name=str(k), target=HOME) for k in range(257)]}),
    "name twice": (
        "stops.1.name",
        {"stops": [Stop(name="a", target=HOME), Stop(name="A ", target=HOME)]},
    ),
    "name of the start": ("stops.0.name", {"stops": [Stop(name="start", target=HOME)]}),
    "no name": ("stops.0.name", {"stops": [Stop(name="", target=HOME)]}),
    "dwell": ("stops.0.dwell", {"stops": [Stop(name="a", target=HOME, dwell=-1.0)]}),
    "dwell nan": ("stops.0.dwell", {"stops": [Stop(name="a", target=HOME, dwell=np.nan)]}),
    "heavy": (
        "stops.0.payload.mass",
        {"stops": [Stop(name="a", target=HOME, payload=Payload(mass=6.0))]},
    ),
    "joints": ("stops.0.target.q", {"stops": [Stop(name="a", target=np.zeros(5))]}),
    "free start": ("start", {"start": ConeOrientedPose(np.array([0.4, 0.0, 0.3]))}),
    "free among several": (
        "stops.0.target",
        {
            "stops": [
                Stop(name="a", target=AnyOf((ConeOrientedPose(np.array([0.4, 0.0, 0.3])), HOME)))
            ]
        },
    ),
    "hold": ("hold.brake_delay", {"brake_delay": -1.0}),
    "deadline": ("deadline", {"deadline": 0.0}),
}


@pytest.mark.parametrize(("field", "given"), WRONG.values(), ids=WRONG)
def test_a_wrong_cycle_names_its_field(field: str, given: dict[str, Any]) -> None:
    with refusal_of(field):
        replace(pick_and_place(1, 2), **given)


def test_joint_positions_out_of_range_name_the_stop_and_the_joint() -> None:
    with pytest.raises(OutsideLimits) as refusal:
        replace(pick_and_place(1, 2), stops=[Stop(name="a", target=HOME + 7.0)])
    assert refusal.value.target == "stops.0.target" and refusal.value.joint == ROBOT.joint_names[0]


def test_moves_into_a_stop_keep_its_limits() -> None:
    asked = pick_and_place(1, 2, windings=False)
    slow = replace(ROBOT.limits, v_max=np.full(6, 0.8), a_max=ROBOT.limits.a_max / 2)
    stops = [replace(asked.stops[0], limits=slow, tcp_speed=0.3), asked.stops[1]]
    limited = replace(asked, stops=stops)
    found, free = plan_cycle(limited), plan_cycle(asked)
    assert_true(limited, found)
    into, onward = (move.solution.trajectory for move in found.moves[:2])
    assert np.abs(into.v).max() <= 0.8 * (1 + 1e-6) < np.abs(onward.v).max()
    assert found.moves[0].solution.certificate.worst_ratio["tcp_speed"] <= 1 + 1e-6
    assert found.energy.electrical.total >= free.energy.electrical.total * (1 - CONVERGED)


@pytest.mark.parametrize(
    ("given", "field"),
    [
        (
            {"limits": replace(ROBOT.limits, v_max=10 * ROBOT.limits.v_max)},
            "stops.0.limits.velocity",
        ),
        ({"tcp_speed": -1.0}, "stops.0.limits.tcp_speed"),
        ({"elbow_speed": np.nan}, "stops.0.limits.elbow_speed"),
    ],
    ids=["too fast", "backwards", "none"],
)
def test_wrong_limits_of_a_stop_name_their_field(given: dict[str, Any], field: str) -> None:
    asked = pick_and_place(1, 1)
    with refusal_of(field):
        replace(asked, stops=[replace(asked.stops[0], **given)])
