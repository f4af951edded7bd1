"""Comparison of the three tables of the paper with this model.

    python -m benchmarks.paper            # prints the tables
    python -m benchmarks.paper --write    # also writes the tables into docs/explained/paper.md

`tests/reference/README.md` names the paper. Its joint convention differs from that of Universal
Robots: see `to_ur`.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.stats import spearmanr

from joulepath import Problem, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.evaluate.evaluate import evaluate
from joulepath.optimizer.evaluate.evaluation import Evaluation
from joulepath.optimizer.evaluate.recording import Waypoints
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.robots import load_robot

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "explained" / "paper.md"
BEGIN = "<!-- made by python -m benchmarks.paper --write -->"
END = "<!-- end of what it made -->"
REFERENCE = ROOT / "tests" / "reference"

SECONDS = 1.5
"""Duration of the motion from home to a configuration, and of the motion back [s]."""
TOLERANCE = 0.10
"""Largest relative deviation from a common factor at which a row of Table 3 is proportional to our
power [1]."""

# a, d [m] and alpha [rad] from Universal Robots, "DH parameters for calculations of kinematics and
# dynamics"
ALPHA = (np.pi / 2, 0, 0, np.pi / 2, -np.pi / 2, 0)
UR5 = ((0, -0.425, -0.39225, 0, 0, 0), (0.089159, 0, 0, 0.10915, 0.09465, 0.0823))
UR5E = ((0, -0.425, -0.3922, 0, 0, 0), (0.1625, 0, 0, 0.1333, 0.0997, 0.0996))
# the same source: masses of the UR5's moving links [kg]
UR5_MASSES = np.array([3.7, 8.393, 2.33, 1.219, 1.219, 0.1879])


def table(name: str) -> Array:
    """The numbers of a table of the paper."""
    return np.asarray(
        np.loadtxt(REFERENCE / f"paper_{name}.csv", delimiter=",", skiprows=1), dtype=float
    )


def to_ur(degrees: Array) -> Array:
    """Joint positions (6,) of the paper [deg] in the convention of Universal Robots [rad].

    Joint 6 changes neither positions nor power here; its convention follows from the orientations
    in Table 1.
    """
    q1, q2, q3, q4, q5, q6 = degrees
    return np.radians([q1, q2 - 90, 90 - q3, -90 - q4, 180 - q5, 180 - q6])


HOME = to_ur(np.zeros(6))


@cache
def configurations() -> Array:
    """Table 2 (15, 6) in the convention of Universal Robots [rad]."""
    return np.array([to_ur(row) for row in table("table2_configurations")])


def there_and_back(arm: Arm, q: Array) -> Evaluation:
    """The motion of the paper at constant joint speed: from home to q (6,) [rad] and back."""
    return evaluate(arm, Waypoints(np.array([HOME, q, HOME]), np.array(SECONDS), "linear"))


def powers(arm: Arm) -> Array:
    """Mean mechanical power (15,) [W] of the motions of the paper in our model."""
    return np.array([there_and_back(arm, q).total.mean_mechanical_power for q in configurations()])


def older_links() -> Array:
    """Factors (6,) from the link masses of the UR5e to those of the UR5."""
    inertias = load_robot("ur5e").model.inertias
    return np.asarray(UR5_MASSES / np.array([body.mass for body in inertias][1:]))


@dataclass(frozen=True)
class Agreement:
    """Agreement of Table 3 with our powers: rank correlation, and the common factor of the most
    rows within TOLERANCE.
    """

    rank_correlation: float
    factor: float
    rows: int
    needed: float

    @staticmethod
    def of(ours: Array, theirs: Array) -> Agreement:
        """Tries every factor at which a row enters or leaves the tolerance.

        `needed` is the tolerance with which twelve rows have a common factor.
        """
        ratios = theirs / ours
        # a slack of 1e-9 includes rows on the edge of the tolerance
        factors = np.concatenate([ratios / (1 - TOLERANCE), ratios / (1 + TOLERANCE)])
        inside = [
            int((np.abs(ratios / factor - 1) <= TOLERANCE * (1 + 1e-9)).sum()) for factor in factors
        ]
        best = np.flatnonzero(np.array(inside) == max(inside))
        # twelve consecutive ratios in ascending order, with the factor in their middle
        order = np.sort(ratios)
        low, high = order[:-11], order[11:]
        return Agreement(
            float(spearmanr(ours, theirs).statistic),
            float(np.median(factors[best])),
            max(inside),
            float(((high - low) / (high + low)).min()),
        )


def forward(geometry: tuple[Sequence[float], Sequence[float]], q: Array) -> Array:
    """T_base_flange (4, 4) by Denavit-Hartenberg parameters a [m] and d [m]."""
    T = np.eye(4)
    for a, d, alpha, angle in zip(*geometry, ALPHA, q, strict=True):
        c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
        T = T @ np.array(
            [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    return T


def poses() -> list[Array]:
    """Table 1 as matrices (4, 4)."""
    found = []
    for x, y, z, roll, pitch, yaw in table("table1_poses"):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = pin.rpy.rpyToMatrix(roll, pitch, yaw), (x, y, z)
        found.append(T)
    return found


def _rows(cells: Callable[[int], list[str]]) -> list[str]:
    return ["| " + " | ".join([str(k + 1), *cells(k)]) + " |" for k in range(15)]


def _head(*names: str) -> list[str]:
    return ["| " + " | ".join(names) + " |", "| " + " | ".join(["---:"] * len(names)) + " |"]


def table_1() -> list[str]:
    """Table 1, and the poses of the configurations of Table 2 with the geometries of UR5 and
    UR5e."""
    asked = poses()
    reached = {
        name: [forward(geometry, q) for q in configurations()]
        for name, geometry in (("UR5", UR5), ("UR5e", UR5E))
    }
    errors = {
        name: np.array([T[:3, 3] - A[:3, 3] for T, A in zip(found, asked, strict=True)])
        for name, found in reached.items()
    }

    def cells(k: int) -> list[str]:
        x, y, z, roll, pitch, yaw = table("table1_poses")[k]
        turned = float(
            np.degrees(np.linalg.norm(pin.log3(asked[k][:3, :3].T @ reached["UR5"][k][:3, :3])))
        )
        away = [f"{1000 * np.linalg.norm(errors[name][k]):.1f}" for name in ("UR5", "UR5e")]
        return [f"{x:g}, {y:g}, {z:g}", f"{roll:g}, {pitch:g}, {yaw:g}", *away, f"{turned:.2f}"]

    lines = _head(
        "",
        "position [m]",
        "roll, pitch, yaw [rad]",
        "UR5: away [mm]",
        "UR5e: away [mm]",
        "turned [°]",
    ) + _rows(cells)
    for name, error in errors.items():
        offset = 1000 * error.mean(axis=0)
        spread = 1000 * float(np.sqrt(((error - error.mean(axis=0)) ** 2).sum(axis=1).mean()))
        lines += [
            "",
            f"With the {name}'s geometry the offset common to all rows is "
            f"({', '.join(f'{part:.1f}' for part in offset)}) mm; {spread:.1f} mm RMS remain "
            "around it.",
        ]
    return lines


def table_2() -> list[str]:
    """Table 2, and the nearest configurations that reach the poses of Table 1 exactly."""
    robot = load_robot("ur5e")
    solver = required_inverse_kinematics(robot, "pose")

    def text(angles: Array) -> str:
        return ", ".join(f"{angle:.1f}" for angle in np.degrees(angles))

    def cells(k: int) -> list[str]:
        q = configurations()[k]
        solutions = solver.solve(poses()[k])
        # configurations with a difference of full turns count as equal
        apart = [wrapped(solution.q - q) for solution in solutions]
        best = int(np.argmin([np.abs(each).max() for each in apart]))
        branch = str(solutions[best].label).split(" ")[0]
        return [
            text(q),
            text(q + apart[best]),
            branch,
            f"{np.degrees(np.abs(apart[best]).max()):.1f}",
        ]

    names = (
        "paper, in UR's convention [°]",
        "ours: exact for the UR5e [°]",
        "branch",
        "largest difference [°]",
    )
    return _head("", *names) + _rows(cells)


def table_3() -> list[str]:
    """Table 3, our mean powers, and their ratios."""
    theirs = table("table3_power")[:, 1]
    arms = {
        "UR5e": powers(Arm(robot=load_robot("ur5e"))),
        "UR5": powers(Arm(robot=load_robot("ur5e"), link_mass_scale=older_links())),
    }
    agreements = {name: Agreement.of(ours, theirs) for name, ours in arms.items()}

    def cells(k: int) -> list[str]:
        found = [f"{theirs[k]:g}"]
        for name, ours in arms.items():
            ratio = theirs[k] / ours[k]
            inside = abs(ratio / agreements[name].factor - 1) <= TOLERANCE * (1 + 1e-9)
            found += [f"{ours[k]:.2f}", f"{ratio:.1f}", "yes" if inside else "no"]
        return found

    lines = _head(
        "",
        'paper ["W"]',
        "UR5e: mean [W]",
        "ratio",
        "within 10 %",
        "UR5's link masses: mean [W]",
        "ratio",
        "within 10 %",
    ) + _rows(cells)
    for name, words in (("UR5e", "With the UR5e's links"), ("UR5", "With the UR5's link masses")):
        agreement = agreements[name]
        lines += [
            "",
            f"{words}: Spearman's rank correlation {agreement.rank_correlation:.4f}; "
            f"{agreement.rows} rows within 10 % of the factor {agreement.factor:.1f}; twelve rows "
            f"within {100 * agreement.needed:.1f} % of one factor.",
        ]
    return lines


def savings() -> list[str]:
    """Energies of the motions to all configurations: of the paper, ours, and of the controller by
    default."""

    def saved(ours: float, theirs: float) -> str:
        return f"{100 * (1 - ours / theirs):.1f}"

    def cells(k: int) -> list[str]:
        q = configurations()[k]
        there = there_and_back(Arm(robot=load_robot("ur5e")), q).segments[0]
        solution = optimize(
            Problem(arm=Arm(robot=load_robot("ur5e")), start=HOME, goal=q, windings=False)
        )
        default = next(each for each in solution.baselines if each.name == "controller_default")
        linear, ours = there.energy, solution.energy
        return [
            *(
                f"{each:.1f}"
                for each in (linear.electrical.total, linear.mechanical.total, there.kinetic_start)
            ),
            f"{default.electrical:.1f}",
            f"{solution.duration:.2f}",
            *(f"{each:.1f}" for each in (ours.electrical.total, ours.mechanical.total)),
            saved(ours.electrical.total, linear.electrical.total),
            saved(ours.mechanical.total, linear.mechanical.total),
            saved(ours.electrical.total, default.electrical),
        ]

    names = (
        "linear, 1.5 s: electrical [J]",
        "mechanical [J]",
        "kinetic energy at its start [J]",
        "`movej` by default: electrical [J]",
        "ours: duration [s]",
        "electrical [J]",
        "mechanical [J]",
        "saved on linear, electrical [%]",
        "mechanical [%]",
        "saved on `movej`, electrical [%]",
    )
    return _head("", *names) + _rows(cells)


def made() -> str:
    """All tables as Markdown."""
    parts = {
        "Table 1: poses": table_1(),
        "Table 2: configurations": table_2(),
        "Table 3: power": table_3(),
        "The same moves, optimised": savings(),
    }
    return "\n\n".join(f"## {title}\n" + "\n".join(lines) for title, lines in parts.items())


def page(text: str, tables: str) -> str:
    """The page with new tables. Raises ValueError if a marker is missing."""
    head, rest = text.split(BEGIN, 1)
    _, tail = rest.split(END, 1)
    return f"{head}{BEGIN}\n{tables}\n{END}{tail}"


def main() -> None:
    """Prints the tables, and writes them into the page if asked to."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--write", action="store_true", help="also write the tables into the page")
    write = parser.parse_args().write
    tables = made()
    print(tables)
    if write:
        PAGE.write_text(page(PAGE.read_text(), tables))


if __name__ == "__main__":
    main()
