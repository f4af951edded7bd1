"""The places of a region, and errors for contradictory requests."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from joulepath.optimizer.placement.map_axis import MAP
from joulepath.optimizer.placement.placement import Placement, WeightedCycle
from joulepath.optimizer.placement.region import Group, Moved, Places, Region
from joulepath.optimizer.placement.space import Space
from tests.optimizer.placement.cells import arm, at, floor, two_stops
from tests.refusals import refusal_of

ROUNDING = 1e-12


def placement(*moved: Moved, **fields: Any) -> Placement:
    cycles = [WeightedCycle(two_stops([floor()]))]
    return Placement(**{"cycles": cycles, "moved": moved} | fields)


def test_the_map_spans_the_region() -> None:
    region = Region(x=(-0.3, 0.3), y=(0.0, 0.2), yaw=(-0.5, 0.5))
    space = Space.of(placement(Moved(region), resolution=0.1))
    places = space.map()
    assert len(places) == 7 * 3 * 3
    x = np.array([each.x for each in places])
    assert x.min(axis=0) == pytest.approx([-0.3, 0.0, -0.5])
    assert x.max(axis=0) == pytest.approx([0.3, 0.2, 0.5])
    T = space.base(space.place((0,), np.array([0.1, 0.2, 0.5])))
    assert np.allclose(T, at(0.1, 0.2, 0.0, Rotation.from_euler("z", 0.5).as_matrix()))


@pytest.mark.parametrize(
    ("region", "count"),
    [
        (Region(x=(-0.4, 0.4), y=(-0.4, 0.4), z=(-0.4, 0.4)), 5 * 5 * 4),
        (Region(x=(-0.4, 0.4), y=(-0.4, 0.4)), 10 * 10),
        (Region(x=(-0.4, 0.4), mounts=("floor", "wall")), 50 * 2),
        (Region(x=(-0.4, 0.4), y=(-0.3, 0.3), z=(0.0, 0.3)), 6 * 5 * 3),
    ],
)
def test_without_a_resolution_the_map_is_as_fine_as_its_size_allows(
    region: Region, count: int
) -> None:
    assert MAP.points == 100
    places = Space.of(placement(Moved(region))).map()
    assert len(places) == count
    x = np.array([each.x for each in places])
    for values in map(np.unique, x.T):
        assert count // len(values) * (len(values) + 1) > MAP.points


def test_the_map_of_a_tiny_region_is_no_finer_than_any_resolution() -> None:
    space = Space.of(placement(Moved(Region(x=(-1e-8, 1e-8), y=(-1e-8, 1e-8)))))
    assert len(space.map()) == 4


def test_a_whole_turn_has_each_yaw_once() -> None:
    space = Space.of(placement(Moved(Region(yaw=(0.0, 2 * np.pi))), resolution=0.15 * np.pi / 2))
    yaw = [float(each.x[0]) for each in space.map()]
    assert yaw == pytest.approx([0.0, np.pi / 2, np.pi, 1.5 * np.pi])


def test_mounts_turn_the_base() -> None:
    region = Region(x=(-0.1, 0.1), mounts=("floor", "wall", "ceiling"))
    space = Space.of(placement(Moved(region), resolution=0.2))
    z_axes = {space.mount(each): space.base(each)[:3, 2] for each in space.map()}
    assert {name: axis.round(9).tolist() for name, axis in z_axes.items()} == {
        "floor": [0, 0, 1],
        "wall": [1, 0, 0],
        "ceiling": [0, 0, -1],
    }
    for each in space.map():
        R = space.base(each)[:3, :3]
        assert np.allclose(R @ R.T, np.eye(3)) and np.linalg.det(R) > 0
        (cycle,) = space.cycles(each)
        assert np.allclose(R @ cycle.arm.gravity, [0, 0, -9.81], atol=1e-2)


def test_a_tilted_base_keeps_its_tilt() -> None:
    tilt = Rotation.from_euler("xyz", [0.3, 0.2, 0.7]).as_matrix()
    base = at(0.1, 0.0, 0.2, tilt)
    space = Space.of(placement(Moved(Region(yaw=(-7.0, 7.0), x=(0.0, 0.2))), base=base))
    axis = next(axis for axis in space.axes if axis.name == "yaw")
    same = space.base(space.place((0,), np.array([0.1, axis.nominal])))
    assert np.allclose(same, base, atol=ROUNDING)
    turned = space.base(space.place((0,), np.array([0.1, axis.nominal + 0.4])))
    assert np.allclose(turned[:3, :3], Rotation.from_euler("z", 0.4).as_matrix() @ tilt)


def test_a_group_turns_about_the_mean_of_its_stops() -> None:
    group = Group(stops=("pick", "place"), obstacles=("floor",))
    space = Space.of(placement(Moved(Region(yaw=(-1.0, 1.0)), group)))
    (offset,) = space.place((0,), np.array([0.7])).poses
    pivot = np.array([0.5, 0.0, 0.2, 1.0])
    assert np.allclose(offset @ pivot, pivot, atol=ROUNDING)
    assert np.allclose(space.place((0,), np.array([0.0])).poses[0], np.eye(4), atol=ROUNDING)


def test_both_may_move() -> None:
    moved = [Moved(Region(x=(-0.1, 0.1))), Moved(Region(z=(0.0, 0.2)), Group(stops=("pick",)))]
    space = Space.of(placement(*moved))
    (cycle,) = space.cycles(space.place((0, 0), np.array([0.1, 0.2])))
    at_pick = cycle.stops[0].target.T[:3, 3]  # type: ignore[union-attr]
    assert at_pick == pytest.approx([0.4, -0.3, 0.4])
    at_place = cycle.stops[1].target.T[:3, 3]  # type: ignore[union-attr]
    assert at_place == pytest.approx([0.4, 0.3, 0.2])


def test_listed_places_include_the_nominal_one() -> None:
    space = Space.of(placement(Moved(Places([at(0.1), at(0.2), at()]))))
    x = [float(space.base(each)[0, 3]) for each in space.map()]
    assert x == [0.0, 0.1, 0.2]


NAN = float("nan")
WRONG: dict[str, tuple[str, Any]] = {
    "empty": ("region.x", lambda: Region(x=(0.2, 0.1))),
    "not a number": ("region.yaw", lambda: Region(yaw=(NAN, 0.1))),
    "huge": ("region.z", lambda: Region(z=(-1e9, 1e9))),
    "no mount": ("region.mounts", lambda: Region(mounts=())),
    "no places": ("region.places", lambda: Places([])),
    "skewed": ("region.places.1", lambda: Places([at(), 2 * at()])),
    "moves twice": ("moves.stops", lambda: Group(stops=("pick", "pick"))),
    "moves nothing": ("moves", lambda: Group()),
    "group with mount": (
        "region.mounts",
        lambda: Moved(Region(mounts=("wall",)), Group(stops=("pick",))),
    ),
    "nominal outside": ("region.x", lambda: Space.of(placement(Moved(Region(x=(0.1, 0.2)))))),
    "nominal yaw outside": (
        "region.yaw",
        lambda: Space.of(placement(Moved(Region(yaw=(0.5, 1.0))))),
    ),
    "nominal mount outside": (
        "region.mounts",
        lambda: Space.of(placement(Moved(Region(mounts=("wall",))))),
    ),
    "one place": ("region", lambda: Space.of(placement(Moved(Region(x=(0.0, 0.0)))))),
    "resolution of listed places": (
        "resolution",
        lambda: Space.of(placement(Moved(Places([at(0.1)])), resolution=0.1)),
    ),
    "too fine": (
        "resolution",
        lambda: Space.of(
            placement(Moved(Region(x=(-1, 1), y=(-1, 1), z=(-1, 1))), resolution=0.01)
        ).map(),
    ),
    "unknown stop": (
        "moves.stops",
        lambda: placement(Moved(Region(x=(0, 1)), Group(stops=("elsewhere",)))),
    ),
    "unknown obstacle of the second": (
        "moves.1.moves.obstacles",
        lambda: placement(
            Moved(Region(x=(0, 1))), Moved(Region(x=(0, 1)), Group(obstacles=("elsewhere",)))
        ),
    ),
    "base twice": (
        "moves.1",
        lambda: placement(Moved(Region(x=(0, 1))), Moved(Region(y=(0, 1)))),
    ),
    "stop in two groups": (
        "moves.1",
        lambda: placement(
            Moved(Region(x=(0, 1)), Group(stops=("pick",))),
            Moved(Region(y=(0, 1)), Group(stops=("pick",))),
        ),
    ),
    "joint positions move": (
        "moves.stops",
        lambda: placement(
            Moved(Region(x=(0, 1)), Group(stops=("start",))),
            cycles=[WeightedCycle(two_stops(start=np.zeros(6)))],
        ),
    ),
    "mounts on a tilted world": (
        "region.mounts",
        lambda: placement(
            Moved(Region(mounts=("floor", "wall"))),
            cycles=[WeightedCycle(two_stops(arm=arm(gravity=np.array([1.0, 0.0, -9.7]))))],
        ),
    ),
    "no weight": ("weight", lambda: WeightedCycle(two_stops(), 0.0)),
    "two gravities": (
        "cycles.1.cycle.gravity",
        lambda: placement(
            Moved(Region(x=(0, 1))),
            cycles=[
                WeightedCycle(two_stops()),
                WeightedCycle(two_stops(arm=arm(gravity=np.array([0.0, 0.0, -1.6])))),
            ],
        ),
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_contradiction_is_refused_with_its_field(name: str) -> None:
    field, make = WRONG[name]
    with refusal_of(field):
        make()
