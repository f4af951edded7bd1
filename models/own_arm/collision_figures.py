"""Figures of the links' shapes: capsules, and the pairs of links that are not compared.

A link that has neither capsules of the user nor shapes in the URDF gets a capsule from joint to
joint.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from joulepath.models.own_arm import rules
from joulepath.models.own_arm.description import LONGEST_NAME, WIDEST, Description, InvalidArm
from joulepath.models.own_arm.figure import assumed, stated
from joulepath.models.own_arm.link_shapes import LinkShapes, Rows, check_near
from joulepath.models.own_arm.meeting_pairs import pairs_that_meet
from joulepath.models.own_arm.srdf import disabled_pairs
from joulepath.models.own_arm.upright import UprightChain
from joulepath.models.own_arm.urdf_chain import Chain
from joulepath.models.shape_sizes import WrongSize, check_lengths
from joulepath.models.uploads.limits import Checkpoint
from joulepath.models.urdf import BASE

# a link shorter than this, over its capsule's radius, has a ball
SHORT = 1e-3
_FRAME = "x1, y1, z1, x2, y2, z2 of the axis' ends in the link frame, radius."


def collision_figures(
    description: Description,
    chain: Chain,
    upright: UprightChain,
    links: list[str],
    warnings: list[str],
    checkpoint: Checkpoint,
) -> dict[str, Any]:
    """Figures of the section `collision`; `links` are the names of the moving links. Shapes that
    are not read are added to `warnings`."""
    shapes, radius = (
        LinkShapes.of(description, chain, upright, checkpoint),
        _radius(description, upright),
    )
    capsules, guessed, figures = list[Rows](), list[bool](), {}
    for k, name in enumerate([BASE, *links]):
        own = shapes.rows(k)
        rows = own or _between_joints(upright, k, radius)
        check_near(name, rows)
        capsules.append(rows)
        guessed.append(not own)
        of_user = stated(description, rows, "m", _FRAME)
        figures[name] = of_user if own else assumed(rows, "m", f"From joint to joint. {_FRAME}")
    pairs = _given_pairs(description, chain, checkpoint)
    if pairs is None:
        often = pairs_that_meet(chain, upright, capsules, guessed, checkpoint)
        note = (
            "Pairs whose capsules meet in 95 % of 300 random configurations, or in 30 % if one is "
            "from joint to joint."
        )
        figures["never_meet"] = assumed(often, "1", note)
    else:
        figures["never_meet"] = stated(
            description, pairs, "1", "Numbers of links, 0 for the base. Not proven."
        )
    if shapes.missing:
        warnings.append(
            "Meshes that were not given, or are no STL or OBJ, count as nothing: "
            f"{_listed(shapes.missing)}."
        )
    if shapes.unknown:
        warnings.append(f"Shapes that are not read count as nothing: {_listed(shapes.unknown)}.")
    return figures


def _radius(description: Description, upright: UprightChain) -> float:
    """Radius [m] of links without a shape."""
    lengths = [np.linalg.norm(each.translation) for each in (*upright.placements, upright.flange)]
    given = description.collision.radius
    radius = float(rules.RADIUS * sum(lengths)) if given is None else given
    try:
        check_lengths("collision.radius, that of links without a shape,", radius, WIDEST)
    except WrongSize as error:
        raise InvalidArm("collision.radius", str(error)) from None
    return radius


def _listed(names: list[str]) -> str:
    """Names that a URDF gives, each once, as far as they are of a length to be read."""
    return ", ".join(name[:LONGEST_NAME] for name in dict.fromkeys(names))


def _between_joints(upright: UprightChain, k: int, radius: float) -> Rows:
    """A capsule from the link's joint to the next one, or to the flange; a ball where both are at
    one place.
    """
    end = (*upright.placements, upright.flange)[k].translation
    length = float(np.linalg.norm(end))
    # as far from both joints as its radius, so that it ends where the next link's begins
    share = min(0.5, radius / length) if length > SHORT * radius else 0.5
    return [[*(share * end).tolist(), *((1 - share) * end).tolist(), radius]]


def _given_pairs(
    description: Description, chain: Chain, checkpoint: Checkpoint
) -> list[list[int]] | None:
    """Pairs of links that the user does not want compared, in words of their own or in an SRDF;
    None for no word.
    """
    number = {link: k for k, rigid in enumerate(chain.rigid) for link in rigid}
    own, srdf = description.collision.never_meet, description.srdf
    for link in (each for pair in own or () for each in pair):
        if link not in number:
            raise InvalidArm(
                "collision.never_meet", f"The arm has no link {link!r} from base to tip."
            )
    if own is None and srdf is None:
        return None
    # an SRDF may be that of a larger machine
    given = [*(own or ()), *(() if srdf is None else disabled_pairs(srdf, checkpoint))]
    known = [(number[a], number[b]) for a, b in given if a in number and b in number]
    return [
        list(pair)
        for pair in sorted({(min(pair), max(pair)) for pair in known if abs(pair[0] - pair[1]) > 1})
    ]
