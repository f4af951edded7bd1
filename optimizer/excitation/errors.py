"""The error of excitations."""

from __future__ import annotations

from joulepath.optimizer.exceptions import JoulepathError


class ExcitationInfeasible(JoulepathError):
    """No start of an excitation gave a motion within all limits; `limit` names the one that the last one broke."""

    def __init__(self, limit: str) -> None:
        remedy = "relax it, or give a longer period"
        if limit == "clearance":
            remedy = "move the obstacles, ask for less clearance, or give a centre with more room"
        super().__init__(f"No excitation was found that keeps its limits, the last one broke {limit}: {remedy}.")
        self.limit = limit
