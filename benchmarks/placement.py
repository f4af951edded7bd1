"""Placements: the saving of the best place over the nominal one, the lower bound, time and memory.

    python -m benchmarks.placement --count 50
    python -m benchmarks.placement --count 10 --grid

The cells alternate between three robots. Two pick stops are on a table on one side, two place stops
on a table on the other side; a post stands between the tables, and a floor lies below. The arm
carries a part from every pick stop to a place stop. At the nominal base, the distance to the stops
is about 60 % of the reach. The region around the nominal base is 40 % of the reach wide in x and y,
and extends 20 % of the reach up and down. Cells without a cycle at the nominal place are drawn
again. Times and deadline are CPU times (`--deadline`). The memory is the resident memory of the
process after each placement.

With `--grid`, a cycle is also computed at every place of a 5 cm grid, except where the proven bound
excludes the place, and the excess over the best of these places is printed. The benchmark fails if
the energy at a place is below the lower bound, if the best place needs more energy than the nominal
one, or if a motion has no valid certificate.
"""

from __future__ import annotations

import argparse
import os
import time
from collections import Counter
from dataclasses import replace

import numpy as np

from benchmarks.checks import gap_of
from benchmarks.command import on_one_core, parser, write_json
from benchmarks.service import resident
from benchmarks.statistics import Spread
from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.placement.place import place_robot
from joulepath.optimizer.placement.place_solver import PlaceSolver
from joulepath.optimizer.placement.placement import Placement, WeightedCycle
from joulepath.optimizer.placement.placement_solution import PlacementSolution
from joulepath.optimizer.placement.region import Moved, Region
from joulepath.optimizer.placement.space import Space
from joulepath.optimizer.plan_cycle import plan_cycle
from joulepath.optimizer.problem.arm import Arm, Payload
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.problem.scene import Box, HalfSpace, Obstacle, Scene
from joulepath.optimizer.problem.stops import Stop

ROBOTS = ("ur5e", "ur10e", "kr10_r1100")
NOTHING = Payload()
NEAREST = 0.5
"""Smallest distance of a stop from the nominal base as a share of the reach [1]."""
FARTHEST = 0.7
"""Largest distance of a stop from the nominal base as a share of the reach [1]."""
HEIGHTS = (0.05, 0.35)
"""Smallest and largest height of a stop as a share of the reach [1]."""
REGION_WIDTH = 0.4
"""Horizontal width of the region as a share of the reach [1]."""
REGION_HALF_HEIGHT = 0.2
"""Vertical half width of the region as a share of the reach [1]."""
STOP_SPREAD = 0.5
"""Angle around the base over which the stops of one side spread [rad]."""
CLEARANCE = 0.06
"""Height of the stops of a side above their table [m]."""
GRID = 0.05
"""Step of the exhaustive grid [m]."""
UNREACHED_DEADLINE = 1e6
"""Deadline that no computation on the exhaustive grid reaches [s]."""
T_FLANGE_TCP = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.12], [0, 0, 0, 1]])
"""Pose of the TCP in the flange frame (4, 4)."""


