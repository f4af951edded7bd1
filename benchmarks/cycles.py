"""Cycles of stops: the saving over decisions move by move, the proven gap, and the time.

    python -m benchmarks.cycles --count 20
    python -m benchmarks.cycles --count 50 --dwell 0
    python -m benchmarks.cycles --count 50 --anywhere
    python -m benchmarks.cycles --count 50 --turned
    python -m benchmarks.cycles --count 5 --stops 12
    python -m benchmarks.cycles --count 10 --time 1.5
    python -m benchmarks.cycles --count 20 --stops 5 --passes 4
    python -m benchmarks.cycles --count 5 --stops 12 --free
    python -m benchmarks.cycles --count 1 --stops 245 --deadline 600

A UR5e starts from rest at given joint positions above the table, picks up 2 kg at every second
stop, puts the part down at the next stop, and returns. The poses of the stops are random, within
reach, and with the tool nearly down. The arm dwells 0.3 s at each stop, or the time of `--dwell`;
no choice of configurations saves the energy of a dwell. Collisions are ignored, so that every cycle
has an answer. The options change the cycles:

- `--anywhere`: the start is also a pose, in any configuration. If the moves are decided one by one,
  the first move decides this configuration.
- `--turned`: the parts are round, so that the tool may have any angle about its axis at every stop.
- `--time`: the duration of a cycle is this multiple of its duration of least energy. The excess is
  the energy of the answer over the least energy of its feasible baselines and of the cycle of least
  energy followed by a wait. The benchmark fails if there is any.
- `--passes`: the arm passes through the first stops without a rest, and carries no part. The
  benchmark fails if a cycle needs more energy than the same cycle with rests.
- `--free`: the order of the stops is free, and the arm carries no part.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.checks import gap_of
from benchmarks.command import on_one_core, parser, write_json
from benchmarks.statistics import Spread
from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.plan_cycle import plan_cycle
from joulepath.optimizer.presentation.gap import optimality_gap
from joulepath.optimizer.problem.arm import Arm, Payload
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.free_order import FreeOrder
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.problem.stops import Stop

HOME = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
PART = Payload(mass=2.0, com=np.array([0.0, 0.0, 0.05]))
NOTHING = Payload()
NEAREST = 0.35
"""Inner radius of the ring of stops around the base [m]."""
FARTHEST = 0.7
"""Outer radius of this ring [m]."""
HEIGHTS = (0.05, 0.4)
"""Smallest and largest height of a stop above the base [m]."""
TILT = 0.2
"""Largest roll and pitch of the tool at a stop [rad]."""

DWELL = 0.3
"""Dwell at a stop [s]."""
SUMS = ("joins [rad]", "energy of the legs", "parts of the energy")
"""Quantities of a cycle that are zero up to rounding: the largest jump of a joint between legs, and
the relative errors of the sum of the energies of all legs, and of the sum of the energy's parts."""
ROUNDING = 1e-9
"""Largest rounding error of these quantities."""
EXCESS = "excess over the least of all"
NO_EXCESS = 1e-6
"""Relative difference within which energies of equal motions agree [1]."""


def poses(rng: np.random.Generator, count: int) -> list[Pose]:
    """Random poses with the tool nearly down."""
    found = list[Pose]()
    while len(found) < count:
        x, y, z = rng.uniform([-FARTHEST, -FARTHEST, HEIGHTS[0]], [FARTHEST, FARTHEST, HEIGHTS[1]])
        if NEAREST < np.hypot(x, y) < FARTHEST:
            roll, pitch, yaw = rng.uniform([-TILT, -TILT, -np.pi], [TILT, TILT, np.pi])
            found.append(Pose.from_rpy([x, y, z], [np.pi + roll, pitch, yaw]))
    return found


def random_cycles(
    seed: int,
    count: int,
    stops: int,
    deadline: float,
    passes: int = 0,
    free: bool = False,
    dwell: float = DWELL,
    anywhere: bool = False,
    turned: bool = False,
) -> Iterator[Cycle]:
    """The cycles; every cycle has its own random generator."""
    arm = Arm(robot=load_robot("ur5e"), collisions=False)
    for k in range(count):
        *targets, first = poses(np.random.default_rng([seed, k]), stops + 1)
        yield Cycle(
            arm=arm,
            start=first if anywhere else HOME,
            stops=[
                _stop(j, _target(pose, turned), passes, free, dwell)
                for j, pose in enumerate(targets)
            ],
            order=FreeOrder() if free else None,
            deadline=deadline,
        )


def _target(pose: Pose, turned: bool) -> Pose | ConeOrientedPose:
    return ConeOrientedPose.about(pose, np.array([0.0, 0.0, 1.0])) if turned else pose


def _stop(
    number: int, pose: Pose | ConeOrientedPose, passes: int, free: bool, dwell: float
) -> Stop:
    if passes or free:
        passed = number < passes
        return Stop(name=str(number), target=pose, dwell=0.0 if passed else dwell, via=passed)
    return Stop(name=str(number), target=pose, dwell=dwell, payload=NOTHING if number % 2 else PART)


def in_time(asked: Cycle, free: CycleSolution, factor: float) -> Cycle:
    """The cycle with a multiple `factor` of the duration of its solution of free duration."""
    duration = factor * free.duration
    return replace(asked, duration_min=duration, duration_max=duration)


