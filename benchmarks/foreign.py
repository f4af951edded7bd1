"""Planning problems from other sources, read from a file: answers, times, energies, collisions.

    python -m benchmarks.foreign FILE
    python -m benchmarks.foreign FILE --robot panda
    python -m benchmarks.foreign FILE --count 10 --seed 1 --families cage box --kinds joint
    python -m benchmarks.foreign FILE --meshes FOLDER

FILE is JSON in the format of docs/explained/foreign_scenes.md, which also names sources. Every
problem is solved as in a worker, from the validated request and with a deadline, with its goal as
joint positions and as a pose. Pinocchio and Coal replay every answer with a period of 1 ms. With
`--meshes`, a folder for `joulepath.models.meshes`, the meshes of the links are also replayed among
the obstacles, with a period of 0.1 ms. The exit code is 1 if an answer collides.
"""

from __future__ import annotations

import sys
import time
from argparse import ArgumentParser, Namespace
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import orjson

from benchmarks.collision_replay import collisions, mesh_collisions
from benchmarks.command import on_one_core, parser, write_json
from benchmarks.statistics import Spread
from joulepath import optimize
from joulepath.app.convert.request import to_problem
from joulepath.app.http.problems import problem_of
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.models.meshes import link_surfaces
from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.optimize import warm_up
from joulepath.optimizer.problem.robots import load_robot

Kind = Literal["joint", "pose"]
KINDS: tuple[Kind, ...] = ("joint", "pose")
DEADLINE = 10.0
"""Deadline of a request [s]."""
REPLAY_PERIOD = 1e-3
"""Period of the replay of capsules and hulls [s]."""
MESH_REPLAY_PERIOD = 1e-4
"""Period of the replay of meshes [s]."""
ROBOT = "ur5e"
"""Default robot of the problems."""
TOUCHED_LINKS = 2
"""Number of last links that the gripper may touch: it was modelled for another arm, and overlaps
the capsules of these links."""


@dataclass(frozen=True)
class ForeignProblem:
    """One problem of a file: its name, its family, and the bodies of its requests by kind of
    goal."""

    name: str
    family: str
    requests: dict[Kind, dict[str, Any]]


@dataclass(frozen=True)
class Outcome:
    """The outcome of one request: wall and processor time [s], and the energy [J] of the answer or
    the type of the problem."""

    name: str
    family: str
    kind: Kind
    wall: float
    cpu: float
    energy: float | None = None
    duration: float | None = None
    problem: str | None = None
    detail: str = ""
    reason: str = ""
    collisions: int = 0


def problems_of(path: Path, robot: str = ROBOT) -> list[ForeignProblem]:
    """The problems of a file for a robot, in the file's order."""
    given = orjson.loads(path.read_bytes())
    touched = [*load_robot(robot).link_names[-TOUCHED_LINKS:]]
    capsules = [{"touches": touched, **capsule} for capsule in given["tool"]["capsules"]]
    shared = {"robot": robot, "tool": {"capsules": capsules}, "tcp": given["tcp"]}
    return [
        ForeignProblem(
            each["name"],
            each["family"],
            {
                kind: {
                    **shared,
                    "start": {"q": each["start"]},
                    "goal": {"q": each["goal"]} if kind == "joint" else {"pose": each["goal_pose"]},
                    "scene": {"obstacles": [_renamed(obstacle) for obstacle in each["obstacles"]]},
                }
                for kind in KINDS
            },
        )
        for each in given["problems"]
    ]


def _renamed(obstacle: dict[str, Any]) -> dict[str, Any]:
    """The obstacle with a name unlike the names of the arm's bodies, and without a margin unless
    the file states one."""
    return {"margin": 0.0} | obstacle | {"name": f"scene {obstacle['name']}"}


def chosen(
    problems: Iterable[ForeignProblem], families: Sequence[str], count: int, seed: int
) -> list[ForeignProblem]:
    """At most `count` random problems of every family, in the order of the file; all problems if
    `count` is 0."""
    found: list[ForeignProblem] = []
    problems = list(problems)
    for family in families:
        members = [each for each in problems if each.family == family]
        order = np.random.default_rng(seed).permutation(len(members))
        found += [members[k] for k in np.sort(order[: count or len(members)])]
    return found