def cell(robot: str, rng: np.random.Generator) -> Cycle:
    """A cycle between two tables, in the frame of the nominal base."""
    model = load_robot(robot)
    reach = Chain.of(model.model).length
    middle = rng.uniform(0.6, 1.1)
    turn, sides = rng.uniform(-np.pi, np.pi), (middle, -middle)
    poses, tables = list[list[Pose]](), list[Obstacle]()
    for number, angle in enumerate(sides):
        height = reach * rng.uniform(*HEIGHTS)
        at = [_around(rng, reach, turn + angle, height) for _ in range(2)]
        yaw = rng.uniform(-np.pi, np.pi)
        poses.append([Pose.from_rpy(each, [np.pi, 0.0, yaw]) for each in at])
        centre = np.mean(at, axis=0) - [0.0, 0.0, CLEARANCE + 0.02]
        tables.append(_box(f"table {number}", centre, [0.3 * reach, 0.3 * reach, 0.04]))
    post = 0.6 * reach * np.array([np.cos(turn), np.sin(turn), 0.0])
    top = reach * rng.uniform(0.1, 0.3)
    tables.append(_box("post", np.array([*post[:2], top / 2]), [0.08, 0.08, top]))
    tables.append(
        Obstacle("floor", HalfSpace(), _at(np.array([0.0, 0.0, -REGION_HALF_HEIGHT * reach - 0.1])))
    )
    part = Payload(mass=0.4 * model.rated_payload, com=np.array([0.0, 0.0, 0.15]))
    (a, b), (c, d) = poses
    stops = [
        Stop(name=name, target=pose, payload=carried, dwell=0.2)
        for name, pose, carried in (
            ("pick 1", a, part),
            ("place 1", c, NOTHING),
            ("pick 2", b, part),
            ("place 2", d, NOTHING),
        )
    ]
    arm = Arm(robot=model, T_flange_tcp=T_FLANGE_TCP, scene=Scene(tables))
    above = np.mean([a.T[:3, 3], c.T[:3, 3]], axis=0) + np.array([0.0, 0.0, 0.3])
    start = Pose.from_rpy(above, [np.pi, 0.0, turn])
    return Cycle(arm=arm, start=start, stops=stops, deadline=20.0)


def _around(rng: np.random.Generator, reach: float, angle: float, height: float) -> Array:
    distance = reach * rng.uniform(NEAREST, FARTHEST)
    angle += rng.uniform(-STOP_SPREAD, STOP_SPREAD) / 2
    return np.array([distance * np.cos(angle), distance * np.sin(angle), height])


def _at(position: Array) -> Array:
    T = np.eye(4)
    T[:3, 3] = position
    return T


def _box(name: str, centre: Array, size: list[float]) -> Obstacle:
    return Obstacle(name, Box(np.array(size)), _at(centre))


def numbered(seed: int, number: int, deadline: float) -> Placement:
    """Placement `number` of a seed: the first random cell with a cycle at the nominal place."""
    rng, robot = np.random.default_rng([seed, number]), ROBOTS[number % len(ROBOTS)]
    while True:
        cycle = cell(robot, rng)
        try:
            plan_cycle(replace(cycle, with_baselines=False), progress=False)
        except JoulepathError:
            continue
        break
    reach = Chain.of(cycle.arm.robot.model).length
    around, above = REGION_WIDTH * reach / 2, REGION_HALF_HEIGHT * reach
    region = Region(x=(-around, around), y=(-around, around), z=(-above, above))
    return Placement(cycles=[WeightedCycle(cycle)], moved=[Moved(region)], deadline=deadline)


def exhaustive(placement: Placement) -> list[float]:
    """The energies [J] of the cycles at the places of a fine grid.

    Places with proven bounds above the least energy are left out.
    """
    space, energies = Space.of(replace(placement, resolution=GRID)), [np.inf]
    solver = PlaceSolver(space, time.process_time)
    ample = Deadline.after(UNREACHED_DEADLINE, time.process_time)
    reached = [solver.checked(each, ample) for each in space.map()]
    reached = [each for each in reached if each.reason is None]
    for each in sorted(reached, key=lambda each: each.bound or 0.0):
        if each.bound is not None and each.bound >= min(energies):
            break
        (cycle,) = space.cycles(each.place)
        try:
            found = plan_cycle(replace(cycle, with_baselines=False), progress=False)
        except JoulepathError:
            continue
        energies.append(found.energy.electrical.total)
    return energies


