"""The duration `shortest` of the problem `duration-too-short`, compared with faster motions.

    python -m benchmarks.fastest --count 60 --starts 8
    python -m benchmarks.fastest --count 400 --starts 20 --robot panda

A move is requested with a tenth of the time that its joints need, and is refused with the duration
`shortest`. Every second move has a payload up to the rated payload. Two of every four moves are
within ±1.5 rad of the zero position, the other two anywhere within ±π. The benchmark then searches
for faster motions: by minimum-time solves from random smooth motions, by `optimize` without a
duration, and by `optimize` with 99 % of `shortest`. Only certified motions count. Collisions are
ignored.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks.command import on_one_core, parser, write_json
from benchmarks.statistics import Spread
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.motion import quintic
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.arm import Arm, Payload
from joulepath.optimizer.problem.problem import DURATIONS, Problem
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.search.attempts import in_time, solver_of
from joulepath.optimizer.search.errors import DurationTooShort
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.solve.methods.duration_intervals import fastest

SHORT_RANGE = 1.5
"""Largest joint position of a short move [rad]."""
PAYLOADS = (0.5, 1.0)
"""Smallest and largest payload as a share of the rated payload [1]."""
COM_OFFSET = 0.05
"""Largest lateral offset of the centre of mass of a payload in the flange frame [m]."""
COM_DISTANCE = 0.12
"""Largest distance of this centre from the flange [m]."""
AMPLITUDE = 0.6
"""Standard deviation of the amplitude of the first sine of a random start [rad]."""
SINES = 4
"""Number of sines of a random start."""
SAMPLES = 121
"""Samples of a random start over time."""
START_DURATIONS = (1.0, 3.0)
"""Smallest and largest duration of a random start over the least duration [1]."""
FASTER = 0.01
"""Relative difference of durations above which another motion counts as faster [1]."""


@dataclass(frozen=True)
class Outcome:
    """The outcome of one move.

    `shortest` is the duration of the refusal [s], and `proven` whether no shorter one exists.
    `started` and `optimized` are the durations of the fastest motions from random starts and by
    `optimize` [s], infinite without a motion. The refusal took `seconds` of processor time.
    """

    index: int
    shortest: float
    proven: bool
    started: float
    optimized: float
    seconds: float

    @property
    def ratio(self) -> float:
        """`shortest` over the duration of the fastest motion [1]."""
        return self.shortest / min(self.started, self.optimized, self.shortest)


def problems(robot: Robot, seed: int, count: int) -> Iterator[Problem]:
    """The moves of a seed."""
    limits = robot.limits
    for index in range(count):
        rng = np.random.default_rng([seed, index])
        most = SHORT_RANGE if index % 4 < 2 else np.pi
        lower, upper = np.maximum(limits.q_min, -most), np.minimum(limits.q_max, most)
        # if the range of a joint is outside these bounds, the whole range is used
        lower, upper = (
            np.where(lower < upper, lower, limits.q_min),
            np.where(lower < upper, upper, limits.q_max),
        )
        q_start, q_goal = rng.uniform(lower, upper, (2, robot.nq))
        payload = Payload()
        if index % 2:
            com = rng.uniform(
                [-COM_OFFSET, -COM_OFFSET, 0.0], [COM_OFFSET, COM_OFFSET, COM_DISTANCE]
            )
            payload = Payload(float(rng.uniform(*PAYLOADS)) * robot.rated_payload, com)
        yield Problem(
            arm=Arm(robot=robot, payload=payload, limits=limits, collisions=False),
            start=q_start,
            goal=q_goal,
            deadline=60.0,
        )


def refused(problem: Problem) -> DurationTooShort | None:
    """The refusal of a move in a tenth of the time that its joints need; None if the move is
    refused for another reason.
    """
    least = float(
        shortest_duration(
            np.asarray(problem.goal) - np.asarray(problem.start), problem.arm.active_limits
        )
    )
    try:
        optimize(replace(problem, duration_max=max(least / 10, DURATIONS.least)))
    except DurationTooShort as error:
        return error
    except JoulepathError:
        return None
    raise AssertionError("a motion in a tenth of the time that the joints need")


def from_random_starts(problem: Problem, starts: int, rng: np.random.Generator) -> float:
    """Duration [s] of the fastest motion of minimum-time solves from random smooth motions."""
    run, best = Run(problem), np.inf
    run.prepare()
    state, candidate = run.state, run.state.candidates[0]
    least, interval = candidate.shortest, fastest(run.state.prepared)
    for number in range(starts):
        q, t = _random(
            candidate.q_start, candidate.q_goal, least * float(rng.uniform(*START_DURATIONS)), rng
        )
        solver, fine = solver_of(state, candidate, interval), number % 2 == 0
        found = in_time(state, partial(solver.solve_from, q, t, fine)).spline
        if found is None or found.duration >= best:
            continue
        if state.certified(candidate, found, state.prepared.energy(found)).valid:
            best = found.duration
    return best


def _random(
    q_start: Array, q_goal: Array, duration: float, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Samples q (k, nq) [rad] at t (k,) [s] of the straight line in joint space with random
    sines."""
    tau = np.linspace(0.0, 1.0, SAMPLES)
    sines = np.sin(np.pi * np.outer(tau, np.arange(1, SINES + 1)))
    height = AMPLITUDE * rng.normal(size=(SINES, len(q_start))) / np.arange(1, SINES + 1)[:, None]
    # the sines fade to zero at both ends, so that the motion begins and ends at rest
    fading = quintic.fraction(np.minimum(1.0, 8 * np.minimum(tau, 1 - tau)))[:, None]
    line = q_start + np.outer(quintic.fraction(tau), q_goal - q_start)
    return line + fading * (sines @ height), tau * duration


