"""Fit capsules to the links: `python -m joulepath.models.fit_capsules ROBOT MESHES [link …]` prints
rows for figures.yaml.

MESHES is a folder as in `joulepath.models.meshes`. The fit is local and starts from the capsules in
figures.yaml: the author of the rows chooses their number and first positions.

The objective is ∫ (offset + d) dV over the volume inside a capsule and outside the link, where d
[m] is the distance from the link. Volume inside an adjacent link at every joint angle is free of
charge, since no obstacle can be there. Surface samples outside all capsules are penalised. Both
terms are smoothed with decreasing width. Finally radii grow until every triangle is covered: see
`capsule_cover`.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from scipy.ndimage import binary_dilation, distance_transform_edt, label
from scipy.optimize import Bounds, minimize

from joulepath.models.capsule_cover import not_held, outside
from joulepath.models.meshes import link_surfaces, sampled
from joulepath.models.registry import bundled_robot
from joulepath.models.robot import Array, LinkCapsule, Mask, Robot


@dataclass(frozen=True)
class Stage:
    """One stage of the fit."""

    width: float
    """Smoothing length [m]."""
    penalty: float
    """Weight of uncovered samples."""
    iterations: int
    """Most iterations."""


@dataclass(frozen=True)
class FitSettings:
    """Settings of the fit."""

    cell: float = 0.003
    """Edge of a grid cell [m]."""
    reach: float = 0.08
    """Distance from the link [m] up to which overhang is weighted."""
    offset: float = 0.002
    """Weight of overhang at distance zero [m]."""
    stages: tuple[Stage, ...] = (
        Stage(0.004, 1e-2, 40),
        Stage(0.002, 5e-2, 40),
        *[Stage(0.001, 3e-1, 60)] * 3,
    )
    inside: float = 3e-4
    """Depth of the surface samples below the capsules' surfaces [m]; larger radii mend the rest."""
    unit: float = 0.004
    """Unit of the variables [m], the length of the solver's first step."""
    least_radius: float = 0.015
    """Least radius [m]."""
    greatest_radius: float = 0.15
    """Greatest radius [m]."""
    surface_samples: int = 1500
    """Surface samples of the first stage."""
    checked_samples: int = 100_000
    """Surface samples from which uncovered ones are added after each stage."""
    cells: int = 6000
    """Random grid cells."""
    turns: int = 36
    """Angles of a joint at which an adjacent link is placed."""
    digit: float = 1e-4
    """Last digit of the figures [m]."""


FIT = FitSettings()


@dataclass(frozen=True)
class _Solid:
    """A link on a grid: lowest corner [m], cells inside its surfaces, distances [m] of all
    cells."""

    corner: Array
    is_inside: Mask
    distance: Array

    def contains(self, points: Array) -> Mask:
        """Whether points (k, 3) [m] are in a cell inside."""
        index = np.floor((points - self.corner) / FIT.cell).astype(int)
        in_grid = ((index >= 0) & (index < self.is_inside.shape)).all(axis=1)
        found = np.zeros(len(points), dtype=bool)
        found[in_grid] = self.is_inside[tuple(index[in_grid].T)]
        return found


@dataclass(frozen=True)
class _Task:
    """Data of the fit: cells (c, 3) [m] outside, their weights (c,), surface points (p, 3) [m]."""

    cells: Array
    weights: Array
    points: Array


