"""Errors of an identification."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from joulepath.optimizer.declared import Count, Internal, Unit
from joulepath.optimizer.exceptions import JoulepathError


@dataclass(eq=False)
class NotExcited(JoulepathError):
    """The logs identify none of the requested figures."""

    title = "Not excited"
    remedy = (
        "Log motions in which every joint moves, at several speeds and in both directions, with "
        "motor currents or the power of the arm's bus."
    )
    detail = (
        "Nothing that was asked for can be identified from these logs: log motor currents, torques "
        "or the power of the arm's bus, and motions in which every joint moves, at several speeds "
        "and in both directions."
    )

    parameters: list[str]
    """Parameters that cannot be identified."""
    advice: dict[str, Any]
    """A body for `POST /excitation`; its motion identifies these parameters. Add the scene of your
    cell."""


@dataclass(eq=False)
class NothingHeldOut(JoulepathError):
    """The logs have fewer than two different motions, so no move can be held out for the
    validation. A motion and its repetitions, in either direction, count as one."""

    title = "Nothing held out"
    remedy = "Log more motions, or name other logs in `validate`."

    moves: Count
    """Number of moves in the logs."""

    def __str__(self) -> str:
        return (
            f"The logs have {self.moves} moves along fewer than two different motions, so that "
            "none can be held out: log at least two different motions, or name other logs in "
            "`validate`."
        )


class NoPowerChannel(JoulepathError):
    """Power is requested, and no log has the power of the arm's bus."""

    title = "No power channel"
    remedy = (
        "Log `actual_robot_voltage` and `actual_robot_current`, or a column `P`. Joint currents "
        "are not taken for it: they are no DC currents."
    )
    detail = (
        "No log has the power of the arm's bus: log voltage and current of the arm, or its power. "
        "Joint currents are not taken for it, as they are no DC currents."
    )


@dataclass(eq=False)
class MethodNotApplicable(JoulepathError):
    """The logs do not meet a requirement of the `method`; `detail` names it."""

    title = "Method not applicable"
    remedy = "Log it, or choose another method; `automatic` takes what the logs have."

    method: str
    """The requested method."""
    needs: Annotated[str, Internal]
    """Requirement of the method, as a sentence."""

    def __str__(self) -> str:
        return f"The method {self.method} does not fit these logs: {self.needs}"


@dataclass(eq=False)
class PayloadUnknown(JoulepathError):
    """`torque_constant` is requested, and the payload of the logs is not known."""

    title = "Payload unknown"
    remedy = (
        'Send the logs again with `payload`: `{"mass": 0}` if the arm carried nothing. A payload '
        "is found from two "
        'logs, by `"fit": ["payload"]` without `torque_constant`.'
    )
    detail = (
        "Gravity does not tell the torque constants of all joints, and nobody said what the arm "
        "carried: give `payload` with each log, of mass 0 if it was nothing, and find a payload "
        "and torque constants one by one."
    )

    joints: Annotated[list[int], Unit("1")]
    """Joints with too little gravity torque for a torque constant, from 0."""
