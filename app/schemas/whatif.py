"""What `POST /whatif` takes and answers."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from app.schemas.answers import KeptAnswer
from app.schemas.arm import ArmRequest
from app.schemas.common import Request, Response, described, part
from app.schemas.evaluate import EvaluateRequest
from app.schemas.request import MAX_DURATION, OptimizeRequest
from app.schemas.response import Certificate, ElectricalEnergy
from app.schemas.studies import Name

MOST_CHANGES = 16
_OPTIMIZE = {
    "start": {"q": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]},
    "goal": {"q": [0.3, -1.4, 1.4, -1.5, -1.57, 0.2]},
}
_EVALUATE = {
    "configurations": [[0.0, -1.57, 1.57, -1.57, -1.57, 0.0], [0.3, -1.4, 1.4, -1.5, -1.57, 0.2]],
    "time_per_segment": 1.5,
}
_PATH = f"/answers/{KeptAnswer.EXAMPLE_ID}"


def _names_some_but_the_robot(arm: ArmRequest) -> ArmRequest:
    if not arm.model_fields_set:
        raise PydanticCustomError("empty", "Name at least one field that the change replaces")
    if "robot" in arm.model_fields_set:
        raise PydanticCustomError("robot", "Another robot has motions of its own: leave `robot` out")
    return arm


class Change(Request):
    """A set of changes to the arm, made together."""

    name: Name = described("What to call it.", None, "links of half the mass")
    arm: Annotated[ArmRequest, AfterValidator(_names_some_but_the_robot)] = described(
        "Fields of the arm, as in the base request, each in place of the base's as a whole. What is left out stays as "
        "it is there.",
        None,
        {"link_mass_scale": 0.5},
    )


def _different(changes: list[Change]) -> list[Change]:
    if len({change.name for change in changes}) < len(changes):
        raise PydanticCustomError("repeated", "Give each change a name of its own")
    return changes


class WhatifRequest(Request):
    """A motion, exactly one of `optimize` and `evaluate`, and the arms that it is asked of besides its own."""

    optimize: OptimizeRequest | None = described(
        "A motion to be optimised, as for `POST /optimize`; its `deadline` holds for every run.",
        None,
        _OPTIMIZE,
        default=None,
    )
    evaluate: EvaluateRequest | None = described(
        "A given motion, as for `POST /evaluate`.", None, _EVALUATE, default=None
    )
    changes: Annotated[list[Change], Field(min_length=1, max_length=MOST_CHANGES), AfterValidator(_different)] = (
        described(
            "The changes: each is made to the base by itself.",
            None,
            [{"name": "links of half the mass", "arm": {"link_mass_scale": 0.5}}],
        )
    )
    deadline: float = described(
        "Wall time for all runs together, waiting included; each has its share of what is left.",
        "s",
        30.0,
        default=30.0,
        ge=1e-3,
        le=MAX_DURATION,
    )

    @model_validator(mode="after")
    def _one_base(self) -> Self:
        if (self.optimize is None) == (self.evaluate is None):
            raise PydanticCustomError("exactly_one", "Give exactly one of `optimize` and `evaluate`")
        return self


class WhatifBase(Response):
    """What the changes are compared with."""

    answer: str = described("Path of the whole answer, as of `POST /optimize` or `POST /evaluate`.", None, _PATH)
    status: Literal["optimal", "feasible"] | None = described(
        "As `POST /optimize` answers it; null for a given motion.", None, "optimal"
    )
    holds: bool = described("Whether it keeps every limit: an optimised motion always does.", None, True)
    duration: float = described("Length of the motion.", "s", 0.78)
    electrical: ElectricalEnergy = part("Energy drawn from the supply, and its parts.")
    mechanical: float = described("Absolute mechanical work.", "J", 21.3)
    mean_power: float = described("Mean power drawn from the supply.", "W", 58.5)
    peak_power: float = described("Greatest power drawn from the supply.", "W", 119.0)


class Joules(Response):
    """An energy with the change made, against the base's."""

    value: float = described("With the change.", "J", 38.2)
    difference: float = described("`value` less the base's: below zero, the change saves.", "J", -7.2)
    relative: float | None = described(
        "`difference` over the base's absolute value; null where that is below 1e-6 J.", "1", -0.159
    )