def fit(robot: Robot, folder: Path, link: int) -> list[LinkCapsule]:
    """Capsules covering a link, by a fit from the capsules of the robot."""
    rng = np.random.default_rng(0)
    surfaces = list(link_surfaces(folder, robot.name, link).values())
    checked = _outermost(
        np.vstack([sampled(each, FIT.checked_samples, rng) for each in surfaces]), surfaces
    )
    task = replace(
        _weighed(robot, folder, link, rng),
        points=checked[rng.choice(len(checked), FIT.surface_samples)],
    )
    z = np.array([[*c.axis.ravel(), c.radius] for c in robot.capsules if c.link == link]).ravel()
    lower, upper = (
        np.tile([*[far] * 6, radius], len(z) // 7) / FIT.unit for far, radius in _RANGES
    )
    bounds = Bounds(lower, upper)
    for stage in FIT.stages:
        found = minimize(
            _cost,
            z / FIT.unit,
            (task, stage.width, stage.penalty),
            "L-BFGS-B",
            jac=True,
            bounds=bounds,
            options={"maxiter": stage.iterations},
        )
        z = found.x * FIT.unit
        missed = checked[outside(checked, _capsules(z, link)).min(axis=0) > -FIT.inside]
        task = replace(
            task, points=np.vstack([task.points, missed[rng.permutation(len(missed))[:1000]]])
        )
    capsules = _capsules(z, link)
    for _ in range(2):
        # After one capsule has grown, another may be larger than necessary.
        capsules = _grown(_rounded(capsules, checked), np.concatenate(surfaces))
    return capsules


_RANGES = ((-1.0, FIT.least_radius), (1.0, FIT.greatest_radius))


def _weighed(robot: Robot, folder: Path, link: int, rng: np.random.Generator) -> _Task:
    """Cells around a link in which an obstacle may be, weighted by (offset + distance) · volume."""
    solid = _solid(folder, robot, link)
    index = np.argwhere((solid.distance > 0) & (solid.distance < FIT.reach))
    cells, distance = solid.corner + (index + 0.5) * FIT.cell, solid.distance[tuple(index.T)]
    placements = [placement.homogeneous for placement in robot.model.jointPlacements]
    is_free = np.ones(len(cells), dtype=bool)
    # The last link does not count: a tool, which may reach into it, is checked against the link
    # before.
    for other in {link - 1, link + 1} & set(range(robot.nq)):
        neighbour, always = _solid(folder, robot, other), np.ones(len(cells), dtype=bool)
        for angle in np.linspace(0, 2 * np.pi, FIT.turns, endpoint=False):
            turned = placements[max(link, other)] @ _about_z(angle)
            T = turned if other < link else np.linalg.inv(turned)
            always &= neighbour.contains(cells @ T[:3, :3].T + T[:3, 3])
        is_free &= ~always
    chosen = rng.permutation(np.flatnonzero(is_free))[: FIT.cells]
    volume = FIT.cell**3 * is_free.sum() / len(chosen)
    return _Task(cells[chosen], (FIT.offset + distance[chosen]) * volume, np.empty((0, 3)))


def _solid(folder: Path, robot: Robot, link: int) -> _Solid:
    """The grid of a link: cells not connected to the outside are inside."""
    rng = np.random.default_rng(0)
    surfaces = link_surfaces(folder, robot.name, link).values()
    points = np.vstack(
        [np.vstack([sampled(each, 1_000_000, rng), each.reshape(-1, 3)]) for each in surfaces]
    )
    corner = points.min(axis=0) - FIT.reach - 2 * FIT.cell
    is_wall = np.zeros(
        np.ceil((points.max(axis=0) + FIT.reach + 2 * FIT.cell - corner) / FIT.cell).astype(int),
        dtype=bool,
    )
    is_wall[tuple(((points - corner) / FIT.cell).astype(int).T)] = True
    parts = label(~is_wall)[0]
    is_outside = parts == parts[0, 0, 0]
    return _Solid(corner, ~is_outside, distance_transform_edt(is_outside) * FIT.cell)


def _outermost(points: Array, surfaces: list[Array]) -> Array:
    """Points (k, 3) near the outside by a coarse grid: most of a detailed mesh is deep inside."""
    corner = np.concatenate(surfaces).reshape(-1, 3).min(axis=0) - 4 * FIT.cell
    index = ((points - corner) / FIT.cell).astype(int)
    is_wall = np.zeros(index.max(axis=0) + 5, dtype=bool)
    is_wall[tuple(index.T)] = True
    parts = label(~is_wall)[0]
    return np.asarray(points[binary_dilation(parts == parts[0, 0, 0])[tuple(index.T)]])


def _cost(scaled: Array, task: _Task, width: float, penalty: float) -> tuple[float, Array]:
    """Weighted overhang [cm³ · m] plus penalty, and its gradient in the scaled variables.

    The variables of a capsule are both ends of its axis and the radius.
    """
    rows = (scaled * FIT.unit).reshape(-1, 7)
    gradient = np.zeros_like(rows)
    depth, pull = _nearest(rows, task.cells)
    share = 1 / (1 + np.exp(np.clip(depth / width, -40, 40)))
    pull(gradient, -task.weights * share * (1 - share) / width)
    out, pull = _nearest(rows, task.points)
    excess = np.maximum(out + FIT.inside, 0)
    pull(gradient, 2 * penalty * excess)
    value = float(task.weights @ share + penalty * (excess @ excess))
    return 1e6 * value, 1e6 * FIT.unit * gradient.ravel()


def _nearest(rows: Array, points: Array) -> tuple[Array, _Pull]:
    """Signed distance (k,) [m] of points (k, 3) from the nearest capsule, and its derivative."""
    distance, toward, share = np.empty((len(rows), len(points))), [], []
    for k, row in enumerate(rows):
        begin, along = row[:3], row[3:6] - row[:3]
        from_begin = points - begin
        part = np.clip(from_begin @ along / max(float(along @ along), 1e-18), 0.0, 1.0)
        away = from_begin - part[:, None] * along
        length = np.linalg.norm(away, axis=1)
        distance[k] = length - row[6]
        toward.append(away / np.maximum(length, 1e-12)[:, None])
        share.append(part[:, None])
    return distance.min(axis=0), _Pull(distance.argmin(axis=0), toward, share)


@dataclass(frozen=True)
class _Pull:
    """Derivative of the distances: directions from the nearest capsules, shares along their
    axes."""

    nearest: npt.NDArray[np.intp]
    toward: list[Array]
    share: list[Array]

    def __call__(self, gradient: Array, weight: Array) -> None:
        """Add Σ weight · ∂distance/∂row, for weights (k,), to the gradient (m, 7)."""
        for k, (toward, share) in enumerate(zip(self.toward, self.share, strict=True)):
            own = self.nearest == k
            pull = toward[own] * weight[own, None]
            gradient[k, :3] -= (pull * (1 - share[own])).sum(axis=0)
            gradient[k, 3:6] -= (pull * share[own]).sum(axis=0)
            gradient[k, 6] -= weight[own].sum()


def _capsules(z: Array, link: int) -> list[LinkCapsule]:
    return [LinkCapsule(link, row[:6].reshape(2, 3), float(row[6])) for row in z.reshape(-1, 7)]


def _rounded(capsules: list[LinkCapsule], samples: Array) -> list[LinkCapsule]:
    """Capsules with rounded axes and least radii.

    Radii shrink in turn as far as samples (k, 3) [m] outside all other capsules allow. An uncovered
    sample belongs to the nearest capsule.
    """
    result = [replace(c, axis=np.round(c.axis / FIT.digit) * FIT.digit + 0.0) for c in capsules]
    for k, capsule in enumerate(result):
        distances = outside(samples, result)
        is_own = (np.delete(distances, k, axis=0) > 0).all(axis=0) & (distances.argmin(axis=0) == k)
        reach = capsule.radius + float(distances[k, is_own].max(initial=-capsule.radius))
        result[k] = replace(capsule, radius=_up(max(reach, FIT.least_radius)))
    return result


def _grown(capsules: list[LinkCapsule], triangles: Array) -> list[LinkCapsule]:
    """The capsules with radii grown until they cover all triangles (t, 3, 3) [m]."""
    result, missed = list(capsules), not_held(triangles, capsules)
    while len(missed):
        distances = outside(missed.reshape(-1, 3), result)
        least, nearest = distances.min(axis=0), distances.argmin(axis=0)
        for k in set(nearest.tolist()):
            # A piece with all corners inside lies where two capsules touch.
            growth = max(float(least[nearest == k].max()), FIT.digit)
            result[k] = replace(result[k], radius=_up(result[k].radius + growth))
        # Larger capsules still cover all pieces covered before.
        missed = not_held(missed, result)
    return result


def _up(radius: float) -> float:
    return float(np.ceil(radius / FIT.digit - 1e-6) * FIT.digit)


def _about_z(angle: float) -> Array:
    return np.asarray(pin.SE3(pin.utils.rotate("z", angle), np.zeros(3)).homogeneous)


def main() -> None:
    """Print the rows of the given links, or of all links."""
    robot, folder = bundled_robot(sys.argv[1]), Path(sys.argv[2])
    for name in sys.argv[3:] or robot.link_names:
        print(f"  {name}:\n    value:")
        for capsule in fit(robot, folder, robot.link_names.index(name)):
            row = ", ".join(f"{x:.4f}" for x in [*capsule.axis.ravel(), capsule.radius])
            print(f"      - [{row}]", flush=True)


if __name__ == "__main__":
    main()