def optimized(problem: Problem, shortest: float) -> float:
    """Duration [s] of the fastest motion of `optimize`, without a duration and with slightly less
    than the shortest.
    """
    best = np.inf
    for longest in (None, (1 - FASTER) * shortest):
        try:
            best = min(best, optimize(replace(problem, duration_max=longest)).duration)
        except DurationTooShort as error:
            best = min(best, error.shortest or np.inf)
        except JoulepathError:
            continue
    return best


def main() -> None:
    """Compares every move, and prints the worst ratio and the number of ratios above 1 %."""
    arguments = parser(__doc__, seed=31)
    arguments.add_argument("--count", type=int, default=60, help="moves (%(default)s)")
    arguments.add_argument(
        "--starts", type=int, default=8, help="random starts per move (%(default)s)"
    )
    arguments.add_argument("--robot", default="ur5e", help="robot (%(default)s)")
    asked = arguments.parse_args()
    on_one_core()
    outcomes = list[Outcome]()
    with one_thread():
        for index, problem in enumerate(problems(load_robot(asked.robot), asked.seed, asked.count)):
            began = time.process_time()
            error = refused(problem)
            seconds = time.process_time() - began
            if error is None:
                continue
            shortest = error.shortest or np.inf
            started = from_random_starts(
                problem, asked.starts, np.random.default_rng([asked.seed, index, 1])
            )
            outcomes.append(
                Outcome(
                    index, shortest, error.proven, started, optimized(problem, shortest), seconds
                )
            )
            if outcomes[-1].ratio > 1 + FASTER:
                print(f"move {index}: {outcomes[-1]}, ratio {outcomes[-1].ratio:.4f}", flush=True)
    ratios = [each.ratio for each in outcomes]
    above = sum(ratio > 1 + FASTER for ratio in ratios)
    print(
        f"{len(outcomes)} moves of {asked.robot}, {asked.starts} random starts each: worst ratio "
        f"{max(ratios):.4f},"
    )
    print(f"{above} above 1 %, {sum(each.proven for each in outcomes)} proven,")
    print(
        "processor time of a refusal "
        f"{Spread.of([each.seconds for each in outcomes]).formatted(' s', 2)}"
    )
    write_json(asked.json, {"worst": max(ratios), "above": above, "moves": outcomes})


if __name__ == "__main__":
    main()
