"""Warnings about the chain of joints of a user's own arm."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from joulepath.models.own_arm.joint_facts import JointFacts
from joulepath.models.own_arm.upright import UprightChain, gravity_in_base
from joulepath.models.own_arm.urdf_chain import Chain
from joulepath.models.own_arm.urdf_tree import CHAIN, listed

ALIGNED = 1e-6
"""Distance [m] and sine of the angle between axes below which they are one line."""


def chain_warnings(chain: Chain, upright: UprightChain) -> list[str]:
    """What is doubtful about the joints and masses of a chain, or has no effect."""
    warnings, gravity = chain.estimate.warnings(), gravity_in_base(chain)
    if gravity is not None:
        warnings.append(
            "The base is tilted against the root link of the URDF, which is taken to be upright: "
            f"gravity in its frame is {gravity.round(4).tolist()} m/s² unless a request gives "
            "another."
        )
    if chain.beneath:
        warnings.append(
            f"Joints beneath the base turn, and gravity with them: {listed(chain.beneath)}. They "
            "are taken to be at zero, unless `locked` has their positions."
        )
    if chain.rounded > CHAIN.rounded_angle:
        warnings.append(
            "Angles of joint origins written with few decimals, such as 1.571, are read as the "
            f"multiples of 15° that they stand for: by up to {chain.rounded:.2g} rad."
        )
    if passive := _with_friction_of_their_own(chain):
        warnings.append(
            f"Joints that mimic others, whose <dynamics> has no effect: {listed(passive)}. Give "
            "`drives.coulomb` and `drives.viscous` with their friction for the joints that they "
            "follow."
        )
    if chain.idle:
        warnings.append(
            f"Joints beside the chain that mimic moving ones: {listed(chain.idle)}. They are "
            "held at fixed positions, so neither the mass nor the shape of their links moves as "
            "on the real arm. Their positions can be given in `locked`."
        )
    if chain.facts.endless:
        warnings.append(
            f"Continuous joints whose `lower` and `upper` have no effect: "
            f"{listed(chain.facts.endless)}. Make them revolute if they have these limits."
        )
    if chain.coarse:
        warnings.append(
            f"Joints with angles of 1.57 or 3.14: {listed(chain.coarse)}. They are read as "
            "written, so that the axes are not at right angles. Write 1.5708 and 3.1416 if they "
            "are."
        )
    return [*warnings, *_shared_axes(chain, upright)]


def _with_friction_of_their_own(chain: Chain) -> list[str]:
    """Names of the joints that follow others and have friction or damping."""
    followers = tuple(name for name in chain.turning if name not in chain.joints)
    facts = JointFacts.of(chain.root, followers)
    return [
        name for name, each in zip(followers, facts.coulomb + facts.viscous, strict=True) if each
    ]


def _shared_axes(chain: Chain, upright: UprightChain) -> list[str]:
    """Warnings of neighbouring joints that turn about one line."""
    return [
        f"Joints {first!r} and {second!r} turn about one line, whatever the configuration: an "
        "<origin> or an <axis> of the URDF is likely wrong, or the second joint is no part of the "
        "arm. Poses are then held on self-motions, and most are refused as singular."
        for (first, second), T in zip(pairwise(chain.turning), upright.placements[1:], strict=True)
        if {first, second} <= {*chain.joints}
        and np.hypot(*T.translation[:2]) < ALIGNED
        and np.hypot(*T.rotation[:2, 2]) < ALIGNED
    ]