def check(found: PlacementSolution, on_grid: list[float]) -> None:
    """Raises SystemExit if a promise of the solution is broken, given the energies [J] on the fine
    grid."""
    energies = [found.best.energy, *(each.energy for each in found.map if each.energy), *on_grid]
    if found.lower_bound is not None and found.lower_bound > min(energies):
        raise SystemExit(f"the bound {found.lower_bound} J is above {min(energies)} J")
    if found.nominal is None or found.best.energy > found.nominal.energy:
        raise SystemExit("the best place needs more energy than the nominal one")
    for solution in found.best.solutions:
        if not all(move.solution.certificate.valid for move in solution.moves):
            raise SystemExit("a move has no valid certificate")


def measured(placement: Placement, grid: bool) -> tuple[PlacementSolution, dict[str, float]]:
    """The solution of a placement, and its figures."""
    began, wall = time.process_time(), time.perf_counter()
    found = place_robot(placement, clock=time.process_time, progress=False)
    figures = {
        "saving": found.saving or 0.0,
        "gap": gap_of(found.optimality_gap),
        "time": time.process_time() - began,
        "wall_time": time.perf_counter() - wall,
        "points": len(found.map),
        "left_out": found.left_out,
        "evaluated": found.evaluated,
        "memory": resident(os.getpid()),
    }
    energies = [each.energy for each in found.map if each.energy is not None]
    figures["against_worst"] = 1 - found.best.energy / max(energies)
    on_grid = exhaustive(placement) if grid else []
    check(found, on_grid)
    if grid:
        figures["excess"] = found.best.energy / min(on_grid) - 1
    return found, figures


def main() -> None:
    """Prints the figures."""
    on_one_core()
    arguments = _arguments()
    for robot in ROBOTS:
        compile_kernel(load_robot(robot))
    results = list[dict[str, float]]()
    statuses, reasons = Counter[str](), Counter[str]()
    for number in range(arguments.count):
        placement = numbered(arguments.seed, number, arguments.deadline)
        found, figures = measured(placement, arguments.grid)
        statuses[found.status] += 1
        reasons.update(each.reason for each in found.map if each.reason is not None)
        results.append(figures)
        robot = placement.cycles[0].cycle.arm.robot.name
        shown = ", ".join(f"{name} {value:.4g}" for name, value in figures.items())
        print(f"{number} {robot}: {shown}", flush=True)
    report(results, statuses, reasons)
    write_json(arguments.json, {"placements": results})


def report(results: list[dict[str, float]], statuses: Counter[str], reasons: Counter[str]) -> None:
    """Prints the statistics."""

    def spread(name: str) -> Spread:
        return Spread.of([each[name] for each in results if name in each])

    print(f"status: {dict(statuses)}; places without a cycle: {dict(reasons)}")
    print(f"never above nominal, and no energy below the bound: {len(results)} of {len(results)}")
    print(f"saved against nominal: {spread('saving').times(100).formatted(' %')}")
    print(f"saved against the worst: {spread('against_worst').times(100).formatted(' %')}")
    print(f"gap of the lower bound: {spread('gap').times(100).formatted(' %')}")
    print(f"CPU time: {spread('time').formatted(' s')}")
    print(f"wall time: {spread('wall_time').formatted(' s')}")
    print(f"places of the map: {spread('points').formatted(digits=0)}")
    print(f"left out: {spread('left_out').formatted(digits=0)}")
    if any("excess" in each for each in results):
        print(f"above the best of the grid: {spread('excess').times(100).formatted(' %', 2)}")
    for number in sorted({0, len(results) // 2, len(results) - 1}):
        print(f"memory after {number + 1}: {results[number]['memory']:.0f} MB")


def _arguments() -> argparse.Namespace:
    options = parser(__doc__)
    options.add_argument("--count", type=int, default=50, help="number of cells (%(default)s)")
    options.add_argument(
        "--deadline", type=float, default=120.0, help="deadline of a placement [s] (%(default)s)"
    )
    options.add_argument("--grid", action="store_true", help="compare with a grid of 5 cm")
    return options.parse_args()


if __name__ == "__main__":
    main()
