"""A user's own arm: requests of `POST /robots` and `PUT /robots/{name}`."""

from __future__ import annotations

import re
from typing import Annotated, Literal

from pydantic import Field

from joulepath.app.schemas.common import NO_CONTROLS, PLAIN, Request, described
from joulepath.app.schemas.examples.own_arm import URDF
from joulepath.app.schemas.lengths import LENGTHS
from joulepath.app.schemas.queries import Name as SearchText
from joulepath.app.schemas.queries import Query, search_in
from joulepath.models.own_arm.description import PLAUSIBLE
from joulepath.models.shape_sizes import SIZES

MOST_LOCKED = 100
"""Most held joints of an arm."""

Positive = Annotated[float, Field(ge=1e-6, le=1e6)]
NotNegative = Annotated[float, Field(ge=0, le=1e6)]
PositivePerJoint = Positive | Annotated[list[Positive], Field(min_length=1, max_length=16)]
PerJoint = NotNegative | Annotated[list[NotNegative], Field(min_length=1, max_length=16)]
Text = Annotated[str, Field(min_length=1, max_length=LENGTHS.name, pattern=NO_CONTROLS), PLAIN]
# a name in the URDF
Named = Annotated[str, Field(min_length=1, max_length=100)]
Length = Annotated[float, Field(ge=-10, le=10)]
Capsule = Annotated[list[Length], Field(min_length=7, max_length=7)]
Pair = Annotated[list[Named], Field(min_length=2, max_length=2)]
NAME_PATTERN = re.compile(rf"^[a-z0-9][a-z0-9_-]{{0,{LENGTHS.robot - 1}}}$")
OwnName = Annotated[
    str, Field(min_length=1, max_length=LENGTHS.robot, pattern=NAME_PATTERN.pattern)
]


class OwnDrives(Request):
    """Motors and gears, joint-side: one value for all joints, or one per joint from base to tip.
    Null: estimated from the torque limits; the note of the parameter gives rule and range."""

    rotor_inertia: PerJoint | None = described(
        "Inertia of the rotors behind the gear.", "kg·m²", 0.4, default=None
    )
    coulomb: PerJoint | None = described(
        "Coulomb friction.", "N·m", [6.0, 6.0, 4.0, 1.5, 1.5, 1.5], default=None
    )
    viscous: PerJoint | None = described("Viscous friction.", "N·m·s/rad", 1.2, default=None)
    copper: PositivePerJoint | None = described(
        "Copper loss over the square of the motor torque.", "W/(N·m)²", 0.005, default=None
    )


class OwnElectronics(Request):
    """Power of the electronics. Null: a default, marked as such."""

    idle_power: NotNegative | None = described("Of the arm at rest.", "W", 40.0, default=None)
    controller_power: NotNegative | None = described(
        "Of the control box. Null: 0.", "W", 60.0, default=None
    )
    regeneration: Annotated[float, Field(ge=0, le=1)] | None = described(
        "Share of the surplus power returned to the supply. Null: 0.", "1", 0.0, default=None
    )


class OwnCollision(Request):
    """Shape of the links. A link without `capsules` gets one capsule per `<collision>` shape of the
    URDF, and per mesh only if it is given in `meshes`. A link without shapes gets one capsule from
    joint to joint."""

    capsules: dict[Named, Annotated[list[Capsule], Field(max_length=50)]] | None = described(
        "Capsules by the name of a link: [x1, y1, z1, x2, y2, z2, radius], both ends of the axis "
        "in the link's URDF frame.",
        "m",
        {"forearm": [[0.0, 0.0, 0.05, 0.0, 0.0, 0.3, 0.05]]},
        default=None,
        max_length=200,
    )
    radius: Annotated[float, Field(ge=SIZES.smallest, le=PLAUSIBLE.radius)] | None = described(
        "Radius of the capsules from joint to joint. Null: 4.5 % of the arm's length.",
        "m",
        0.05,
        default=None,
    )
    never_meet: Annotated[list[Pair], Field(max_length=200)] | None = described(
        "Pairs of links without a distance check. Null: all pairs with capsules in contact in "
        "nearly every configuration.",
        None,
        [["base_link", "upper_arm"]],
        default=None,
    )


class OwnMotion(Request):
    """Default motion of the robot's own controller, for the baseline `controller_default`."""

    velocity: Positive = described("Speed of the leading joint.", "rad/s", 1.0)
    acceleration: Positive = described("Acceleration of the leading joint.", "rad/s²", 1.4)


