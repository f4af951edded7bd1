"""Cycles with passes: no worse than with stops, true to every pass, and above a valid bound."""

from __future__ import annotations

import importlib
from dataclasses import replace
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest

from joulepath import (
    AnyOf,
    Arm,
    Cycle,
    CycleSolution,
    DeadlineExceeded,
    FreeOrder,
    Line,
    Payload,
    Pose,
    Problem,
    Stop,
    plan_cycle,
)
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.passing_leg import PassingLeg
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.problem.cycle import CYCLE_RANGES
from joulepath.optimizer.search.run import Run
from tests.optimizer.cycle.cycles import HOME, PART, poses
from tests.optimizer.moves import AMPLE, ROBOT
from tests.optimizer.search.runs import prepared
from tests.refusals import refusal_of
from tests.selection import long_but

# the package has the function of this name
optimize_cycle_module = importlib.import_module("joulepath.optimizer.plan_cycle")

ROUNDING = 1e-9
# relative error of a motion's energy, from panels with a length in proportion to the motion
QUADRATURE = 2e-5
# relative difference of two solves of one motion, from different guesses and perhaps to different
# optima
GUESSES = 5e-4
ARM = Arm(robot=ROBOT, collisions=False)
Q = [
    HOME + np.array(each)
    for each in (
        [0.5, 0.2, -0.2, 0, 0.1, 0],
        [0.9, 0.1, -0.1, 0.2, 0, 0.3],
        [1.3, 0.3, -0.3, 0, 0, 0],
    )
]


def passing_cycle(seed: int, count: int, **given: Any) -> Cycle:
    """A cycle over poses with a stop at the last and passes at all others."""
    stops = [
        Stop(name=f"{k}", target=pose, via=k < count - 1)
        for k, pose in enumerate(poses(seed, count))
    ]
    return Cycle(
        **{"arm": ARM, "start": HOME, "stops": stops, "windings": False, "deadline": AMPLE} | given
    )


def of(*stops: Stop, **given: Any) -> Cycle:
    return Cycle(
        **{"arm": ARM, "start": HOME, "stops": stops, "windings": False, "deadline": AMPLE} | given
    )


def against(found: CycleSolution) -> dict[str, float]:
    """Relative differences to the energies of the baselines in their own times."""
    own = found.energy.electrical.total
    return {each.name: 1 - own / each.electrical for each in found.baselines}


@pytest.mark.long
@pytest.mark.parametrize("seed", long_but([0], range(6)))
def test_passing_is_never_worse_than_the_best_cycle_that_stops(seed: int) -> None:
    asked = passing_cycle(seed, 3)
    found = plan_cycle(asked)
    theirs = plan_cycle(replace(asked, stops=[replace(stop, via=False) for stop in asked.stops]))
    own = found.energy.electrical.total
    (stopping,) = (each for each in found.baselines if each.name == "stopping")
    assert stopping.electrical == pytest.approx(theirs.energy.electrical.total, rel=QUADRATURE)
    assert own <= stopping.electrical
    # the saving is one in equal times: the shorter cycle waits for the longer one
    assert stopping.saving is not None
    by_waiting = stopping.saving - (1 - own / stopping.electrical)
    assert by_waiting * (found.duration - stopping.duration) >= -ROUNDING
    assert found.lower_bound <= own and found.lower_bound <= theirs.lower_bound + ROUNDING
    assert found.order == ["0", "1", "2"] and found.joins < ROUNDING
    assert all(move.solution.certificate.valid for move in found.moves)
    assert own == pytest.approx(sum(move.energy for move in found.moves))


def test_every_pass_is_where_its_target_says_and_when_the_answer_says() -> None:
    asked = passing_cycle(3, 3)
    found = plan_cycle(asked)
    move = found.moves[0]
    assert [each.stop for each in move.passes] == ["0", "1"]
    assert 0 < move.passes[0].t < move.passes[1].t < move.solution.duration
    for stop, each in zip(asked.stops, move.passes, strict=False):
        q = move.solution.trajectory.spline.curve(each.t)
        assert np.abs(q - each.q).max() < ROUNDING
        assert isinstance(stop.target, Pose)
        assert np.abs(tcp_pose(ARM, q) - stop.target.T).max() < 1e-6
        assert np.abs(move.solution.trajectory.spline.curve(each.t, 1)).max() > 0.05


