"""Fit capsules to the links: `python -m joulepath.models.fit_capsules ROBOT MESHES [link …]` prints
rows for figures.yaml.

MESHES is a folder as in `joulepath.models.meshes`. The fit starts from the capsules in figures.yaml
and is local: how many capsules a link has, and where each of them begins, is the choice of who
writes the rows.

It minimises ∫ (OFFSET + d) dV over what is inside of a capsule and outside of the link: d [m] is
the distance from the link, so that far overhang costs most. What lies inside of an adjacent link at
every angle of the joint costs nothing, as nothing else can be there. Samples of the surfaces
outside of all capsules are penalised. Both are smoothed, more and more sharply. Radii then grow
until every triangle is held: see `capsule_cover`.
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
from joulepath.models.registry import load_robot
from joulepath.models.robot import Array, LinkCapsule, Mask, Robot

# edge of a grid cell, and how far [m] from the link overhang is weighed
CELL, REACH = 0.003, 0.08
OFFSET = 0.002
# smoothing [m] and weight of the penalty of each stage, and its most iterations
STAGES = (
    (0.004, 1e-2, 40),
    (0.002, 5e-2, 40),
    (0.001, 3e-1, 60),
    (0.001, 3e-1, 60),
    (0.001, 3e-1, 60),
)
# surface samples stay this far inside [m]; what the last stage leaves outside is mended by larger
# radii
INSIDE = 3e-4
# unit of the variables [m]: the first step of the solver is of length 1
UNIT = 0.004
LEAST_RADIUS, GREATEST_RADIUS = 0.015, 0.15
SURFACE_SAMPLES, CHECKED_SAMPLES, CELLS, TURNS = 1500, 100_000, 6000, 36
# the last digit of the figures [m]
DIGIT = 1e-4


@dataclass(frozen=True)
class _Solid:
    """A link on a grid: lowest corner [m], cells inside of its surfaces, distance [m] of every cell
    from the link.
    """

    corner: Array
    is_inside: Mask
    distance: Array

    def contains(self, points: Array) -> Mask:
        """Whether points (k, 3) [m] are in a cell inside."""
        index = np.floor((points - self.corner) / CELL).astype(int)
        in_grid = ((index >= 0) & (index < self.is_inside.shape)).all(axis=1)
        found = np.zeros(len(points), dtype=bool)
        found[in_grid] = self.is_inside[tuple(index[in_grid].T)]
        return found


@dataclass(frozen=True)
class _Task:
    """What the fit sees of a link: cells (c, 3) [m] outside, their weights (c,), and points of
    surfaces (p, 3) [m].
    """

    cells: Array
    weights: Array
    points: Array


def fit(robot: Robot, folder: Path, link: int) -> list[LinkCapsule]:
    """Capsules that hold the link, from those that the robot has."""
    rng = np.random.default_rng(0)
    surfaces = list(link_surfaces(folder, robot.name, link).values())
    checked = _outermost(
        np.vstack([sampled(each, CHECKED_SAMPLES, rng) for each in surfaces]), surfaces
    )
    task = replace(
        _weighed(robot, folder, link, rng),
        points=checked[rng.choice(len(checked), SURFACE_SAMPLES)],
    )
    z = np.array([[*c.axis.ravel(), c.radius] for c in robot.capsules if c.link == link]).ravel()
    lower, upper = (np.tile([*[far] * 6, radius], len(z) // 7) / UNIT for far, radius in _RANGES)
    bounds = Bounds(lower, upper)
    for width, penalty, most in STAGES:
        found = minimize(
            _cost,
            z / UNIT,
            (task, width, penalty),
            "L-BFGS-B",
            jac=True,
            bounds=bounds,
            options={"maxiter": most},
        )
        z = found.x * UNIT
        missed = checked[outside(checked, _capsules(z, link)).min(axis=0) > -INSIDE]
        task = replace(
            task, points=np.vstack([task.points, missed[rng.permutation(len(missed))[:1000]]])
        )
    capsules = _capsules(z, link)
    for _ in range(2):
        # where one had to grow, another may be larger than it has to be
        capsules = _grown(_rounded(capsules, checked), np.concatenate(surfaces))
    return capsules


_RANGES = ((-1.0, LEAST_RADIUS), (1.0, GREATEST_RADIUS))


def _weighed(robot: Robot, folder: Path, link: int, rng: np.random.Generator) -> _Task:
    """The cells around a link that may be in collision, each with OFFSET + distance, times its
    volume.
    """
    solid = _solid(folder, robot, link)
    index = np.argwhere((solid.distance > 0) & (solid.distance < REACH))
    cells, distance = solid.corner + (index + 0.5) * CELL, solid.distance[tuple(index.T)]
    placements = [placement.homogeneous for placement in robot.model.jointPlacements]
    is_free = np.ones(len(cells), dtype=bool)
    # not the last link: a tool may reach into its capsule, and is compared with the link before it
    for other in {link - 1, link + 1} & set(range(robot.nq)):
        neighbour, always = _solid(folder, robot, other), np.ones(len(cells), dtype=bool)
        for angle in np.linspace(0, 2 * np.pi, TURNS, endpoint=False):
            turned = placements[max(link, other)] @ _about_z(angle)
            T = turned if other < link else np.linalg.inv(turned)
            always &= neighbour.contains(cells @ T[:3, :3].T + T[:3, 3])
        is_free &= ~always
    chosen = rng.permutation(np.flatnonzero(is_free))[:CELLS]
    volume = CELL**3 * is_free.sum() / len(chosen)
    return _Task(cells[chosen], (OFFSET + distance[chosen]) * volume, np.empty((0, 3)))


def _solid(folder: Path, robot: Robot, link: int) -> _Solid:
    """The grid of a link: inside is what the outside does not reach through its surfaces."""
    rng = np.random.default_rng(0)
    surfaces = link_surfaces(folder, robot.name, link).values()
    points = np.vstack(
        [np.vstack([sampled(each, 1_000_000, rng), each.reshape(-1, 3)]) for each in surfaces]
    )
    corner = points.min(axis=0) - REACH - 2 * CELL
    is_wall = np.zeros(
        np.ceil((points.max(axis=0) + REACH + 2 * CELL - corner) / CELL).astype(int), dtype=bool
    )
    is_wall[tuple(((points - corner) / CELL).astype(int).T)] = True
    parts = label(~is_wall)[0]
    is_outside = parts == parts[0, 0, 0]
    return _Solid(corner, ~is_outside, distance_transform_edt(is_outside) * CELL)


def _outermost(points: Array, surfaces: list[Array]) -> Array:
    """The points (k, 3) without those that a coarse grid shows to be deep inside: most of a
    detailed mesh is.
    """
    corner = np.concatenate(surfaces).reshape(-1, 3).min(axis=0) - 4 * CELL
    index = ((points - corner) / CELL).astype(int)
    is_wall = np.zeros(index.max(axis=0) + 5, dtype=bool)
    is_wall[tuple(index.T)] = True
    parts = label(~is_wall)[0]
    return np.asarray(points[binary_dilation(parts == parts[0, 0, 0])[tuple(index.T)]])


def _cost(scaled: Array, task: _Task, width: float, penalty: float) -> tuple[float, Array]:
    """Weighed overhang [cm³ · m] and penalty, and the gradient in the scaled variables: two ends
    and a radius each.
    """
    rows = (scaled * UNIT).reshape(-1, 7)
    gradient = np.zeros_like(rows)
    depth, pull = _nearest(rows, task.cells)
    share = 1 / (1 + np.exp(np.clip(depth / width, -40, 40)))
    pull(gradient, -task.weights * share * (1 - share) / width)
    out, pull = _nearest(rows, task.points)
    excess = np.maximum(out + INSIDE, 0)
    pull(gradient, 2 * penalty * excess)
    value = float(task.weights @ share + penalty * (excess @ excess))
    return 1e6 * value, 1e6 * UNIT * gradient.ravel()


def _nearest(rows: Array, points: Array) -> tuple[Array, _Pull]:
    """Signed distance (k,) [m] of points (k, 3) from the nearest capsule, and what adds its
    gradients.
    """
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
    """Directions from the nearest capsules to points, and where along their axes."""

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
    """Axes to DIGIT, and each radius in turn as small as the samples (k, 3) [m] that no other
    capsule holds allow.

    A sample that no capsule holds belongs to the nearest.
    """
    result = [replace(c, axis=np.round(c.axis / DIGIT) * DIGIT + 0.0) for c in capsules]
    for k, capsule in enumerate(result):
        distances = outside(samples, result)
        is_own = (np.delete(distances, k, axis=0) > 0).all(axis=0) & (distances.argmin(axis=0) == k)
        reach = capsule.radius + float(distances[k, is_own].max(initial=-capsule.radius))
        result[k] = replace(capsule, radius=_up(max(reach, LEAST_RADIUS)))
    return result


def _grown(capsules: list[LinkCapsule], triangles: Array) -> list[LinkCapsule]:
    """The capsules, with radii grown until they hold every triangle (t, 3, 3) [m]."""
    result, missed = list(capsules), not_held(triangles, capsules)
    while len(missed):
        distances = outside(missed.reshape(-1, 3), result)
        least, nearest = distances.min(axis=0), distances.argmin(axis=0)
        for k in set(nearest.tolist()):
            # a piece whose corners all are inside lies where capsules only touch
            growth = max(float(least[nearest == k].max()), DIGIT)
            result[k] = replace(result[k], radius=_up(result[k].radius + growth))
        # what was held is held by larger capsules, too
        missed = not_held(missed, result)
    return result


def _up(radius: float) -> float:
    return float(np.ceil(radius / DIGIT - 1e-6) * DIGIT)


def _about_z(angle: float) -> Array:
    return np.asarray(pin.SE3(pin.utils.rotate("z", angle), np.zeros(3)).homogeneous)


def main() -> None:
    """Prints the rows of the links named, or of all."""
    robot, folder = load_robot(sys.argv[1]), Path(sys.argv[2])
    for name in sys.argv[3:] or robot.link_names:
        print(f"  {name}:\n    value:")
        for capsule in fit(robot, folder, robot.link_names.index(name)):
            print(
                f"      - [{', '.join(f'{x:.4f}' for x in [*capsule.axis.ravel(), capsule.radius])}]",  # noqa: E501
                flush=True,
            )


if __name__ == "__main__":
    main()
