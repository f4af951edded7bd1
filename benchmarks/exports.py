"""Exports read back: random motions written in every format, and how far what a controller makes of them deviates.

    python -m benchmarks.exports                 200 motions, drawn within the limits of the robots
    python -m benchmarks.exports --solved 20     and as many that the optimiser answers

Random motions are B-splines from rest to rest, as fast as the limits on speed, acceleration and jerk allow. Every file
is read back as its controller would: set points of the URScript program by a small interpreter, quintics between the
points of ROS messages by SciPy, rows of tables, and the two courses between points that the RAPID and KRL files assume.
The largest deviation from the spline is printed for each format, and the largest that a file stated for itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from io import BytesIO, StringIO

import numpy as np
import orjson
import yaml

from benchmarks.command import on_one_core, parser, write_json
from benchmarks.read_back.joint_trajectories import deviations, followed
from benchmarks.read_back.point_programs import cut, deviation, read_krl, read_rapid, stated, through
from benchmarks.read_back.random_motions import OWN, one_move
from benchmarks.read_back.urscript_machine import Controller
from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import FormatUnsuitable
from joulepath.optimizer.export.csv_table import to_csv
from joulepath.optimizer.export.franka import ROUNDING, to_franka
from joulepath.optimizer.export.json_document import to_json
from joulepath.optimizer.export.krl import to_krl
from joulepath.optimizer.export.npz_arrays import to_npz
from joulepath.optimizer.export.program import Move, Program
from joulepath.optimizer.export.quintic_points import POSITION_TOLERANCE
from joulepath.optimizer.export.rapid import to_rapid
from joulepath.optimizer.export.ros_messages import MoveitOptions, to_moveit, to_ros2
from joulepath.optimizer.export.urscript import SET_POINT_ERROR, to_urscript
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.trajectories.spline import Spline

ROBOTS = ("ur5e", "ur10e", "kr10_r1100", "fr3", OWN)
COUNT, SEED = 200, 17
# deadline of a solve [s], and rounding of a table that is read back [rad]
DEADLINE, TABLE_ROUNDING = 5.0, 1e-9
# rounding of axes and times that the stated deviations of RAPID and KRL files do not count [rad]
POINT_ROUNDING = 1e-5
Deviation = tuple[float, float]
"""Of what was read back, and of what the format promises or the file states [rad]."""


def programs(seed: int, count: int, solved: int) -> Iterator[Program]:
    """Random motions; `solved` more are answers of the optimiser between the ends of the first ones."""
    for k in range(count):
        yield one_move(ROBOTS[k % len(ROBOTS)], seed * 1000 + k)
    for k in range(solved):
        drawn = one_move(ROBOTS[k % len(ROBOTS)], seed * 1000 + k).moves[0]
        start, goal = drawn.spline.control_points[0], drawn.spline.control_points[-1]
        found = optimize(Problem(arm=drawn.arm, start=start, goal=goal, windings=False, deadline=DEADLINE))
        yield Program((Move(found.trajectory.spline, drawn.arm),))


def of_urscript(program: Program) -> Deviation:
    """Of the set points of servoj."""
    controller = Controller(program.start)
    controller.run(to_urscript(program).content.decode())
    points = controller.set_points
    # it sleeps before the first of them
    t = np.minimum(points[:, 0] - points[0, 0] + 0.002, program.duration)
    return _apart(program.at(t)[0], points[:, 1:]), SET_POINT_ERROR


def of_ros2(program: Program) -> Deviation:
    """Of the quintics between the points."""
    content = yaml.safe_load(to_ros2(program).content)
    return deviations(program, followed(content["trajectory"]))[0], POSITION_TOLERANCE


def of_moveit(program: Program) -> Deviation:
    """Of the quintics between the points."""
    content = orjson.loads(to_moveit(program, MoveitOptions("json")).content)
    return deviations(program, followed(content["joint_trajectory"]))[0], POSITION_TOLERANCE


def of_krl(program: Program) -> Deviation:
    """Of straight lines and of the cubic spline between the points."""
    file = to_krl(program)
    return deviation(program, read_krl(file), through), 1.01 * stated(file) + POINT_ROUNDING


def of_rapid(program: Program) -> Deviation:
    """Of straight lines, their corners sharp or cut."""
    file = to_rapid(program)
    return deviation(program, read_rapid(file), cut), 1.01 * stated(file) + POINT_ROUNDING


def of_franka(program: Program) -> Deviation:
    """Of the rows of the table."""
    rows = _table(to_franka(program).content)
    return _apart(program.at(np.minimum(rows[:, 0], program.duration))[0], rows[:, 1:8]), ROUNDING


def of_csv(program: Program) -> Deviation:
    """Of the rows of the table."""
    rows = _table(to_csv(program).content)
    return _apart(program.at(rows[:, 0])[0], rows[:, 1 : 1 + program.robot.nq]), TABLE_ROUNDING


def of_json(program: Program) -> Deviation:
    """Of the spline itself."""
    (step,) = orjson.loads(to_json(program).content)["steps"]
    spline = Spline(step["degree"], np.array(step["knots"]), np.array(step["control_points"]))
    t = np.linspace(0.0, program.duration, 1001)
    return _apart(program.at(t)[0], spline.curve(t)), 0.0


def of_npz(program: Program) -> Deviation:
    """Of the samples."""
    with np.load(BytesIO(to_npz(program).content), allow_pickle=False) as arrays:
        return _apart(program.at(arrays["t"])[0], arrays["q"]), 0.0


FORMATS: dict[str, Callable[[Program], Deviation]] = {
    "urscript": of_urscript,
    "ros2": of_ros2,
    "moveit": of_moveit,
    "franka": of_franka,
    "rapid": of_rapid,
    "krl": of_krl,
    "csv": of_csv,
    "json": of_json,
    "npz": of_npz,
}


def _table(content: bytes) -> Array:
    return np.loadtxt(StringIO(content.decode()), delimiter=",", skiprows=1)


def _apart(one: Array, other: Array) -> float:
    return float(np.abs(one - other).max())


def measured(motions: Iterator[Program]) -> dict[str, list[Deviation]]:
    """The deviations of every motion by format; a format leaves out the robots that it is not for."""
    found: dict[str, list[Deviation]] = {name: [] for name in FORMATS}
    for program in motions:
        for name, deviation_of in FORMATS.items():
            try:
                found[name].append(deviation_of(program))
            except FormatUnsuitable:
                continue
    return found


def main() -> None:
    """Prints a table with a row per format."""
    options = parser(__doc__, SEED)
    options.add_argument("--count", type=int, default=COUNT, help="random motions (%(default)s)")
    options.add_argument("--solved", type=int, default=0, help="motions of the optimiser (%(default)s)")
    given = options.parse_args()
    found = measured(programs(given.seed, given.count, given.solved))
    rows = {
        name: {
            "motions": len(each),
            "deviation": max((one for one, _ in each), default=0.0),
            "promised": max((promised for _, promised in each), default=0.0),
            "kept": all(one <= promised for one, promised in each),
        }
        for name, each in found.items()
    }
    print("| format | motions | largest deviation [rad] | largest promised or stated [rad] | kept by all |")
    print("| --- | --- | --- | --- | --- |")
    for name, row in rows.items():
        kept = "yes" if row["kept"] else "no"
        print(f"| `{name}` | {row['motions']} | {row['deviation']:.1e} | {row['promised']:.1e} | {kept} |")
    write_json(given.json, {"seed": given.seed, "formats": rows})


if __name__ == "__main__":
    on_one_core()
    main()