def test_the_best_of_all_configurations_is_found() -> None:
    """With two targets at two passes, the answer is the best of all combinations."""
    targets = [[q, q + np.array([0.3, -0.3, 0.3, 0, 0, 0])] for q in Q[:2]]
    stops = [
        Stop(name=f"{k}", target=AnyOf(tuple(each)), via=True) for k, each in enumerate(targets)
    ]
    found = plan_cycle(of(*stops, Stop(name="last", target=Q[2]), closed=False))
    energies = {
        (a, b): Run(
            Problem(
                arm=ARM,
                start=HOME,
                goal=Q[2],
                passes=[targets[0][a], targets[1][b]],
                deadline=AMPLE,
            )
        )
        .solution()
        .energy.electrical.total
        for a, b in product(range(2), repeat=2)
    }
    chosen = tuple(each.target for each in found.moves[0].passes)
    assert energies[chosen] <= min(energies.values()) * (1 + 1e-3)
    assert found.energy.electrical.total <= min(energies.values()) * (1 + 1e-3)
    assert found.lower_bound <= min(energies.values())


def test_routes_come_in_the_order_of_their_bounds_and_none_is_left_out() -> None:
    search = CycleSearch(passing_cycle(1, 3), clock=lambda: 0.0)
    leg = search.legs[0]
    assert isinstance(leg, PassingLeg)
    routes = list(leg.best_routes(0, 2))
    sizes = [range(len(layer.q)) for layer in leg.between]
    assert {route for _, route in routes} == set(product(*sizes))
    values = [bound for bound, _ in routes]
    assert values == sorted(values) and leg.least_costs[0, 2] == pytest.approx(values[0])
    for bound, route in routes[::7]:
        q = [leg.start.q[0], *leg.configurations(route), leg.goal.q[2]]
        run = prepared(Problem(arm=ARM, start=q[0], goal=q[-1], passes=q[1:-1], deadline=AMPLE))
        assert run.state.candidates[0].lower_bound == pytest.approx(bound)


@pytest.mark.long
def test_a_cycle_of_passes_alone_comes_back() -> None:
    found = plan_cycle(of(*(Stop(name=f"{k}", target=q, via=True) for k, q in enumerate(Q))))
    (move,) = found.moves
    assert len(move.passes) == 3 and found.order == ["0", "1", "2"] and found.status == "optimal"
    ends = move.solution.trajectory.spline.control_points[[0, -1]]
    assert np.abs(ends - HOME).max() < ROUNDING
    (stopping,) = (each for each in found.baselines if each.name == "stopping")
    assert found.energy.electrical.total < 0.97 * stopping.electrical


@pytest.mark.long
@pytest.mark.parametrize("factor", long_but([0.99], [1.25, 0.99]))
def test_in_a_given_time_it_is_not_worse_either(factor: float) -> None:
    stops = [Stop(name=f"{k}", target=q, via=k < 2, dwell=0.2 * (k == 2)) for k, q in enumerate(Q)]
    own = plan_cycle(of(*stops))
    time = factor * own.duration
    found = plan_cycle(of(*stops, duration_min=time, duration_max=time))
    assert found.duration == pytest.approx(time, rel=1e-9)
    assert all(move.solution.certificate.valid for move in found.moves)
    assert own.energy.electrical.total <= found.energy.electrical.total
    assert found.lower_bound <= found.energy.electrical.total
    if factor > 1:
        assert against(found)["stopping"] >= 0 and found.price_of_time < 0
    else:
        # the cycle with stops takes too long to compare
        assert "stopping" not in against(found) and found.price_of_time >= 0


