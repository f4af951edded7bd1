"""What `POST /replay` takes and answers."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from joulepath.app.schemas.common import Answer, Request, Response, described, part
from joulepath.app.schemas.given_answer import AnswerRequest
from joulepath.app.schemas.wording import BODIES
from joulepath.app.settings import LONGEST_DEADLINE
from joulepath.optimizer.replay.controller import ControlName
from joulepath.optimizer.replay.outcome import TOUCH
from joulepath.optimizer.replay.replay import Quantity
from joulepath.optimizer.result.solution import BaselineName

Fraction = Annotated[float, Field(gt=0, le=0.9)]


class Perturb(Request):
    """Quantities of the arm that the controller does not know exactly. Each is changed by itself."""

    payload: Fraction | None = described(
        "Fraction by which mass and inertia of the payload are less, and more. Null: not changed.",
        "1",
        0.1,
        default=None,
    )
    friction: Fraction | None = described(
        "Fraction by which the friction of all joints is less, and more. Null: not changed.", "1", 0.3, default=None
    )


class ReplayRequest(AnswerRequest):
    """An answer whose motion is played in MuJoCo."""

    control: Literal["feed_forward", "pd", "both"] = described(
        "Controller of the joints. `feed_forward`: torques known in advance, friction included, and a PD loop. `pd`: "
        "the loop alone, as simple controllers have it.",
        None,
        "feed_forward",
        default="both",
    )
    step: float = described(
        "Step of the simulation and of its controller.", "s", 2.5e-4, default=2.5e-4, ge=1e-5, le=1e-2
    )
    perturb: Perturb | None = described(
        "Changes of the arm that the controller does not know: how the motion and its savings stand them. Null: none.",
        None,
        {"payload": 0.1, "friction": 0.3},
        default=None,
    )
    deadline: float = described(
        "Wall time from the arrival of the request, including the wait for a worker.",
        "s",
        60.0,
        default=60.0,
        ge=1e-3,
        le=LONGEST_DEADLINE,
    )


class DeepestContact(Response):
    """The deepest contact of two bodies."""

    pair: list[str] = described(BODIES, None, ["table", "tool"])
    depth: float = described("How deep they go into each other.", "m", 0.0004)
    time: float = described("Time, from the start of the motion.", "s", 0.62)


class SimulatedMotion(Response):
    """The motion as the simulated arm went it. Lists have one number per joint, from base to flange."""

    joint_error: list[float] = described(
        "Largest deviation from the motion, per joint.", "rad", [1e-5, 2e-5, 2e-5, 1e-5, 1e-5, 1e-5]
    )
    tcp_error: float = described("Largest distance of the TCP from the motion.", "m", 1.3e-5)
    end_error: float = described("Distance of the TCP from its goal when the motion ends.", "m", 1e-6)
    peak_torque: list[float] = described(
        "Largest torque of the motor at the joint, friction included, per joint.",
        "N·m",
        [61.0, 78.0, 52.0, 6.0, 5.0, 2.0],
    )
    limit_ratio: list[float] = described(
        "Largest torque / limit, on the side of the robot's `limits.torque_side`, per joint.",
        "1",
        [0.41, 0.52, 0.35, 0.22, 0.18, 0.07],
    )
    saturated: list[float] = described(
        "For how long the motor gave its largest torque and the controller asked for more, per joint.", "s", [0.0] * 6
    )
    electrical: float = described("Energy drawn from the supply, without waiting at the goal.", "J", 152.4)
    electrical_error: float = described("`electrical` / that of the answer - 1.", "1", 1.6e-5)
    mechanical: float = described("Mechanical work.", "J", 61.7)
    mechanical_error: float = described("`mechanical` / that of the answer - 1.", "1", 3e-5)
    contact: DeepestContact | None = part("The deepest contact; null if there was none.")
    collides: bool = described(
        f"Whether a contact is deeper than {TOUCH * 1e3:g} mm, or than `tcp_error` if that is less: a planned distance "
        "may be smaller than any controller's error.",
        None,
        False,
    )


class Run(SimulatedMotion):
    """The motion under one controller."""

    control: ControlName = described("The controller.", None, "feed_forward")


class SimulatedSaving(Response):
    """What the motion saves against a baseline."""

    name: BaselineName = described("Name of the baseline.", None, "controller_default")
    saving: float = described("1 - energy of the motion / energy of the baseline, both simulated.", "1", 0.197)


class ChangedArm(SimulatedMotion):
    """The motion on a changed arm, under the first controller, which does not know of the change."""

    quantity: Quantity = described("What is changed.", None, "friction")
    factor: float = described("By how much it is multiplied.", "1", 1.3)
    savings: list[SimulatedSaving] = part("Savings on this arm, against every baseline on this arm.")


class SavingRange(Response):
    """What the answer saves against a baseline, as planned and as simulated."""

    name: BaselineName = described("Name of the baseline.", None, "controller_default")
    planned: float = described("Saving in the answer.", "1", 0.199)
    simulated: float = described("Saving on the unchanged arm.", "1", 0.199)
    least: float = described("Smallest saving over the unchanged and all changed arms.", "1", 0.181)
    most: float = described("Largest saving over these.", "1", 0.223)
    range: float = described("`most` - `least`, in percentage points.", "1", 4.2)
    persists: bool | None = described("Whether `least` is above zero; null if nothing is saved as planned.", None, True)


class AsPlanned(Response):
    """Energy of the motion in the answer, without waiting at the goal, and the use of its torque limits."""

    electrical: float = described("Energy drawn from the supply.", "J", 152.4)
    mechanical: float = described("Mechanical work.", "J", 61.7)
    limit_ratio: list[float] = described(
        "Largest torque / limit as planned, per joint.", "1", [0.41, 0.52, 0.35, 0.22, 0.18, 0.07]
    )


class ReplayedMotion(Response):
    """A motion of the answer, planned and simulated."""

    leg: int | None = described("Index in `legs` of a cycle, from 0; null for an answer of one motion.", None, None)
    duration: float = described("Duration of the motion.", "s", 1.8)
    planned: AsPlanned = part("What the answer says.")
    torque_error: float | None = described(
        "Largest difference of MuJoCo's torques from those of the answer's samples / limit; null without samples.",
        "1",
        4e-16,
    )
    runs: Annotated[list[Run], Field(min_length=1)] = part("The motion under each controller.")
    changes: list[ChangedArm] = part("The motion on changed arms; empty without `perturb`.")
    savings: list[SavingRange] = part("What is saved against each baseline; empty without `perturb`.")


class ReplayResponse(Answer):
    """Motions of an answer as MuJoCo plays them, beside what the answer says of them."""

    simulator: str = described("The simulator and its version.", None, "MuJoCo 4.0.0")
    motions: Annotated[list[ReplayedMotion], Field(min_length=1)] = part("The motions, in their order.")
    wall_time: float = described("Wall time.", "s", 0.4)
    warnings: list[str] = described(
        "Remarks, in words: joints that give all their torque, contacts, obstacles that are not simulated, and "
        "baselines that cannot be replayed. Empty if there are none.",
        None,
        [],
    )
