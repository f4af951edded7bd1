"""Errors of excitations."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.exceptions import JoulepathError


@dataclass(eq=False)
class ExcitationInfeasible(JoulepathError):
    """No start led to an excitation within its limits. The last start exceeded `limit`."""

    title = "No excitation within the limits"
    remedy = (
        "For `clearance`, move obstacles, reduce the clearance, or give a `centre` with more "
        "room; for `position`, widen the limit, or give such a `centre` or a shorter `period`; "
        "otherwise relax the limit or give a longer `period`."
    )

    limit: str
    """`clearance`, or a name of `worst_ratio` in a certificate: `position`, `velocity`, `torque`,
    …"""

    def __str__(self) -> str:
        remedy = "relax this limit, or give a longer period"
        if self.limit == "clearance":
            remedy = "move the obstacles, reduce the clearance, or give a centre with more room"
        elif self.limit == "position":
            remedy = "widen this limit, give a centre with more room, or give a shorter period"
        return (
            f"No excitation within the limits was found. The last one exceeded {self.limit}: "
            f"{remedy}."
        )
