"""The lower bound over a region, attacked: by cycles found at many places, and part by part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath import (
    Arm,
    Bus,
    Cycle,
    Group,
    JoulepathError,
    Moved,
    Payload,
    Places,
    Region,
    Stop,
    WeightedCycle,
    load_robot,
    plan_cycle,
)
from joulepath.optimizer.kinematics.tcp import tcp_jacobian
from joulepath.optimizer.placement.extents import Extents
from joulepath.optimizer.placement.placement import Placement
from joulepath.optimizer.placement.region_bound import levers, prices_of_travel, region_bound
from joulepath.optimizer.placement.space import Place, Space
from tests.optimizer.placement.cells import PART, arm, at, down, two_stops
from tests.selection import ROBOTS, long_but

ROUNDING = 1e-9
G = 9.81
MOVED = (
    Moved(Region(x=(-0.2, 0.2), z=(-0.1, 0.2), yaw=(-2.0, 2.0), mounts=("floor", "ceiling"))),
    Moved(Region(y=(-0.1, 0.2), yaw=(-0.3, 0.3)), Group(stops=("pick",))),
)


def space_of(*cycles: Cycle, moved: Sequence[Moved] = (Moved(Region(x=(-0.2, 0.2))),)) -> Space:
    return Space.of(Placement(cycles=[WeightedCycle(each) for each in cycles], moved=moved))


def random_places(space: Space, count: int) -> list[Place]:
    rng = np.random.default_rng(54)
    low, high = (np.array([getattr(axis, end) for axis in space.axes]) for end in ("low", "high"))
    choices = space.choices
    return [
        space.place(choices[rng.integers(len(choices))], rng.uniform(low, high))
        for _ in range(count)
    ]


def test_boxes_contain_their_points_at_all_places() -> None:
    space = space_of(two_stops(), moved=MOVED)
    extents, p = Extents(space), np.array([0.3, -0.4, 0.5])
    boxes = extents.of_base(p), extents.of_stop("pick", p), extents.of_stop("place", p)
    for place in random_places(space, 300):
        T, offset = space.base(place), place.poses[1]
        points = T[:3, :3] @ p + T[:3, 3], offset[:3, :3] @ p + offset[:3, 3], p
        for box, point in zip(boxes, points, strict=True):
            assert (box.low <= point + ROUNDING).all() and (point <= box.high + ROUNDING).all()


@pytest.mark.parametrize("name", ROBOTS)
def test_no_joint_moves_the_tool_by_more_than_its_lever(name: str) -> None:
    robot = load_robot(name)
    tool = at(0.03, -0.05, 0.2)
    own_arm = Arm(robot=robot, T_flange_tcp=tool)
    rng, reach = np.random.default_rng(1), levers(own_arm)
    for q in rng.uniform(robot.limits.q_min, robot.limits.q_max, (100, robot.nq)):
        columns = np.linalg.norm(tcp_jacobian(own_arm, q)[:3], axis=0)
        assert (columns <= reach + ROUNDING).all()


def test_the_price_of_travel_is_the_least_over_speeds_and_joints() -> None:
    """The price of travel is the least over a grid of speeds, for even motions of any joint."""
    own_arm = arm()
    law, v_max, power = own_arm.friction_law, own_arm.active_limits.v_max, 40.0
    weights = levers(own_arm)
    price = prices_of_travel(own_arm, power)[0][0]
    speeds = np.linspace(0.0, 1.0, 2001)[:, None] * v_max
    lost = speeds * (
        law.coulomb + law.curved * np.arcsinh(speeds / law.speed) + law.viscous * speeds
    )
    least = power + (lost - price * weights * speeds).min(axis=0).sum()
    # the grid misses the minimum by up to a step; the price is the greatest without a negative
    # minimum
    assert -ROUNDING <= least <= 0.05
    higher = power + (lost - 1.01 * price * weights * speeds).min(axis=0).sum()
    assert higher < 0


def test_mechanical_work_is_at_least_the_net_lift() -> None:
    """The work is at least the net lift from 0.1 m to 0.4 m; the empty way back lifts nothing."""
    stops = [
        Stop(name="pick", target=down(0.5, -0.3, 0.1), payload=PART),
        Stop(name="place", target=down(0.5, 0.3, 0.4), payload=Payload()),
    ]
    cycle = two_stops(stops=stops, objective="mechanical", duration_max=10.0)
    assert region_bound(space_of(cycle)) == pytest.approx(PART.mass * G * 0.3, rel=2e-3)


def test_a_part_that_is_lowered_gives_its_energy() -> None:
    def bound(z: float) -> float:
        stops = [
            Stop(name="pick", target=down(0.5, -0.3, 0.4 + z), payload=PART),
            Stop(name="place", target=down(0.5, 0.3, 0.4 - z), payload=Payload()),
        ]
        found = region_bound(space_of(two_stops(stops=stops)))
        assert found is not None
        return found

    assert bound(-0.1) > bound(0.0) > bound(0.1) >= 0


CYCLES: dict[str, dict[str, Any]] = {
    "free time": {},
    "fast": {"duration_max": 2.2},
    "slow": {"duration_min": 8.0},
    "brakes": {"duration_min": 8.0, "hold": "brakes", "brake_delay": 0.1},
    "open": {"closed": False},
    "home": {"start": np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])},
    "recuperating": {"arm": arm(bus=Bus("recuperating", efficiency=1.0))},
    "mechanical": {"objective": "mechanical", "duration_max": 3.0},
    "via": {
        "stops": [
            two_stops().stops[0],
            Stop(name="over", target=down(0.5, 0.0, 0.4), via=True),
            two_stops().stops[1],
        ]
    },
}


QUICK = ("open", "recuperating")


@pytest.mark.parametrize("name", long_but(QUICK, CYCLES))
def test_no_cycle_needs_less_than_the_bound(name: str) -> None:
    cycle = two_stops(**{"with_baselines": False} | CYCLES[name])
    moved = [Moved(Places([at(-0.1, 0.0, 0.1), at(0.05, 0.1, -0.1)]))]
    space = space_of(cycle, moved=moved)
    bound, found = region_bound(space), 0
    assert bound is not None
    for place in space.map():
        try:
            solution = plan_cycle(space.cycles(place)[0], progress=False)
        except JoulepathError:
            continue
        assert bound <= solution.energy.of(solution.objective)
        found += 1
    assert found


def test_the_bound_of_given_times_is_higher() -> None:
    free, fast, slow = (
        region_bound(space_of(two_stops(**given)))
        for given in ({}, {"duration_max": 0.3}, {"duration_min": 8.0})
    )
    assert free is not None and fast is not None and slow is not None
    assert fast > free and slow > free


def test_no_bound_is_known_for_friction_that_drives() -> None:
    own_arm = arm()
    law = replace(own_arm.friction_law, viscous=-own_arm.friction_law.viscous)
    robot = replace(own_arm.robot, friction_laws={law.name: law})
    assert region_bound(space_of(two_stops(arm=replace(own_arm, robot=robot)))) is None