class OwnArm(Request):
    """A user's own arm: its URDF, and parameters that a URDF does not have."""

    urdf: str = described(
        "Text of the URDF: a tree of links. Of its joints, those from `base` to `tip` move; they "
        "must be revolute or continuous. All else that hangs on them must be fixed, or `locked`.",
        None,
        URDF,
        min_length=1,
    )
    tip: Named = described("Link at the end of the arm: its frame is the flange.", None, "tool")
    base: Named | None = described(
        "Link whose frame is the world frame. Null: the root link of the URDF.",
        None,
        "base",
        default=None,
    )
    title: Text | None = described(
        "Manufacturer and model. Null: the name.", None, "Example arm", default=None
    )
    source: Text = described(
        "Origin of the URDF and the other values.",
        None,
        "maker's repository, 2025",
        default="given by the user",
    )
    trust: Literal["A", "B", "C", "T"] = described(
        "Trust letter of the URDF and the other values: see `trust` of a robot.",
        None,
        "C",
        default="C",
    )
    acceleration: PositivePerJoint | None = described(
        "Limits on the acceleration. Null: those of the URDF, which few have (version 1.2).",
        "rad/s²",
        8.0,
        default=None,
    )
    payload: Annotated[float, Field(ge=0, le=1e4)] = described(
        "Greatest mass of a payload.", "kg", 2.0
    )
    velocity: PositivePerJoint | None = described(
        "Limits on the speed. Null: those of the URDF.", "rad/s", 3.0, default=None
    )
    torque: PositivePerJoint | None = described(
        "Limits on the torque at the joint. Null: `effort` of the URDF.",
        "N·m",
        [60.0, 40.0],
        default=None,
    )
    torque_side: Literal["motor", "link"] | None = described(
        "What the limits on the torque are for: the `motor` behind its gear, friction and rotor "
        "included; or the `link`, without them, as with torque sensors. Null: the motor, nearly "
        "always the tighter interpretation.",
        None,
        "link",
        default=None,
    )
    jerk: PositivePerJoint | None = described(
        "Limits on the jerk. Null: 20 1/s times those on the acceleration.",
        "rad/s³",
        160.0,
        default=None,
    )
    locked: (
        Annotated[
            dict[Named, Annotated[float, Field(ge=-100, le=100)]], Field(max_length=MOST_LOCKED)
        ]
        | Literal["others"]
        | None
    ) = described(
        "Positions of joints that are held: of fingers, or of joints of the arm. `others`: all "
        "joints that are not between base and tip, at zero or the limit nearest to it.",
        "rad or m",
        {"finger_joint": 0.02},
        default=None,
    )
    masses: Positive | dict[Named, Positive] | None = described(
        "Mass of all moving links, or masses by the name of a link, which replace those of the "
        "URDF. Links without a mass are then estimated from the volumes of their shapes. Null: "
        "every moving link has a mass in the URDF, or `density` is given.",
        "kg",
        28.0,
        default=None,
    )
    density: Positive | None = described(
        "Density of links without a mass, which are then estimated from the volumes of their "
        "shapes. Null: 2700, and only with `masses`.",
        "kg/m³",
        2700.0,
        default=None,
    )
    mend_inertias: bool = described(
        "Whether inertias that no body can have are replaced by the nearest possible ones. "
        "Otherwise they are refused.",
        None,
        True,
        default=False,
    )
    drives: OwnDrives = described(
        "Motors and gears.", None, {"rotor_inertia": 0.4}, default=OwnDrives()
    )
    electronics: OwnElectronics = described(
        "Electronics.", None, {"idle_power": 40.0}, default=OwnElectronics()
    )
    collision: OwnCollision = described(
        "Shape of the links.", None, {"radius": 0.05}, default=OwnCollision()
    )
    srdf: str | None = described(
        "Text of an SRDF: the pairs of its `disable_collisions` are not compared. Null: none.",
        None,
        '<robot name="example"><disable_collisions link1="base" link2="forearm" '
        'reason="Never"/></robot>',
        default=None,
        min_length=1,
    )
    meshes: str | None = described(
        "Mesh files (STL, OBJ, COLLADA) that the URDF names, as a zip in base64. Null: a link "
        "whose shape is a mesh has a capsule from joint to joint.",
        None,
        "UEsFBgAAAAAAAAAAAAAAAAAAAAAAAA==",
        default=None,
    )
    default_motion: OwnMotion | None = described(
        "Default motion of the controller. Null: unknown.",
        None,
        {"velocity": 1.0, "acceleration": 1.4},
        default=None,
    )


class NewRobot(OwnArm):
    """An arm of a user's own, and its name."""

    name: OwnName = described(
        "Name in requests: small letters, digits, `-` and `_`; no robot has it yet.", None, "my_arm"
    )


class RobotTitle(Request):
    """Another title of a robot."""

    title: Text | None = described("The title. Null: the name.", None, "Palletiser, hall 2")


class RobotQuery(Query):
    """The robots to list."""

    search: SearchText | None = search_in("the name or the title")
