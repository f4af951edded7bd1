"""Errors of an identification, and of the reading of its logs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from joulepath.optimizer.declared import Count, Internal, Unit
from joulepath.optimizer.exceptions import JoulepathError


@dataclass(eq=False)
class LogTooLarge(JoulepathError):
    """A log has too many rows, or is too large after unpacking."""

    status = 413
    title = "Log too large"
    remedy = "Send it in parts, at a lower rate, or only the columns that are needed."

    limit: Count
    """Most rows or bytes; `detail` says which."""
    unit: Annotated[str, Internal]
    """What is counted: rows, or bytes after unpacking."""

    def __str__(self) -> str:
        return (
            f"The log has more than {self.limit} {self.unit}: send it in parts, at a lower rate, "
            "or only the columns that are needed."
        )


@dataclass(eq=False)
class EffortNotUsable(JoulepathError):
    """The efforts of a log identify no figures of the arm, because they exclude gravity (`meaning`
    is `external`), or because their meaning is unknown (null)."""

    title = "Logged efforts not usable"
    remedy = (
        "Log motor currents: the ROS 2 driver of Universal Robots has the option "
        "`actual_current_as_torque`, which must be off. If you know the meaning of the efforts, "
        "state it in `effort`."
    )

    message: Annotated[str, Internal]
    """The fault of the efforts, and the channels to log instead."""
    meaning: Literal["external"] | None
    """`external`: torques from outside, without gravity. Null: unknown."""
    slope: Annotated[dict[str, float | None], Unit("1/A or 1")]
    """Slope of the effort over the torque of the rigid model, by the name of a joint. About 1 /
    torque constant: current; 1: torque; 0: torque without gravity. Null: the motion does not
    determine the slope."""

    def __str__(self) -> str:
        return self.message


@dataclass(eq=False)
class NotExcited(JoulepathError):
    """The logs identify none of the requested figures."""

    title = "Not excited"
    remedy = (
        "Log motions in which every joint moves, at several speeds and in both directions, with "
        "motor currents or the power of the arm's bus."
    )
    detail = (
        "None of the requested figures can be identified from these logs: log motor currents, "
        "torques or the power of the arm's bus, and motions in which every joint moves, at "
        "several speeds and in both directions."
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
        "do not replace it: they are not DC currents."
    )
    detail = (
        "No log has the power of the arm's bus: log voltage and current of the arm, or its "
        "power. Joint currents do not replace it, because they are not DC currents."
    )


@dataclass(eq=False)
class MethodNotApplicable(JoulepathError):
    """The logs do not meet a requirement of the `method`; `detail` names it."""

    title = "Method not applicable"
    remedy = (
        "Log what the method needs, or choose another method; `automatic` uses what the logs "
        "contain."
    )

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
        "Gravity does not determine the torque constants of all joints, because the payload is "
        "unknown: give `payload` with each log, of mass 0 if there was none, and identify a "
        "payload and torque constants separately."
    )

    joints: Annotated[list[int], Unit("1")]
    """Joints with too little gravity torque for a torque constant, from 0."""
