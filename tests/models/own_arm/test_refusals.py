"""URDFs without a usable robot are refused with the link or joint, implausible figures cause a
remark, and broken XML is reported.
"""

from __future__ import annotations

import dataclasses
import random
import re
from pathlib import Path
from typing import Any

import pytest

from joulepath.app.schemas.examples.own_arm import URDF
from joulepath.models.from_figures import robot_of
from joulepath.models.own_arm.description import Collision, Drives, Electronics, InvalidArm, Motion
from joulepath.models.own_arm.figures import own_figures
from joulepath.optimizer.problem.robots import load_robot
from tests.models.own_arm.arms import HELD, RICH, RICH_ARM, refused, robot
from tests.selection import long_but


def change(old: str, new: str, urdf: str = RICH) -> dict[str, Any]:
    assert old in urdf
    return {"urdf": urdf.replace(old, new)}


WITHOUT_MASS = {
    "urdf": RICH.replace('<mass value="0.8"/>', '<mass value="0"/>').replace(
        'value="0.1"', 'value="0"'
    )
}


BALL_JOINT = (
    '<link name="world"/><link name="y"/><joint name="x" type="ball"><parent '
    'link="world"/><child link="y"/></joint>'
)


LOOP = change('link="forearm"/><child link="wrist"', 'link="finger"/><child link="wrist"')


NO_RANGE = 'lower="0" upper="0"'
EXCHANGED = 'lower="2.5" upper="-2"'


ON_A_RAIL, ON_A_PLATE = (
    {"base": "world"} | change('"fixed_1" type="fixed"', f'"fixed_1" type="{kind}"')
    for kind in ("prismatic", "planar")
)


WRONG: list[tuple[str, str, dict[str, Any]]] = [
    ("urdf", "is not XML", {"urdf": "<robot"}),
    ("urdf", "root element", {"urdf": "<sdf/>"}),
    ("urdf", "no <link>", {"urdf": "<robot/>"}),
    ("urdf", "xacro", change("<link name=", "<xacro:insert_block/><link name=")),
    ("urdf", "xacro", change('"0.25 0 0"', '"${length} 0 0"')),
    ("urdf", "document type", {"urdf": '<!DOCTYPE r [<!ENTITY a "b">]>' + RICH}),
    ("tip", "no link 'nowhere'", {"tip": "nowhere"}),
    ("base", "no link 'nowhere'", {"base": "nowhere"}),
    ("tip", "not connected to the base 'hand'", {"tip": "forearm", "base": "hand"}),
    ("tip", "0 joints move", {"tip": "pedestal", "base": "world"}),
    ("locked", "no joint 'thumb'", {"locked": {"thumb": 0.0}}),
    ("locked", "'finger' moves a link that is not between", {"locked": None}),
    ("urdf", "'finger' is prismatic", {"tip": "finger", "locked": None}),
    (
        "urdf",
        "'finger' is prismatic.*in `locked`, in place of \"others\", with the positions of all",
        {"tip": "finger", "locked": "others"},
    ),
    ("urdf", "'fixed_1' is prismatic.*in `locked`, or name 'pedestal' as `base`", ON_A_RAIL),
    ("urdf", "'fixed_1' is planar.*: make it fixed, or name 'pedestal' as `base`", ON_A_PLATE),
    (
        "urdf",
        "'twist' mimics itself",
        change('<origin xyz="0.25 0 0"/>', '<origin xyz="0.25 0 0"/><mimic joint="twist"/>'),
    ),
    ("urdf", "'elbow' has no <limit>", change('lower="-2" upper="2.5" ', "")),
    ("urdf", "'elbow' cannot.*: write its range", change('lower="-2" upper="2.5"', NO_RANGE)),
    ("urdf", "'elbow' cannot.*: exchange", change('lower="-2" upper="2.5"', EXCHANGED)),
    (
        "urdf",
        "`upper` that is not a finite number, but 'inf'",
        change('upper="2.5"', 'upper="inf"'),
    ),
    ("urdf", "Two links.*: hand. Give", change('name="wrist"', 'name="hand"')),
    ("urdf", "Two joints.*: pan. Give", change('"twist"', '"pan"')),
    ("urdf", r"but 'a\\u200b'", change('"twist"', '"a\u200b"')),
    ("urdf", "'bracket' has an <origin>", change('xyz="0 0.05 0.1"', 'xyz="0 0,05 0.1"')),
    ("urdf", "'twist' is floating", change('"twist" type="revolute"', '"twist" type="floating"')),
    (
        "locked",
        "no single position",
        {"locked": HELD | {"twist": 0.0}}
        | change('"twist" type="revolute"', '"twist" type="floating"'),
    ),
    (
        "urdf",
        "that the URDF does not have",
        change('<child link="wrist"/>', '<child link="wirst"/>'),
    ),
    ("urdf", "child of two joints", change('<child link="finger"/>', '<child link="wrist"/>')),
    ("urdf", "form a loop: hand, wrist, ", LOOP),
    (
        "urdf",
        "one root link",
        change('<link name="world"/>', '<link name="world"/><link name="island"/>'),
    ),
    ("urdf", "<axis> of no length", change('xyz="0 0 -2"', 'xyz="0 0 0"')),
    ("urdf", "'wrist', with what is fixed to it, has no mass", WITHOUT_MASS),
    ("urdf", "'flange_arm' has an impossible inertia", change('izz="0.015"', 'izz="0.09"')),
    ("urdf", "negative principal moment", change('ixx="0.02" ixy="0.001"', 'ixx="0.02" ixy="0.1"')),
    ("torque", "Joint 'elbow' has no limit `effort`", change('effort="30"', 'effort="0"')),
    ("velocity", "Joint 'pan' has no limit `velocity`", change(' velocity="2"/>', "/>")),
    ("torque", "a list of 3, one per joint: pan, elbow, twist", {"torque": (1.0, 2.0)}),
    ("torque", "joint 'elbow' must be from 1e-06", {"torque": (1.0, 0.0, 1.0)}),
    ("acceleration", "from 1e-06 to 1e\\+06", {"acceleration": 1e-300}),
    ("payload", "from 0 to 10000 kg", {"payload": -1.0}),
    ("drives.copper", "from 1e-06", {"drives": Drives(copper=-1.0)}),
    ("electronics.regeneration", "at most 1", {"electronics": Electronics(regeneration=1.5)}),
    ("default_motion", "above 0", {"default_motion": Motion(0.0, 1.0)}),
    ("collision.radius", "between 0.0001 and 1 m", {"collision": Collision(radius=2.0)}),
    ("collision.capsules", "no link 'tail'", {"collision": Collision({"tail": ()})}),
    (
        "collision.capsules",
        "'wrist' must be between",
        {"collision": Collision({"wrist": ((0.0,) * 7,)})},
    ),
    (
        "collision.never_meet",
        "no link 'tail'",
        {"collision": Collision(never_meet=(("tail", "wrist"),))},
    ),
    ("drives.viscous", "0, or from 1e-06", {"drives": Drives(viscous=-1.0)}),
    ("urdf", "are its units SI", change('<mass value="2.5"/>', '<mass value="2.5e300"/>')),
    ("urdf", "are its units SI", change('<origin xyz="0.25 0 0"/>', '<origin xyz="250 0 0"/>')),
    (
        "urdf",
        "'elbow' has a position limit of 180 rad",
        change('lower="-2" upper="2.5"', 'lower="-180" upper="180"'),
    ),
    (
        "velocity",
        "'elbow' has a limit `velocity` of 1e\\+30 in the URDF.* or give `velocity`",
        change('velocity="2.5"', 'velocity="1e30"'),
    ),
    ("urdf", "without the attribute `iyz`", change('iyy="0.01" iyz="0"', 'iyy="0.01"')),
    (
        "urdf",
        "3 finite numbers",
        change('<origin xyz="0.1 0 0" rpy="0 1.2 0"/>', '<origin xyz="0.1 0"/>'),
    ),
    ("urdf", "Pinocchio does not read", change('<link name="world"/>', BALL_JOINT)),
    ("urdf", "farther than 50 m", change('<origin xyz="0 0 0.1"/>', '<origin xyz="1e308 0 0"/>')),
    ("urdf", "3 finite numbers", change('size="0.1 0.1 0.3"', 'size="0.1 0.1"')),
]


