"""What `POST /whatif` takes and answers."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.answers.declared import Shown
from joulepath.app.schemas.arm import ArmRequest
from joulepath.app.schemas.common import Answer, Request, Response, described, part
from joulepath.app.schemas.evaluate import EvaluateRequest
from joulepath.app.schemas.examples.values import ANSWER_PATH, EVALUATE, OPTIMIZE
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.app.schemas.studies import Name
from joulepath.app.schemas.wording import OBJECTIVE
from joulepath.app.settings import LONGEST_DEADLINE
from joulepath.optimizer.problem.names import first_repeated
from joulepath.optimizer.result.certificate import Certificate
from joulepath.optimizer.result.energy import ElectricalEnergy, Objective

MOST_CHANGES = 16


def _changes_something(arm: ArmRequest) -> ArmRequest:
    if not arm.model_fields_set:
        raise PydanticCustomError("empty", "Give at least one field of the arm")
    if "robot" in arm.model_fields_set:
        raise PydanticCustomError("robot", "A change cannot replace the robot: leave `robot` out")
    if "figures" in arm.model_fields_set:
        raise PydanticCustomError("figures", "A change cannot replace the robot's figures: leave `figures` out")
    return arm


class Change(Request):
    """A changed arm: fields of the arm that replace those of the base."""

    name: Name = described("Name of the change.", None, "links of half the mass")
    arm: Annotated[ArmRequest, AfterValidator(_changes_something)] = described(
        "Fields of the arm. Each replaces the whole field of the base. A field that is left out keeps the value of the "
        "base.",
        None,
        {"link_mass_scale": 0.5},
    )


def _different(changes: list[Change]) -> list[Change]:
    if first_repeated([change.name for change in changes]) is not None:
        raise PydanticCustomError("repeated", "Give each change a different name; case and spaces make no difference")
    return changes


class WhatifRequest(Request):
    """A motion, as exactly one of `optimize` and `evaluate`, and changes of its arm."""

    optimize: OptimizeRequest | None = described(
        "The base, if a motion is optimised: a body of `POST /optimize`. Its `deadline` applies to each run.",
        None,
        OPTIMIZE,
        default=None,
    )
    evaluate: EvaluateRequest | None = described(
        "The base, if a motion is given: a body of `POST /evaluate`. Its `deadline` applies to each run.",
        None,
        EVALUATE,
        default=None,
    )
    changes: Annotated[list[Change], Field(min_length=1, max_length=MOST_CHANGES), AfterValidator(_different)] = (
        described(
            "Changes of the arm; each is made to the base alone.",
            None,
            [{"name": "links of half the mass", "arm": {"link_mass_scale": 0.5}}],
        )
    )
    deadline: float = described(
        "Wall time for all runs together, including the wait for a worker. Each run gets an equal share of the time "
        "that is left.",
        "s",
        30.0,
        default=30.0,
        ge=1e-3,
        le=LONGEST_DEADLINE,
    )

    @model_validator(mode="after")
    def _one_base(self) -> Self:
        if (self.optimize is None) == (self.evaluate is None):
            raise PydanticCustomError("exactly_one", "Give exactly one of `optimize` and `evaluate`")
        return self


class WhatifBase(Response):
    """The motion on the unchanged arm, with which the changes are compared."""

    answer: str = described("Path of the complete answer of `POST /optimize` or `POST /evaluate`.", None, ANSWER_PATH)
    status: Literal["optimal", "feasible"] | None = described(
        "Status as in `POST /optimize`; null for a given motion.", None, "optimal"
    )
    holds: bool = described(
        "Whether the motion is within every limit and collision-free; an optimised motion always is.", None, True
    )
    duration: float = described("Duration of the motion.", "s", 0.78)
    electrical: Annotated[ElectricalEnergy, Shown] = part("Energy drawn from the supply, and its parts.")
    mechanical: float = described("Mechanical work.", "J", 21.3)
    mean_power: float = described("Mean power drawn from the supply.", "W", 58.5)
    peak_power: float = described("Largest power drawn from the supply.", "W", 119.0)


class EnergyChange(Response):
    """An energy on the changed arm, compared with the base."""

    value: float = described("Value on the changed arm.", "J", 38.2)
    difference: float = described("`value` minus the value of the base; a negative one is a saving.", "J", -7.2)
    relative: float | None = described(
        "`difference` / absolute value of the base; null if that is below 1e-6 J.", "1", -0.159
    )


class DurationChange(Response):
    """A duration on the changed arm, compared with the base."""

    value: float = described("Value on the changed arm.", "s", 0.77)
    difference: float = described("`value` minus the value of the base.", "s", -0.01)
    relative: float | None = described("`difference` / value of the base.", "1", -0.013)


class PowerChange(Response):
    """A power on the changed arm, compared with the base."""

    value: float = described("Value on the changed arm.", "W", 49.6)
    difference: float = described("`value` minus the value of the base.", "W", -8.9)
    relative: float | None = described(
        "`difference` / absolute value of the base; null if that is below 1e-6 W.", "1", -0.152
    )


class ElectricalChange(Response):
    """Energy drawn from the supply and its parts, each compared with the base; parts as in `POST /optimize`."""

    total: EnergyChange = part("Energy drawn from the supply.")
    idle: EnergyChange = part("Power of the electronics times the duration.")
    potential: EnergyChange = part("Gain of potential energy.")
    kinetic: EnergyChange = part("Gain of kinetic energy.")
    friction: EnergyChange = part("Friction loss in the joints.")
    copper: EnergyChange = part("Copper loss in the motor windings.")
    inverter: EnergyChange = part("Loss in the inverters.")
    braking: EnergyChange = part("Regenerated energy that no joint uses and no energy storage takes.")
    recovered: EnergyChange = part("The part of `braking` that the supply takes back; zero or negative.")
    storage_loss: EnergyChange = part("Loss in the energy storage on the bus.")
    dwell: EnergyChange = part("Energy drawn while the arm waits at the goal.")


class ChangedMotion(Response):
    """A motion of the changed arm, compared with the base."""

    duration: DurationChange = part("Duration of the motion.")
    electrical: ElectricalChange = part("Energy drawn from the supply, and its parts.")
    mechanical: EnergyChange = part("Mechanical work.")
    mean_power: PowerChange = part("Mean power drawn from the supply.")
    peak_power: PowerChange = part("Largest power drawn from the supply.")


class SameMotion(ChangedMotion):
    """The motion of the base, unchanged, on the changed arm."""

    holds: bool = described(
        "Whether the motion is within every limit of the changed arm, collision-free, and reaches its targets.",
        None,
        True,
    )
    certificate: Annotated[Certificate, Shown] | None = part(
        "Certificate of an optimised motion on the changed arm; if `holds` is false, it shows why. Null for a given "
        "motion, whose limits are in `answer`."
    )
    answer: str | None = described(
        "Path of the complete answer of `POST /evaluate` for a given motion; null for an optimised motion.",
        None,
        ANSWER_PATH,
    )


class Reoptimised(ChangedMotion):
    """The best motion found for the changed arm."""

    answer: str = described("Path of the complete answer of `POST /optimize`.", None, ANSWER_PATH)
    status: Literal["optimal", "feasible"] = described("Status as in `POST /optimize`.", None, "optimal")


class ChangeResult(Response):
    """Result of one change."""

    name: str = described("Name of the change.", None, "links of half the mass")
    same_motion: SameMotion | None = part(
        "The motion of the base on the changed arm; null if there is none: see `problem`."
    )
    reoptimised: Reoptimised | None = part(
        "The best motion found for the changed arm; null for a given motion, or if there is none: see `problem`."
    )
    reoptimisation: float | None = described(
        "Energy of `reoptimised` minus energy of `same_motion`, of the objective; a negative value is a saving. It is "
        "positive only if `same_motion` violates a limit, or if the deadline passed early. Null if one of the two "
        "motions is missing.",
        "J",
        -0.4,
    )
    problem: dict[str, Any] | None = described(
        "Error document that `POST /optimize` or `POST /evaluate` would return; null if there is a motion.",
        None,
        {"type": "/problems/torque-infeasible", "title": "Not enough torque", "status": 422},
    )


class WhatifResponse(Answer):
    """A motion on the arm, and on changed arms."""

    objective: Objective | None = described(f"{OBJECTIVE} Null for a given motion.", None, "electrical")
    base: WhatifBase = part("The motion on the unchanged arm.")
    changes: Annotated[list[ChangeResult], Field(min_length=1)] = part(
        "One entry per change, in the order of the request."
    )
    wall_time: float = described("Wall time of the whole request.", "s", 1.2)
