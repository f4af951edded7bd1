"""Types of error about logs of arms. A docstring is the text of the type's page."""

from __future__ import annotations

from typing import Literal

from joulepath.app.schemas.common import described
from joulepath.app.schemas.errors.problem_details import ProblemDetails, fixed


class EffortNotUsable(ProblemDetails):
    """The efforts of a log say nothing of the arm, because they are without gravity (`meaning` is `external`), or it is
    not clear what they are (null). Log motor currents: the ROS 2 driver of Universal Robots has the option
    `actual_current_as_torque`, which must be off. If you know what they are, say so with `effort`."""

    type: Literal["/problems/effort-not-usable"] = fixed("type", "/problems/effort-not-usable")
    title: Literal["Logged efforts not usable"] = fixed("title", "Logged efforts not usable")
    status: Literal[422] = fixed("status", 422)
    meaning: Literal["external"] | None = described(
        "`external`: torques from outside, without gravity. Null: it is not clear.", None, "external"
    )
    slope: dict[str, float | None] = described(
        "Slope of the effort against the torque of the rigid model, by the name of a joint. About 1 / torque constant: "
        "current; 1: torque; 0: without gravity. Null: the motion does not tell.",
        "1/A or 1",
        {"shoulder_lift_joint": 0.02, "elbow_joint": 0.03},
    )


class ExcitationInfeasible(ProblemDetails):
    """No excitation was found that keeps its limits from any start. `limit` names the one that the last start broke.
    For `clearance`, move obstacles, ask for less, or give a `centre` with more room; else relax the limit or give a
    longer `period`."""

    type: Literal["/problems/excitation-infeasible"] = fixed("type", "/problems/excitation-infeasible")
    title: Literal["No excitation within the limits"] = fixed("title", "No excitation within the limits")
    status: Literal[422] = fixed("status", 422)
    limit: str = described(
        "`clearance`, or a name of `worst_ratio` in a certificate: `position`, `velocity`, `torque`, …",
        None,
        "clearance",
    )


class LogTooLarge(ProblemDetails):
    """A log has too many rows, or is too large after unpacking. Send it in parts, at a lower rate, or only the columns
    that count."""

    type: Literal["/problems/log-too-large"] = fixed("type", "/problems/log-too-large")
    title: Literal["Log too large"] = fixed("title", "Log too large")
    status: Literal[413] = fixed("status", 413)
    limit: int = described("Most rows or bytes; `detail` says which.", "1", 1_000_000)


class UnknownLog(ProblemDetails):
    """No log has this id. It never existed, or it was deleted. `GET /logs` lists all logs."""

    type: Literal["/problems/unknown-log"] = fixed("type", "/problems/unknown-log")
    title: Literal["Unknown log"] = fixed("title", "Unknown log")
    status: Literal[404] = fixed("status", 404)


class TooManyLogs(ProblemDetails):
    """The stored logs and this one would exceed `JOULEPATH_LOGS_MAX_BYTES`. Delete logs that are not needed with
    `DELETE /logs/{id}`; what was identified from them stays."""

    type: Literal["/problems/too-many-logs"] = fixed("type", "/problems/too-many-logs")
    title: Literal["Too many logs"] = fixed("title", "Too many logs")
    status: Literal[409] = fixed("status", 409)
    limit: int = described("Largest total size of the logs, compressed.", "byte", 1_073_741_824)
