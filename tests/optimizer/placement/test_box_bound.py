"""The lower bound over boxes of places, attacked by configurations and cycles at random places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from joulepath import (
    AnyOf,
    Arm,
    ConeOrientedPose,
    Cycle,
    Group,
    JoulepathError,
    Moved,
    Places,
    Pose,
    Region,
    Robot,
    WeightedCycle,
    load_robot,
    plan_cycle,
)
from joulepath.optimizer.deadline import NEVER, Deadline
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.covers.pose_cells import URPoseCells, pose_cells_of
from joulepath.optimizer.kinematics.six.ur_closed_form import URClosedForm
from joulepath.optimizer.kinematics.tcp import flange_pose
from joulepath.optimizer.placement.box_bound import _CycleBoxes, _PlaceBoxBound, box_bound
from joulepath.optimizer.placement.extents import Extents
from joulepath.optimizer.placement.place_solver import PLACE_SOLVER
from joulepath.optimizer.placement.placement import Placement
from joulepath.optimizer.placement.space import Space
from tests.optimizer.kinematics.axis_patterns import redrawn, robot_of, shifted
from tests.optimizer.placement.cells import at, down, two_stops
from tests.selection import long_but

ROUNDING = 1e-9
TILTED = at(0.1, 0.0, 0.1, Rotation.from_euler("xyz", [0.4, -0.3, 0.9]).as_matrix())
TOOL = at(0.05, -0.08, 0.15, Rotation.from_euler("xyz", [0.5, 0.2, -0.4]).as_matrix())
ALL = Group(stops=("start", "pick", "place"))
PICK = Group(stops=("pick",))
REGIONS: dict[str, list[Moved]] = {
    "shifted": [Moved(Region(x=(-0.2, 0.1), y=(-0.1, 0.2), z=(-0.2, 0.2)))],
    "turned": [Moved(Region(x=(-0.1, 0.1), yaw=(-2.0, 2.0)))],
    "mounted": [Moved(Region(z=(-0.1, 0.6), yaw=(-0.3, 0.3), mounts=("floor", "wall", "ceiling")))],
    "group": [Moved(Region(x=(-0.1, 0.1), yaw=(-0.4, 0.4)), ALL)],
    "both": [Moved(Region(x=(-0.1, 0.1))), Moved(Region(z=(0.0, 0.2), yaw=(-0.2, 0.2)), PICK)],
    "listed": [Moved(Places([at(-0.1), at(0.0, 0.1, 0.1), TILTED]))],
}


def space_of(cycle: Cycle, moved: Sequence[Moved], **fields: Any) -> Space:
    return Space.of(Placement(cycles=[WeightedCycle(cycle)], moved=moved, **fields))


def robots() -> dict[str, Robot]:
    drawn = robot_of(redrawn(shifted(-0.05, 0.04), np.random.default_rng(8))[0])
    return {"ur5e": load_robot("ur5e"), "drawn": drawn}


@pytest.mark.parametrize("base", [np.eye(4), TILTED], ids=["upright", "tilted"])
@pytest.mark.parametrize("region", REGIONS)
@pytest.mark.parametrize("robot", long_but(["drawn"], ["ur5e", "drawn"]))
def test_every_configuration_is_in_a_box(robot: str, region: str, base: np.ndarray) -> None:
    """Every configuration is in a box, and its travel is covered.

    A yaw of an upright base turns the first joint equally at all stops.
    """
    if region == "mounted" and base is TILTED:
        pytest.skip("its mount is none of them")
    own_arm = Arm(robot=robots()[robot], T_flange_tcp=TOOL)
    space = space_of(two_stops(arm=own_arm), REGIONS[region], base=base)
    form = URClosedForm.of(own_arm.robot.model)
    assert form is not None
    cells = URPoseCells.of(form)
    boxes, rng, found = _CycleBoxes(space, cells, Extents(space), 0), np.random.default_rng(3), 0
    low, high = (np.array([getattr(each, end) for each in space.axes]) for end in ("low", "high"))
    for trial in range(30):
        half = (high - low) / 2 * rng.choice([1.0, 0.2, 0.02])
        centre = low + half + (high - low - 2 * half) * rng.random(len(half))
        choice = space.choices[trial % len(space.choices)]
        (seen,) = space.stops(space.place(choice, centre + half * rng.uniform(-1, 1, len(half))))
        middle = space.place(choice, centre)
        (own,) = space.stops(middle)
        before = None
        for name, (pose,) in boxes.targets.items():
            assert isinstance(pose, Pose)
            ends = boxes._ends(name, own[name][None], [middle], half[None])
            at_stop, off = ends.centre[0][ends.held[0]], ends.half[0][ends.held[0]]
            solutions, _ = form.solve(flange_pose(seen[name] @ pose.T, own_arm.T_flange_tcp))
            for q in solutions:
                away = np.abs(wrapped(q - at_stop)) - off
                inside = away[:, 1:].max(axis=1) <= ROUNDING
                assert inside.any()
                if before is not None:
                    q_before, at_before, off_before = before
                    apart = np.abs(wrapped(at_stop[inside, 0] - at_before)) - off[inside, 0]
                    travel = np.abs(wrapped(q[0] - q_before))
                    assert (apart - off_before <= travel + ROUNDING).any()
                found += 1
            if len(solutions):
                q = solutions[0]
                inside = (np.abs(wrapped(q - at_stop)) - off)[:, 1:].max(axis=1) <= ROUNDING
                nearest = np.abs(wrapped(q[0] - at_stop[inside, 0])).argmin()
                before = q[0], at_stop[inside, 0][nearest], off[inside, 0][nearest]
    assert found > 30


@pytest.mark.parametrize("robot", long_but(["kr10_r1100"], ["ur5e", "kr10_r1100"]))
@pytest.mark.parametrize("region", long_but(("listed",), REGIONS))
def test_no_cycle_needs_less_than_the_bound(region: str, robot: str) -> None:
    own_arm = Arm(robot=load_robot(robot))
    cycle = two_stops(
        arm=own_arm, with_baselines=False, unsolved_excess=PLACE_SOLVER.unsolved_excess
    )
    space, rng, found = space_of(cycle, REGIONS[region]), np.random.default_rng(1), 0
    bound = box_bound(space, NEVER)
    assert bound is not None
    low, high = (np.array([getattr(each, end) for each in space.axes]) for end in ("low", "high"))
    for trial in range(4):
        choice = space.choices[trial % len(space.choices)]
        (own,) = space.cycles(space.place(choice, rng.uniform(low, high)))
        try:
            energy = plan_cycle(own, progress=False).energy.electrical.total
        except JoulepathError:
            continue
        assert bound <= energy
        found += 1
    assert found


def test_splitting_never_lowers_it() -> None:
    space = space_of(two_stops(), REGIONS["both"])
    cells = pose_cells_of(space.placement.cycles[0].cycle.arm.robot.model)
    assert cells is not None
    boxes = _PlaceBoxBound(space, cells)
    parts = boxes.first()
    for _ in range(6):
        finer = boxes.divided(parts, np.arange(len(parts.value)))
        assert finer.value.min() >= parts.value.min()
        parts = finer


def test_weights_count() -> None:
    cycle = two_stops()
    bounds = [
        box_bound(
            Space.of(Placement(cycles=[WeightedCycle(cycle, w)], moved=REGIONS["listed"])), NEVER
        )
        for w in (1.0, 3.0)
    ]
    assert bounds[0] is not None and bounds[1] == pytest.approx(3 * bounds[0])


def test_none_is_known_for_other_arms_and_stops() -> None:
    free = ConeOrientedPose.about(down(0.5, 0.2, 0.2), np.array([0.0, 0.0, 1.0]))
    either = AnyOf((down(0.5, 0.0, 0.2), down(0.5, 0.1, 0.2)))
    stops = two_stops().stops
    for given, known in (
        (two_stops(arm=Arm(robot=load_robot("fr3"))), False),
        (two_stops(stops=[replace(stops[0], target=free), stops[1]]), False),
        (two_stops(stops=[stops[0], replace(stops[1], dwell=0.0, payload=None, via=True)]), False),
        (two_stops(stops=[replace(stops[0], target=either), stops[1]]), True),
        (two_stops(start=np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])), True),
        (two_stops(closed=False), True),
    ):
        bound = box_bound(space_of(given, REGIONS["shifted"]), Deadline.after(1.0))
        assert (bound is not None) == known
