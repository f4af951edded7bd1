"""The errors of an identification, each with its data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from joulepath.optimizer.exceptions import JoulepathError


class NotExcited(JoulepathError):
    """The logs of a `robot` tell nothing of what was asked; `parameters` are its names.

    `excite` are the parameters that an excitation is to tell apart, with a payload of `mass` [kg] at `com` (3,) [m].
    `advice` is the request for it.
    """

    def __init__(
        self, parameters: Sequence[str], robot: str, excite: Sequence[str], mass: float = 0.0, com: Sequence[float] = ()
    ) -> None:
        super().__init__(
            "Nothing that was asked for can be identified from these logs: log motions in which every joint moves, at "
            "several speeds and in both directions."
        )
        self.parameters = list(parameters)
        carried = {"payload": {"mass": mass, "com": list(com)}} if mass > 0 else {}
        self.advice: dict[str, Any] = {"robot": robot, "parameters": list(excite), **carried}


class NothingHeldOut(JoulepathError):
    """The logs have `moves` moves, along fewer than two different motions."""

    def __init__(self, moves: int) -> None:
        super().__init__(
            f"The logs have {moves} moves along fewer than two different motions, so that none can be held out: log at "
            "least two different motions, or name other logs in `validate`."
        )
        self.moves = moves


class NoPowerChannel(JoulepathError):
    """Power was asked for, and no log has it."""

    def __init__(self) -> None:
        super().__init__(
            "No log has the power of the arm's bus: log voltage and current of the arm, or its power. Joint currents "
            "are not taken for it, as they are no DC currents."
        )


class MethodNotApplicable(JoulepathError):
    """The logs do not have what the `method` needs."""

    def __init__(self, method: str, needs: str) -> None:
        super().__init__(f"The method {method} does not fit these logs: {needs}")
        self.method = method


class PayloadUnknown(JoulepathError):
    """Torque constants were asked for, and it is not known what the arm carried; `joints` carry too little to tell."""

    def __init__(self, joints: Sequence[int]) -> None:
        super().__init__(
            "Gravity does not tell the torque constants of all joints, and nobody said what the arm carried: give "
            "`payload` with each log, of mass 0 if it was nothing, and find a payload and torque constants one by one."
        )
        self.joints = list(joints)
