"""Types of error about identifications. A docstring is the text of the type's page."""

from __future__ import annotations

from typing import Any, Literal

from joulepath.app.schemas.common import described
from joulepath.app.schemas.errors.problem_details import ProblemDetails, fixed


class NotExcited(ProblemDetails):
    """Nothing that was asked for can be identified from the logs. Log motions in which every joint moves, at several
    speeds and in both directions, with motor currents or the power of the arm's bus."""

    type: Literal["/problems/not-excited"] = fixed("type", "/problems/not-excited")
    title: Literal["Not excited"] = fixed("title", "Not excited")
    status: Literal[422] = fixed("status", 422)
    parameters: list[str] = described("What cannot be identified.", None, ["coulomb", "viscous"])
    advice: dict[str, Any] = described(
        "A body for `POST /excitation`, whose motion tells these parameters. Add the scene of your cell.",
        None,
        {"robot": "ur5e", "parameters": ["rotor", "friction"]},
    )


class NothingHeldOut(ProblemDetails):
    """The logs have fewer than two different motions, so that no move can be held out for the validation. A motion and
    its repetitions, in either direction, count as one. Log more motions, or name other logs in `validate`."""

    type: Literal["/problems/nothing-held-out"] = fixed("type", "/problems/nothing-held-out")
    title: Literal["Nothing held out"] = fixed("title", "Nothing held out")
    status: Literal[422] = fixed("status", 422)
    moves: int = described("Number of moves in the logs.", "1", 1)


class NoPowerChannel(ProblemDetails):
    """Power is to be identified, and no log has the power of the arm's bus. Log `actual_robot_voltage` and
    `actual_robot_current`, or a column `P`. Joint currents are not taken for it: they are no DC currents."""

    type: Literal["/problems/no-power-channel"] = fixed("type", "/problems/no-power-channel")
    title: Literal["No power channel"] = fixed("title", "No power channel")
    status: Literal[422] = fixed("status", 422)


class MethodNotApplicable(ProblemDetails):
    """The logs do not have what the `method` needs: `detail` says what is missing. Log it, or choose another method;
    `automatic` takes what the logs have."""

    type: Literal["/problems/method-not-applicable"] = fixed("type", "/problems/method-not-applicable")
    title: Literal["Method not applicable"] = fixed("title", "Method not applicable")
    status: Literal[422] = fixed("status", 422)
    method: str = described("The method that was asked for.", None, "periodic")


class PayloadUnknown(ProblemDetails):
    """`torque_constant` is asked for, it is not known what the arm carried, and joints carry too little weight to tell
    their constants. Send the logs again with `payload`: `{"mass": 0}` if the arm carried nothing. A payload is found
    from two logs, by `"fit": ["payload"]` without `torque_constant`."""

    type: Literal["/problems/payload-unknown"] = fixed("type", "/problems/payload-unknown")
    title: Literal["Payload unknown"] = fixed("title", "Payload unknown")
    status: Literal[422] = fixed("status", 422)
    joints: list[int] = described("Joints at which gravity tells no torque constant, from 0.", "1", [0, 5])


class UnknownIdentification(ProblemDetails):
    """No identification has this id. It never existed, or it was deleted: an identification is a job, which is kept as
    long as `JOULEPATH_ANSWERS_MAX_AGE` says."""

    type: Literal["/problems/unknown-identification"] = fixed("type", "/problems/unknown-identification")
    title: Literal["Unknown identification"] = fixed("title", "Unknown identification")
    status: Literal[404] = fixed("status", 404)
