"""Pairs of links whose shapes overlap in nearly every configuration.

Checking such a pair would make every motion a collision.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import coal
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

from joulepath.models.hull_cover import HULL_FIT
from joulepath.models.own_arm.link_shapes import Cover
from joulepath.models.own_arm.upright import UprightChain, turn_onto
from joulepath.models.own_arm.urdf_chain import Chain
from joulepath.models.robot import Array
from joulepath.models.uploads.limits import Checkpoint


@dataclass(frozen=True)
class OverlapSettings:
    """Settings of the search for overlapping pairs."""

    samples: int = 300
    """Random configurations."""
    share: float = 0.95
    """Least share of overlapping configurations of an excluded pair."""
    guessed_share: float = 0.3
    """The same for a pair with a guessed capsule: a maker would not build joint ranges in which
    links collide this often, so that the guess is too thick."""
    doubtful_share: float = 0.3
    """Least share of overlapping configurations of a pair that is compared, and named: its shapes
    are likely too thick beside a joint. In the bundled arms, pairs that can meet do so in at most
    20 %."""
    rounding: float = 1e-9
    """Margin of the bounding balls [m] for rounding."""


OVERLAP = OverlapSettings()


@dataclass(frozen=True)
class MeetingPairs:
    """Pairs of links, as their numbers, by how often their shapes overlap."""

    excluded: list[list[int]]
    """In nearly every configuration: they are not compared."""
    doubtful: list[list[int]]
    """Often: they are compared, and may leave hardly a motion free."""


def pairs_that_meet(
    chain: Chain,
    upright: UprightChain,
    covers: list[Cover],
    guessed: list[bool],
    checkpoint: Checkpoint,
) -> MeetingPairs:
    """Pairs of non-adjacent links whose shapes overlap in many random configurations.

    Args:
        chain: the joints and their ranges.
        upright: the frames of the links.
        covers: shapes of every link, base first.
        guessed: whether the capsules of a link are an assumption.
        checkpoint: ends the computation by an exception.
    """
    pairs = [(a, b) for a, b in combinations(range(len(covers)), 2) if a + 1 < b]
    meets = np.zeros(len(pairs))
    shapes = [_shapes(cover) for cover in covers]
    frames = [
        _frames(chain, upright, q)
        for q in np.random.default_rng(0).uniform(
            chain.q_min, chain.q_max, (OVERLAP.samples, chain.nq)
        )
    ]
    balls = [_balls(cover, [each[k] for each in frames]) for k, cover in enumerate(covers)]
    request = coal.CollisionRequest()
    for k, (a, b) in enumerate(pairs):
        met = set[int]()
        for sample, i, j in _close(balls[a], balls[b]):
            checkpoint()
            (first, of_a), (second, of_b) = shapes[a][i], shapes[b][j]
            if sample not in met and coal.collide(
                first,
                _pose(frames[sample][a] * of_a),
                second,
                _pose(frames[sample][b] * of_b),
                request,
                coal.CollisionResult(),
            ):
                met.add(sample)
        meets[k] = len(met)
    found = MeetingPairs([], [])
    for (a, b), share in zip(pairs, meets / OVERLAP.samples, strict=True):
        if share >= (OVERLAP.guessed_share if guessed[a] or guessed[b] else OVERLAP.share):
            found.excluded.append([a, b])
        elif share >= OVERLAP.doubtful_share:
            found.doubtful.append([a, b])
    return found


def _frames(chain: Chain, upright: UprightChain, q: Array) -> list[pin.SE3]:
    """Placements of the links in the base at a configuration (nq,), base first."""
    frames = [pin.SE3.Identity()]
    for angle, placement in zip(chain.coupling.positions(q), upright.placements, strict=True):
        turn = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, angle), np.zeros(3))
        frames.append(frames[-1] * placement * turn)
    return frames


def _shapes(cover: Cover) -> list[tuple[coal.ShapeBase, pin.SE3]]:
    """The shapes by which a link is compared, with their poses in its frame."""
    if not cover.hulls:
        return [(coal.Capsule(row[6], _length(row)), _middle(row)) for row in cover.capsules]
    found = []
    for points in cover.hulls:
        # SciPy's hull, because Coal's ends the process for points that it considers flat
        corners, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
        corners.extend(np.array(points))
        faces.extend(coal.Triangle(*face) for face in ConvexHull(points).simplices.tolist())
        hull = coal.Convex(corners, faces)
        hull.setSweptSphereRadius(HULL_FIT.radius)
        found.append((hull, pin.SE3.Identity()))
    return found


def _balls(cover: Cover, frames: list[pin.SE3]) -> tuple[Array, Array]:
    """Centres (samples, n, 3) in the base and radii (n,) [m] of the balls around the shapes of a
    link."""
    points = cover.hulls or [[row[:3], row[3:6]] for row in cover.capsules]
    grown = [HULL_FIT.radius] * len(points) if cover.hulls else [row[6] for row in cover.capsules]
    centres = np.array([(np.min(each, axis=0) + np.max(each, axis=0)) / 2 for each in points])
    turned = np.array([centres @ T.rotation.T + T.translation for T in frames])
    radii = [
        np.linalg.norm(np.array(each) - centre, axis=1).max() + radius + OVERLAP.rounding
        for each, centre, radius in zip(points, centres, grown, strict=True)
    ]
    return turned, np.array(radii)


def _close(first: tuple[Array, Array], second: tuple[Array, Array]) -> list[list[int]]:
    """Sample and indices of overlapping balls."""
    (a, r_a), (b, r_b) = first, second
    apart = np.linalg.norm(a[:, :, None] - b[:, None], axis=3) - r_a[:, None] - r_b
    return np.argwhere(apart <= 0).tolist()


def _length(row: list[float]) -> float:
    return float(np.linalg.norm(np.array(row[3:6]) - row[:3]))


def _middle(row: list[float]) -> pin.SE3:
    """The frame of a capsule: its z axis along the capsule's."""
    begin, end, length = np.array(row[:3]), np.array(row[3:6]), _length(row)
    turn = np.eye(3) if length == 0 else turn_onto((end - begin) / length)
    return pin.SE3(turn, (begin + end) / 2)


def _pose(T: pin.SE3) -> coal.Transform3s:
    return coal.Transform3s(np.ascontiguousarray(T.rotation), np.ascontiguousarray(T.translation))