def excess(answer: CycleSolution, free: CycleSolution | None) -> float:
    """Relative excess of a cycle over the least energy of the known feasible cycles: its baselines,
    and the solution `free` of free duration followed by a wait on the motors, at the stop of least
    power.

    The baseline `controller_default` does not count: its acceleration jumps at the start, so that
    no certificate confirms it.
    """
    known = [
        each.electrical
        for each in answer.baselines
        if each.within_limits and each.name != "controller_default"
    ]
    if free is not None and answer.duration >= free.duration:
        held = [
            Plant(move.planned.arm_after).holding_power(move.solution.goal.q) for move in free.moves
        ]
        known.append(
            free.energy.electrical.total + (answer.duration - free.duration) * float(min(held))
        )
    return answer.energy.electrical.total / min(known) - 1 if known else 0.0


def _sums(answer: CycleSolution) -> dict[str, float]:
    """The quantities of SUMS."""
    electrical = answer.energy.electrical
    of_legs = sum(
        move.solution.energy.electrical.total + move.dwell_energy + move.wait_energy
        for move in answer.moves
    )
    errors = (
        answer.joins,
        abs(of_legs / electrical.total - 1),
        abs(electrical.parts_sum / electrical.total - 1),
    )
    return dict(zip(SUMS, errors, strict=True))


def _given() -> argparse.Namespace:
    """The arguments of the command."""
    arguments = parser(__doc__, seed=0)
    arguments.add_argument("--count", type=int, default=20, help="cycles (%(default)s)")
    arguments.add_argument("--stops", type=int, default=6, help="stops of a cycle (%(default)s)")
    arguments.add_argument(
        "--deadline", type=float, default=60.0, help="deadline of a cycle [s] (%(default)s)"
    )
    arguments.add_argument(
        "--passes", type=int, default=0, help="stops without a rest (%(default)s)"
    )
    arguments.add_argument("--free", action="store_true", help="the order is free")
    arguments.add_argument(
        "--anywhere", action="store_true", help="the start is a pose, in any configuration"
    )
    arguments.add_argument(
        "--turned", action="store_true", help="the tool may be turned about its axis at the stops"
    )
    arguments.add_argument(
        "--time", type=float, help="duration of a cycle over its duration of least energy"
    )
    arguments.add_argument(
        "--dwell", type=float, default=DWELL, help="dwell at each stop [s] (%(default)s)"
    )
    return arguments.parse_args()


def main() -> None:
    """Solves every cycle, and prints savings, gaps, times and the number of solved motions."""
    given = _given()
    on_one_core()
    compile_kernel(load_robot("ur5e"))
    # loads everything that is loaded once, so that the first cycle does not pay for it
    plan_cycle(next(random_cycles(given.seed + 1, 1, 1, given.deadline)))
    found: dict[str, list[float]] = {}
    optimal = legs = certified = 0
    how = (given.passes, given.free, given.dwell, given.anywhere, given.turned)
    size = (given.seed, given.count, given.stops, given.deadline)
    for asked in random_cycles(*size, *how):
        free = None if given.time is None else plan_cycle(asked)
        if free is not None:
            asked = in_time(asked, free, given.time)
        began = time.perf_counter()
        answer = plan_cycle(asked)
        least = answer.energy.electrical.total * (1 - NO_EXCESS)
        if any(each.name == "stopping" and each.electrical < least for each in answer.baselines):
            raise SystemExit("passing needs more than stopping")
        legs += len(answer.moves)
        certified += sum(move.solution.certificate.valid for move in answer.moves)
        row = {
            f"saved against {each.name}": each.saving
            for each in answer.baselines
            if each.saving is not None
        }
        row[EXCESS] = excess(answer, free)
        row["gap"] = gap_of(optimality_gap(answer.lower_bound, answer.energy.electrical.total))
        row["time [s]"] = time.perf_counter() - began
        row |= _sums(answer)
        row["distinct legs"] = sum(move.kinds for move in answer.moves)
        row["motions sought"] = sum(move.solved for move in answer.moves)
        optimal += answer.status == "optimal"
        for name, value in row.items():
            found.setdefault(name, []).append(float(value))
    _report(given, found, (optimal, certified, legs))


def _report(
    given: argparse.Namespace, found: dict[str, list[float]], counts: tuple[int, int, int]
) -> None:
    """Prints the distributions of all quantities. Raises SystemExit if a requirement fails."""
    optimal, certified, legs = counts
    print(f"{given.count} cycles of {given.stops} stops, seed {given.seed}: {optimal} optimal")
    print(f"legs with a valid certificate    {certified} of {legs}")
    results = {name: Spread.of(values) for name, values in found.items()}
    for name, spread in results.items():
        if name in SUMS:
            print(f"{name:32s} at most {spread.maximum:.1e}")
        else:
            print(f"{name:32s} {spread.formatted(digits=3)}, least {spread.minimum:.3f}")
    write_json(
        given.json, {"seed": given.seed, "count": given.count, "stops": given.stops} | results
    )
    if results[EXCESS].maximum > NO_EXCESS:
        raise SystemExit(
            f"a cycle needs {results[EXCESS].maximum:.2%} more energy than a known cycle"
        )
    if certified < legs or max(results[name].maximum for name in SUMS) > ROUNDING:
        raise SystemExit("a leg is not certified, or the legs do not add up to the cycle")


if __name__ == "__main__":
    main()
