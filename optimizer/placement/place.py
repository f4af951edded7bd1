"""Public entry point: `place(cycle, region)` finds where to put the robot."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from scipy.spatial.transform import Rotation

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Clock
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.placement.place_solver import PlaceResult
from joulepath.optimizer.placement.placement import Placement, WeightedCycle
from joulepath.optimizer.placement.placement_search import PlacementSearch
from joulepath.optimizer.placement.placement_solution import (
    FoundPlace,
    MapPoint,
    PlacedPose,
    PlacementSolution,
    Tolerance,
)
from joulepath.optimizer.placement.region import Coordinate, Group, Moved, Places, Region
from joulepath.optimizer.placement.space import Place, Space
from joulepath.optimizer.presentation.gap import optimality_gap
from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.declared_types import checked_arguments
from joulepath.optimizer.progress import Tell, no_listener, only_news


@checked_arguments
def place(
    cycle: Cycle | Sequence[WeightedCycle],
    region: Region | Places | None = None,
    *,
    moves: Literal["base"] | Group | Sequence[Moved] = "base",
    base: Array | None = None,
    resolution: float | None = None,
    deadline: float = 120.0,
    clock: Clock = time.perf_counter,
    tell: Tell = no_listener,
    progress: bool = True,
) -> PlacementSolution:
    """Find the place of least energy for the robot, or for stops and obstacles around it.

    The nominal place is computed first, so the energy of the answer never exceeds the nominal one.
    Places out of reach, and places with a lower bound above the incumbent, are not optimised.

    Args:
        cycle: the cycle, or several weighted cycles of one robot. Poses, obstacles, directions and
            gravity are given in the world frame.
        region: admissible places of the base, or offsets of the group; None with a list of `moves`.
        moves: "base", a group of stops and obstacles, or several bodies, each with a region.
        base: nominal pose of the robot base in the world, shape (4, 4); None for the identity: the
            world frame is then the base frame.
        resolution: largest distance between neighbouring places of the map [m]; None for at most
            100 places.
        deadline: limit of the wall time [s].
        clock: returns the current time [s].
        tell: receives the progress: places of the map as candidates, and the best place so far.
        progress: whether a bar may show the progress, as in `optimize`.

    Returns:
        Best and nominal place with their certified cycles, the map, tolerance and lower bound.

    Raises:
        InvalidProblem: a field is malformed, or the nominal place is not in the region.
        NoPlacement: the cycles are infeasible at all tried places.
        DeadlineExceeded: the deadline passed before any place was decided.
    """
    cycles = [WeightedCycle(cycle)] if isinstance(cycle, Cycle) else cycle
    asked = Placement(
        cycles=cycles,
        moved=_moved(region, moves),
        base=np.eye(4) if base is None else base,
        resolution=resolution,
        deadline=deadline,
    )
    return place_robot(asked, clock, tell, progress)


def place_robot(
    placement: Placement,
    clock: Clock = time.perf_counter,
    tell: Tell = no_listener,
    progress: bool = True,
) -> PlacementSolution:
    """Solve a placement. Arguments and errors are the same as of `place`."""
    with one_thread(), progress_bar("Placing the robot", tell, progress) as tell:
        began = clock()
        search = PlacementSearch(placement, clock, only_news(tell))
        search.run()
        return _solution(search, clock() - began)


def _moved(
    region: Region | Places | None, moves: Literal["base"] | Group | Sequence[Moved]
) -> Sequence[Moved]:
    if isinstance(moves, Group | str):
        if region is None:
            raise InvalidProblem("region", "The region of the place is missing: give a region.")
        return [Moved(region, moves)]
    if region is not None:
        raise InvalidProblem(
            "region", "Each of several bodies has a region of its own: leave region out."
        )
    return moves


def _solution(search: PlacementSearch, wall_time: float) -> PlacementSolution:
    space, best, nominal = search.space, search.best, search.nominal
    assert best is not None and best.energy is not None
    left_out, bound, before = search.left_out, search.lower_bound, nominal.energy or 0.0
    return PlacementSolution(
        best=_placed(search, best),
        nominal=None if nominal.energy is None else _placed(search, nominal),
        nominal_reason=nominal.reason,
        saving=1 - best.energy / before if before > 0 else None,
        optimality_gap=None if bound is None else optimality_gap(bound, best.energy),
        map=[_point(space, each) for each in search.map],
        resolution=search.space.resolution,
        tolerance=_tolerance(search),
        lower_bound=bound,
        status="complete" if search.is_refined and not left_out else "cut_short",
        evaluated=search.evaluated,
        left_out=left_out,
        wall_time=wall_time,
        objective=space.placement.objective,
        edges=_edges(space, best.place),
    )


def _placed(search: PlacementSearch, found: PlaceResult) -> FoundPlace:
    assert found.energy is not None
    return FoundPlace(
        **_poses(search.space, found.place),
        energy=found.energy,
        duration=search.duration(found),
        solutions=found.solutions,
        placed_cycles=tuple(search.space.cycles(found.place)),
    )


def _point(space: Space, found: PlaceResult) -> MapPoint:
    return MapPoint(
        **_poses(space, found.place),
        energy=found.energy,
        lower_bound=found.bound,
        reason=found.reason,
    )


def _poses(space: Space, at: Place) -> dict[str, Any]:
    groups = [
        pose
        for moved, pose in zip(space.placement.moved, at.poses, strict=True)
        if isinstance(moved.moves, Group)
    ]
    return {
        "base": placed_pose(space.base(at)),
        "mount": space.mount(at),
        "offsets": [placed_pose(pose) for pose in groups],
    }


def placed_pose(T: Array) -> PlacedPose:
    """A pose (4, 4) as position and quaternion."""
    quaternion = Rotation.from_matrix(T[:3, :3]).as_quat()
    return PlacedPose(position=T[:3, 3].tolist(), quaternion=quaternion.tolist())


def _tolerance(search: PlacementSearch) -> list[Tolerance]:
    if search.tolerance is None:
        return []
    return [
        Tolerance(body=axis.body, coordinate=axis.name, lower=float(lower), upper=float(upper))
        for axis, (lower, upper) in zip(search.space.axes, search.tolerance, strict=True)
    ]


def _edges(space: Space, at: Place) -> list[Coordinate]:
    """Coordinates of a place at an end of their range."""
    ends = zip(space.axes, at.x.tolist(), strict=True)
    return [axis.name for axis, value in ends if value in (axis.low, axis.high)]