def test_what_stops_is_the_answer_where_the_search_ends_too_early(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """If the search ends too early, the answer is the cycle with stops.

    Its motions have the certificates of a passing cycle, and its saving over `stopping` is zero.
    """

    def ended(search: CycleSearch) -> Any:
        if search.cycle.has_passes:
            raise DeadlineExceeded([])
        return searched(search)

    searched = optimize_cycle_module._best_of
    monkeypatch.setattr(optimize_cycle_module, "_best_of", ended)
    found = plan_cycle(of(*(Stop(name=f"{k}", target=q, via=k < 2) for k, q in enumerate(Q))))
    assert found.status == "feasible" and against(found)["stopping"] == pytest.approx(0, abs=1e-12)
    assert [len(move.passes) for move in found.moves] == [2, 0]
    assert all(move.solution.certificate.valid for move in found.moves)
    assert found.lower_bound <= found.energy.electrical.total
    assert [each.t for each in found.moves[0].passes] == sorted(
        each.t for each in found.moves[0].passes
    )


def test_limits_of_a_pass_hold_for_the_whole_motion_and_nothing_else() -> None:
    slow = replace(ROBOT.limits, v_max=np.full(6, 0.5))
    stops = [
        Stop(name="slowly", target=Q[0], via=True, limits=slow),
        Stop(name="last", target=Q[1]),
    ]
    asked = of(*stops)
    first, back = asked.moves
    assert (first.arm.active_limits.v_max == 0.5).all() and (
        back.arm.active_limits.v_max > 0.5
    ).all()
    stopping = replace(asked, rests_at_passes=True).moves
    assert [(move.start, move.goal) for move in stopping] == [
        ("start", "slowly"),
        ("slowly", "last"),
        ("last", "start"),
    ]
    assert all((move.arm.active_limits.v_max == 0.5).all() for move in stopping[:2])
    found = plan_cycle(asked)
    assert (
        np.abs(found.moves[0].solution.trajectory.v).max() <= 0.5
        and against(found)["stopping"] >= 0
    )


LINE = Line(direction=np.array([0.0, 0.0, 1.0]), distance=0.05)


@pytest.mark.parametrize(
    ("field", "given", "round_"),
    [
        ("stops.0.dwell", {"dwell": 0.1}, {}),
        ("stops.0.payload", {"payload": PART}, {}),
        ("stops.0.payload", {"payload": Payload()}, {}),
        ("stops.0.approach", {"approach": LINE}, {}),
        ("stops.0.retreat", {"retreat": LINE}, {}),
        ("stops.0.via", {}, {"order": FreeOrder()}),
        ("stops.1.via", {"via": False}, {"closed": False}),
        ("wait", {}, {"wait": "0", "duration_min": 20.0}),
    ],
)
def test_what_does_not_fit_a_pass_is_refused(
    field: str, given: dict[str, Any], round_: dict[str, Any]
) -> None:
    stops = [
        Stop(**{"name": "0", "target": Q[0], "via": True} | given),
        Stop(name="1", target=Q[1], via=True),
    ]
    with refusal_of(field):
        of(*stops, **round_)


def test_a_motion_has_a_dozen_passes_at_most() -> None:
    many = [Stop(name=f"{k}", target=Q[k % 3], via=True) for k in range(CYCLE_RANGES.max_passes)]
    of(
        *many,
        Stop(name="rest", target=Q[0]),
        *(replace(stop, name=f"again {stop.name}") for stop in many),
    )
    with refusal_of(f"stops.{CYCLE_RANGES.max_passes}.via"):
        of(*many, Stop(name="one more", target=Q[0], via=True))


@pytest.mark.long
def test_passes_at_the_same_place_are_one() -> None:
    """Repeated passes at one place, at the start or at the goal, cost nothing."""
    places = [HOME, Q[0], Q[0], Q[1]]
    stops = [Stop(name=f"{k}", target=q, via=True) for k, q in enumerate(places)]
    found = plan_cycle(of(*stops, Stop(name="rest", target=Q[1]), closed=False))
    assert [each.stop for each in found.moves[0].passes] == ["0", "1", "2", "3"]
    assert found.status == "optimal" and found.moves[0].solution.certificate.valid
    plain = plan_cycle(
        of(Stop(name="1", target=Q[0], via=True), Stop(name="rest", target=Q[1]), closed=False)
    )
    assert found.energy.electrical.total == pytest.approx(
        plain.energy.electrical.total, rel=GUESSES
    )


def test_a_pass_carries_what_its_motion_carries() -> None:
    stops = [
        Stop(name="pick", target=Q[0], payload=PART),
        Stop(name="by", target=Q[1], via=True),
        Stop(name="place", target=Q[2], payload=Payload()),
    ]
    found = plan_cycle(of(*stops))
    assert [move.planned.arm.payload.mass for move in found.moves] == [0.0, PART.mass, 0.0]
    assert [[each.stop for each in move.passes] for move in found.moves] == [[], ["by"], []]
    starts = [move.t0 for move in found.moves]
    assert all(b > a for a, b in pairwise(starts))
