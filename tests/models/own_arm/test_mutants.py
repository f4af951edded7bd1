"""Broken URDFs: each makes a robot, or is refused as what it is, and none takes long."""

from __future__ import annotations

import dataclasses
import random
import re

import pytest

from joulepath.models.from_figures import robot_of
from joulepath.models.own_arm.description import InvalidArm
from joulepath.models.own_arm.figures import own_figures
from tests.models.own_arm.arms import RICH, RICH_ARM
from tests.selection import long_but

NUMBERS = (
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-308",
    "nan",
    "inf",
    "",
    "a",
    "1 2",
    "1e5",
    "9" * 400,
    "0x10",
    "1,5",
)
CHARACTERS = ("\0", "<", ">", '"', "&", "\xff", "\U0001f600")


def mutant(text: str, chance: random.Random) -> str:
    """The text with a number, an attribute, an element, a name or a character changed."""
    kind = chance.choice(["number", "attribute", "element", "name", "character"])
    if kind == "character":
        at = chance.randrange(len(text))
        return text[:at] + chance.choice(CHARACTERS) + text[at + 1 :]
    pattern = {
        "number": r"-?\d+\.?\d*",
        "attribute": r'\w+="[^"]*"',
        "element": r"<[^>]+/>",
        "name": r'"\w+"',
    }[kind]
    found = list(re.finditer(pattern, text))
    place, other = chance.choice(found), chance.choice(found)
    new = {
        "number": chance.choice(NUMBERS),
        "attribute": "",
        "element": chance.choice(["", place[0] * 2]),
        "name": other[0],
    }[kind]
    return text[: place.start()] + new + text[place.end() :]


@pytest.mark.timeout(120)
@pytest.mark.parametrize("count", long_but((150,), (150, 5_000)))
def test_a_mutant_is_a_robot_or_is_refused(count: int) -> None:
    chance, refused = random.Random(1), 0
    for _ in range(count):
        text = RICH
        for _ in range(chance.choice([1, 1, 2, 4])):
            text = mutant(text, chance)
        try:
            assert (
                robot_of(
                    "mutant", own_figures("mutant", dataclasses.replace(RICH_ARM, urdf=text))[0]
                ).nq
                > 0
            )
        except InvalidArm:
            refused += 1
    assert 0.5 * count < refused < 0.95 * count