@pytest.mark.parametrize(("field", "words", "changes"), WRONG, ids=[words for _, words, _ in WRONG])
def test_what_makes_no_robot_is_named(field: str, words: str, changes: dict[str, Any]) -> None:
    refused(field, words, dataclasses.replace(RICH_ARM, **changes))


@pytest.mark.parametrize("changes", [ON_A_RAIL, ON_A_PLATE], ids=["rail", "plate"])
def test_a_base_beyond_a_sliding_joint_makes_a_robot(changes: dict[str, Any]) -> None:
    arm = robot(dataclasses.replace(RICH_ARM, **changes | {"base": "pedestal"}))
    assert arm.joint_names == robot(RICH_ARM).joint_names


def test_what_is_hardly_real_is_remarked() -> None:
    small = change('<mass value="1.5"/>', '<mass value="150"/>')
    _, warnings = own_figures("mine", dataclasses.replace(RICH_ARM, **small))
    assert any("Link 'elbow': its radius of gyration" in each for each in warnings)
    rounded = change('izz="0.015"', 'izz="0.0515"')
    _, warnings = own_figures("mine", dataclasses.replace(RICH_ARM, **rounded))
    assert any("Link 'flange_arm': a principal moment is" in each for each in warnings)


@pytest.mark.parametrize(
    ("text", "field", "words"),
    [
        ("urdf: [", "", "not a description in YAML"),
        ("- 1", "", "object"),
        ("urdf: arm.urdf\ntip: tool\nacceleration: 8", "payload", "required"),
        ("urdf: none.urdf\ntip: tool\nacceleration: 8\npayload: 2", "urdf", "There is no file"),
        ("urdf: arm.urdf\ntip: tool\nacceleration: fast\npayload: 2", "acceleration", "number"),
        ("urdf: arm.urdf\ntip: tool\nacceleration: 8\npayload: .nan", "payload", "finite"),
        (
            "urdf: arm.urdf\ntip: tool\nacceleration: 8\npayload: 2\nmass: 3",
            "mass",
            "no such field: correct its name",
        ),
        (
            "urdf: arm.urdf\ntip: tool\nacceleration: 8\npayload: 2\ndrives: {copper: x}",
            "drives.copper",
            "number",
        ),
    ],
)
def test_what_is_wrong_in_a_file_is_named(
    tmp_path: Path, text: str, field: str, words: str
) -> None:
    (tmp_path / "arm.urdf").write_text(URDF)
    (tmp_path / "my_arm.yaml").write_text(text)
    with pytest.raises(InvalidArm, match=words) as found:
        load_robot(tmp_path / "my_arm.yaml")
    assert found.value.field == field


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
