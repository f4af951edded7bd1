"""Fit the friction laws to the friction table: `python -m joulepath.models.fit_friction [robot]`
prints the coefficients.

Both laws are members of `joulepath.models.robot.FrictionLaw` with non-negative coefficients, fitted
on relative errors:

- `curved`: least worst error over the table. For a given `speed` that is a linear program in
  coulomb, curved and
  viscous (Boyd and Vandenberghe, Convex Optimization, 6.1.1), so the fit is a search over `speed`
  alone.
- `coulomb_viscous`: least squares with `curved` held at zero.
"""

from __future__ import annotations

import sys

import numpy as np
from scipy.optimize import linprog, minimize_scalar, nnls

from joulepath.models.registry import load_figures
from joulepath.models.robot import Array

# range of `speed` [rad/s]: below it, curved · asinh(v / speed) is almost logarithmic over the
# table, above it linear
LEAST_SPEED, GREATEST_SPEED = 1e-3, 1e1
STARTS = 60


def fit_curved(speed: Array, torque: Array, knee: float) -> tuple[float, float, float, float]:
    """Coefficients coulomb, curved, speed, viscous of one joint, from torque (k,) [N·m] at speed
    (k,) [rad/s].
    """

    def best(log_speed: float) -> tuple[float, Array]:
        bend = np.arcsinh(speed / np.exp(log_speed))
        terms = np.column_stack([speed / np.hypot(speed, knee), bend, speed]) / torque[:, None]
        error = np.ones((speed.size, 1))
        answer = linprog(
            c=[0, 0, 0, 1],
            A_ub=np.block([[terms, -error], [-terms, -error]]),
            b_ub=np.concatenate([np.ones(speed.size), -np.ones(speed.size)]),
            bounds=(0, None),
        )
        assert answer.x is not None, (
            "feasible for any coefficients, as the error is free, and bounded by zero"
        )
        return float(answer.x[3]), np.asarray(answer.x[:3])

    grid = np.linspace(np.log(LEAST_SPEED), np.log(GREATEST_SPEED), STARTS)
    middle = int(np.argmin([best(s)[0] for s in grid]))
    bounds = grid[max(middle - 1, 0)], grid[min(middle + 1, STARTS - 1)]
    found = float(
        minimize_scalar(
            lambda s: best(s)[0], bounds=bounds, method="bounded", options={"xatol": 1e-10}
        ).x
    )
    coulomb, curved, viscous = best(found)[1]
    return float(coulomb), float(curved), float(np.exp(found)), float(viscous)


def fit_coulomb_viscous(
    speed: Array, torque: Array, knee: float
) -> tuple[float, float, float, float]:
    """Coefficients coulomb, curved = 0, speed = 1 (without effect), viscous of one joint; arguments
    as `fit_curved`.
    """
    terms = np.column_stack([speed / np.hypot(speed, knee), speed]) / torque[:, None]
    (coulomb, viscous), _ = nnls(terms, np.ones(speed.size))
    return float(coulomb), 0.0, 1.0, float(viscous)


FITS = {"curved": fit_curved, "coulomb_viscous": fit_coulomb_viscous}


def fit(robot: str) -> dict[str, dict[str, list[float]]]:
    """Coefficients of every law, per joint, to five significant digits."""
    table = load_figures(robot)["friction_table"]
    speed, torque = np.array(table["speed"]["value"]), np.array(table["torque"]["value"])
    laws = {}
    for name, fit_joint in FITS.items():
        joints = np.array([fit_joint(speed, joint, table["knee"]["value"]) for joint in torque])
        columns = zip(("coulomb", "curved", "speed", "viscous"), joints.T, strict=True)
        laws[name] = {part: [float(f"{x:.5g}") for x in values] for part, values in columns}
    return laws


def main() -> None:
    """Print the coefficients."""
    for name, law in fit(sys.argv[1] if len(sys.argv) > 1 else "ur5e").items():
        print(f"{name}:")
        for part, values in law.items():
            print(f"  {part}: {values}")


if __name__ == "__main__":
    main()