class Seconds(Response):
    """A duration with the change made, against the base's."""

    value: float = described("With the change.", "s", 0.77)
    difference: float = described("`value` less the base's.", "s", -0.01)
    relative: float | None = described("`difference` over the base's.", "1", -0.013)


class Watts(Response):
    """A power with the change made, against the base's."""

    value: float = described("With the change.", "W", 49.6)
    difference: float = described("`value` less the base's.", "W", -8.9)
    relative: float | None = described("`difference` over the base's; null where that is below 1e-6 W.", "1", -0.152)


class ElectricalChange(Response):
    """Energy drawn from the supply and its parts, each against the base's; parts as in `POST /optimize`."""

    total: Joules = part("Energy drawn from the supply.")
    idle: Joules = part("Electronics.")
    potential: Joules = part("Rise in potential energy.")
    kinetic: Joules = part("Rise in kinetic energy.")
    friction: Joules = part("Lost to friction in the joints.")
    copper: Joules = part("Lost in the motors' windings.")
    inverter: Joules = part("Lost in the inverters.")
    braking: Joules = part("Surplus burnt in the brake resistor.")
    recovered: Joules = part("Surplus given back to the supply.")
    storage_loss: Joules = part("Lost on the way through the bus' store.")
    dwell: Joules = part("Drawn while waiting at the goal.")


class Outcome(Response):
    """What a motion of the changed arm comes to, against the base."""

    duration: Seconds = part("Length of the motion.")
    electrical: ElectricalChange = part("Energy drawn from the supply, and its parts.")
    mechanical: Joules = part("Absolute mechanical work.")
    mean_power: Watts = part("Mean power drawn from the supply.")
    peak_power: Watts = part("Greatest power drawn from the supply.")


class SameMotion(Outcome):
    """The base's motion, unaltered, on the changed arm."""

    holds: bool = described("Whether it keeps every limit and meets its targets there.", None, True)
    certificate: Certificate | None = part(
        "The certificate of an optimised motion on the changed arm; where `holds` is false, it tells why. Null for a "
        "given motion, whose limits are in its `answer`."
    )
    answer: str | None = described(
        "Path of the whole answer of a given motion, as of `POST /evaluate`; null for an optimised one.", None, _PATH
    )


class Reoptimised(Outcome):
    """The best motion of the changed arm."""

    answer: str = described("Path of the whole answer, as of `POST /optimize`.", None, _PATH)
    status: Literal["optimal", "feasible"] = described("As `POST /optimize` answers it.", None, "optimal")


class ChangeOutcome(Response):
    """What a change comes to."""

    name: str = described("The change's name.", None, "links of half the mass")
    same_motion: SameMotion | None = part(
        "The base's motion on the changed arm; null where there is none, see `problem`."
    )
    reoptimised: Reoptimised | None = part(
        "The best motion of the changed arm; null for a given motion, or see `problem`."
    )
    reoptimisation: float | None = described(
        "Energy of the re-optimised motion less that of the same motion, of the objective: below zero, optimising "
        "anew saves that much. Above zero only where the same motion does not hold. Null where one of them is missing.",
        "J",
        -0.4,
    )
    problem: dict[str, Any] | None = described(
        "Why there is no motion, as `POST /optimize` or `POST /evaluate` would answer it; else null.",
        None,
        {"type": "/problems/torque-infeasible", "title": "Torque infeasible", "status": 422},
    )


class WhatifResponse(Response):
    """A motion on the arm as it is, and on changed ones."""

    id: str = described(
        "The request's id, as in the `X-Request-ID` header.", None, "0b0f3b0e-4c4f-4a43-9d6b-1f6f2f1f6a55"
    )
    robot: str = described("Name of the robot.", None, "ur5e")
    objective: Literal["electrical", "mechanical"] | None = described(
        "What was minimised; null for a given motion.", None, "electrical"
    )
    base: WhatifBase = part("The motion on the arm as it is.")
    changes: Annotated[list[ChangeOutcome], Field(min_length=1)] = part("The changes, in the order asked for.")
    wall_time: float = described("Wall time for all of it.", "s", 1.2)