def run(
    problem: ForeignProblem,
    kind: Kind,
    deadline: float,
    meshes: Mapping[int, Sequence[Array]] | None = None,
) -> Outcome:
    """Solves and replays one request."""
    began, used = time.perf_counter(), time.process_time()

    def outcome(**found: Any) -> Outcome:
        return Outcome(problem.name, problem.family, kind, **found)

    try:
        asked = to_problem(OptimizeRequest.model_validate(problem.requests[kind]), deadline)
        solution = optimize(asked)
    except JoulepathError as error:
        took = {"wall": time.perf_counter() - began, "cpu": time.process_time() - used}
        type_ = str(problem_of(error, "benchmark")["type"]).rsplit("/", 1)[-1]
        return outcome(**took, problem=type_, detail=str(error))
    took = {"wall": time.perf_counter() - began, "cpu": time.process_time() - used}
    best = min(
        (c for c in solution.candidates if c.energy is not None), key=lambda c: c.energy or 0.0
    )
    spline = solution.trajectory.spline
    hits = collisions(asked.arm, spline, REPLAY_PERIOD)
    if meshes:
        hits += mesh_collisions(asked.arm, meshes, spline, MESH_REPLAY_PERIOD)
    return outcome(
        **took,
        energy=solution.energy.of(asked.objective),
        duration=solution.duration,
        reason=best.reason,
        collisions=hits,
    )


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Statistics by kind of goal and family; the family `all` contains all problems."""
    rows = []
    for kind in dict.fromkeys(each.kind for each in outcomes):
        of_kind = [each for each in outcomes if each.kind == kind]
        for family in [*dict.fromkeys(each.family for each in of_kind), "all"]:
            members = [each for each in of_kind if family in (each.family, "all")]
            rows += [_row(kind, family, members)]
    return {"rows": rows, "outcomes": [asdict(each) for each in outcomes]}


def _row(kind: Kind, family: str, outcomes: Sequence[Outcome]) -> dict[str, Any]:
    answered = [each for each in outcomes if each.problem is None]
    return {
        "kind": kind,
        "family": family,
        "count": len(outcomes),
        "answered": len(answered),
        "wall": Spread.of([each.wall for each in outcomes]),
        "cpu": Spread.of([each.cpu for each in outcomes]),
        "energy": Spread.of([each.energy for each in answered if each.energy is not None]),
        "problems": dict(Counter(each.problem for each in outcomes if each.problem)),
        "collisions": sum(each.collisions > 0 for each in answered),
    }


def print_summary(results: dict[str, Any]) -> None:
    """Prints the table."""
    print(
        f"{'goal':6}{'family':20}{'answered':>12}  {'wall p50':>9}{'p95':>7}{'max':>7} s  "
        f"{'cpu p50':>8}{'p95':>7} s  {'energy p25':>10}{'p50':>7}{'p75':>7} J  {'collide':>7}  "
        "problems"
    )
    for row in results["rows"]:
        wall, cpu, energy = row["wall"], row["cpu"], row["energy"]
        problems = ", ".join(f"{count} {name}" for name, count in row["problems"].items())
        print(
            f"{row['kind']:6}{row['family']:20}{row['answered']:5} of {row['count']:3}  "
            f"{wall.p50:9.2f}{wall.p95:7.2f}{wall.maximum:7.2f} s  {cpu.p50:8.2f}{cpu.p95:7.2f} s  "
            f"{energy.p25:10.1f}{energy.p50:7.1f}{energy.p75:7.1f} J  {row['collisions']:7}  "
            f"{problems or 'none'}"
        )


def problem_parser(description: str | None, robot: str, deadline: float) -> ArgumentParser:
    """A parser with the options for the choice of problems, robot and deadline."""
    command = parser(description)
    command.add_argument("file", type=Path, help="file of problems")
    command.add_argument("--robot", default=robot, help="robot of the problems (%(default)s)")
    command.add_argument("--count", type=int, default=0, help="random problems per family (0: all)")
    command.add_argument("--families", nargs="+", help="families (all)")
    command.add_argument(
        "--deadline", type=float, default=deadline, help="deadline of a request [s] (%(default)s)"
    )
    command.add_argument("--verbose", action="store_true", help="a line for each request")
    return command


def selected(command: ArgumentParser, given: Namespace) -> list[ForeignProblem]:
    """The problems chosen by the options of `problem_parser`; ends the command if a family is
    unknown."""
    problems = problems_of(given.file, given.robot)
    families = list(dict.fromkeys(each.family for each in problems))
    unknown = sorted(set(given.families or ()) - set(families))
    if unknown:
        command.error(
            f"no family {', '.join(unknown)} in {given.file}: it has {', '.join(families)}"
        )
    return chosen(problems, given.families or families, given.count, given.seed)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit code."""
    command = problem_parser(__doc__, ROBOT, DEADLINE)
    command.add_argument(
        "--kinds", nargs="+", choices=KINDS, default=list(KINDS), help="kinds of goal (both)"
    )
    command.add_argument("--meshes", type=Path, metavar="FOLDER", help="meshes of the robot")
    given = command.parse_args(arguments)
    problems = selected(command, given)
    meshes: dict[int, list[Array]] = {}
    if given.meshes is not None:
        meshes = {
            link: list(link_surfaces(given.meshes, given.robot, link).values())
            for link in range(1, load_robot(given.robot).nq + 1)
        }
    on_one_core()
    warm_up(given.robot)
    outcomes: list[Outcome] = []
    for problem in problems:
        for kind in given.kinds:
            found = run(problem, kind, given.deadline, meshes)
            outcomes.append(found)
            if given.verbose:
                result = found.problem or f"{found.energy:.2f} J"
                print(
                    f"{found.name:26} {kind:6} {found.wall:6.2f} s  {result}  "
                    f"{found.detail or found.reason}",
                    flush=True,
                )
    results = summary(outcomes)
    print_summary(results)
    write_json(given.json, results)
    return int(any(each.collisions for each in outcomes))


if __name__ == "__main__":
    sys.exit(main())
