"""Figures of link shapes: capsules, hulls, and pairs of links excluded from collision checks.

A link without capsules of the user and without shapes in the URDF gets a capsule from joint to
joint.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from joulepath.models.from_figures import BETWEEN_LINKS
from joulepath.models.hull_cover import HULL_FIT
from joulepath.models.own_arm.description import PLAUSIBLE, Description, InvalidArm
from joulepath.models.own_arm.figure import assumed, stated
from joulepath.models.own_arm.link_shapes import Cover, LinkShapes, Rows, check_near
from joulepath.models.own_arm.meeting_pairs import MeetingPairs, pairs_that_meet
from joulepath.models.own_arm.robot_xml import robot_element
from joulepath.models.own_arm.rules import RULES
from joulepath.models.own_arm.upright import UprightChain
from joulepath.models.own_arm.urdf_chain import Chain
from joulepath.models.shape_sizes import WrongSize, check_lengths
from joulepath.models.uploads.limits import Checkpoint
from joulepath.models.urdf import BASE

SHORT_SHARE = 1e-3
"""Length over radius below which the capsule of a link is a ball."""
_FRAME = "x1, y1, z1, x2, y2, z2 of the axis' ends in the link frame, radius."


def shape_figures(
    description: Description,
    chain: Chain,
    upright: UprightChain,
    links: list[str],
    warnings: list[str],
    checkpoint: Checkpoint,
) -> dict[str, dict[str, Any]]:
    """Figures of the section `collision`, and of the section `hulls` if any link has a hull.

    Args:
        description: the user's description.
        chain: the joints of the URDF.
        upright: the frames of the links.
        links: names of the moving links.
        warnings: messages about unread shapes are appended here.
        checkpoint: ends the computation by an exception.
    """
    shapes = LinkShapes.of(description, chain, upright, checkpoint)
    radius = _radius(description, upright)
    covers, guessed, figures = list[Cover](), list[bool](), {}
    for k, name in enumerate([BASE, *links]):
        cover = shapes.cover(k, name)
        guessed.append(not cover.capsules)
        if guessed[-1]:
            cover = Cover(_between_joints(upright, k, radius), [])
            check_near(name, cover.capsules)
        rows = cover.capsules
        covers.append(cover)
        of_user = stated(description, rows, "m", _FRAME)
        note = f"From joint to joint. {_FRAME}"
        figures[name] = assumed(rows, "m", note) if guessed[-1] else of_user
    pairs = _given_pairs(description, chain, checkpoint)
    if pairs is None:
        meeting = pairs_that_meet(chain, upright, covers, guessed, checkpoint)
        note = (
            "Pairs whose shapes meet in 95 % of 300 random configurations, or in 30 % if one is a "
            "capsule from joint to joint."
        )
        figures["never_meet"] = assumed(meeting.excluded, "1", note)
        if meeting.doubtful:
            warnings.append(_doubt(meeting, chain))
    else:
        figures["never_meet"] = stated(
            description, pairs, "1", "Numbers of links, 0 for the base. Not proven."
        )
    if shapes.missing:
        warnings.append(
            "Meshes that are missing, or are not STL, OBJ or COLLADA files, are ignored: "
            f"{_listed(shapes.missing)}."
        )
    if shapes.unknown:
        warnings.append(f"Unsupported shapes are ignored: {_listed(shapes.unknown)}.")
    named = zip([BASE, *links], covers, strict=True)
    hulls = {name: cover.hulls for name, cover in named if cover.hulls}
    return {"collision": figures} | _hull_figures(description, hulls)


def _hull_figures(
    description: Description, hulls: dict[str, list[Rows]]
) -> dict[str, dict[str, Any]]:
    """The section `hulls`; none without a link that has one."""
    if not hulls:
        return {}
    note = "x, y, z in the link frame. Links and obstacles are compared with it, except clouds."
    figures = {name: stated(description, parts, "m", note) for name, parts in hulls.items()}
    radius = stated(description, HULL_FIT.radius, "m", "Grows the hulls of the points.")
    between = stated(description, "hulls", "1", "Links are compared with each other by them.")
    return {"hulls": {"radius": radius, BETWEEN_LINKS: between} | figures}


def _doubt(meeting: MeetingPairs, chain: Chain) -> str:
    """The warning of pairs that meet often, with the value that leaves them out."""
    names = [rigid[0][: PLAUSIBLE.name] for rigid in chain.rigid]
    doubtful, every = (
        [[names[a], names[b]] for a, b in pairs]
        for pairs in (meeting.doubtful, sorted(meeting.excluded + meeting.doubtful))
    )
    return (
        f"The shapes of {', '.join(f'{a} and {b}' for a, b in doubtful)} meet in many random "
        "configurations, and may exclude nearly all motions. If these links cannot touch on the "
        f"arm, give `collision.never_meet`: {json.dumps(every)}."
    )


def _radius(description: Description, upright: UprightChain) -> float:
    """Radius [m] of links without a shape."""
    lengths = [np.linalg.norm(each.translation) for each in (*upright.placements, upright.flange)]
    given = description.collision.radius
    radius = float(RULES.radius * sum(lengths)) if given is None else given
    try:
        check_lengths("collision.radius", radius, PLAUSIBLE.radius)
    except WrongSize as error:
        follows = "" if given is not None else " It follows from the <origin> of the joints."
        raise InvalidArm("collision.radius", f"{error}{follows}") from None
    return radius


def _listed(names: list[str]) -> str:
    """Distinct names of a URDF, truncated to a readable length."""
    return ", ".join(name[: PLAUSIBLE.name] for name in dict.fromkeys(names))


def _between_joints(upright: UprightChain, k: int, radius: float) -> Rows:
    """A capsule from the link's joint to the next joint or the flange; a ball if both coincide."""
    end = (*upright.placements, upright.flange)[k].translation
    length = float(np.linalg.norm(end))
    # One radius away from both joints: it ends at the beginning of the next link's capsule.
    share = min(0.5, radius / length) if length > SHORT_SHARE * radius else 0.5
    return [[*(share * end).tolist(), *((1 - share) * end).tolist(), radius]]


def _given_pairs(
    description: Description, chain: Chain, checkpoint: Checkpoint
) -> list[list[int]] | None:
    """Pairs of links excluded by the description or an SRDF; None without either."""
    number = {link: k for k, rigid in enumerate(chain.rigid) for link in rigid}
    own, srdf = description.collision.never_meet, description.srdf
    for link in (each for pair in own or () for each in pair):
        if link not in number:
            raise InvalidArm(
                "collision.never_meet", f"The arm has no link {link!r} from base to tip."
            )
    if own is None and srdf is None:
        return None
    # An SRDF may describe a larger machine.
    given = [*(own or ()), *(() if srdf is None else disabled_pairs(srdf, checkpoint))]
    known = [(number[a], number[b]) for a, b in given if a in number and b in number]
    return [
        list(pair)
        for pair in sorted({(min(pair), max(pair)) for pair in known if abs(pair[0] - pair[1]) > 1})
    ]


def disabled_pairs(text: str, checkpoint: Checkpoint) -> list[tuple[str, str]]:
    """Pairs of links of all `<disable_collisions>`. Raises InvalidArm for other text.

    Such lists come from sampling; they are accepted as a statement of the user.
    """
    root = robot_element(text, "srdf", checkpoint)
    return [
        (each.get("link1", ""), each.get("link2", "")) for each in root.iter("disable_collisions")
    ]
