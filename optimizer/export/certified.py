"""Certificate of an exported motion, computed again for the exported splines and speeds."""

from __future__ import annotations

import numpy as np

from joulepath.optimizer.certificate import certify
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.evaluate.errors import NotCertified
from joulepath.optimizer.exceptions import InvalidProblem, OutsideLimits
from joulepath.optimizer.export.program import Program
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.problem.problem import DURATIONS, Problem
from joulepath.optimizer.result.certificate import Certificate


@one_thread()
def certified(program: Program) -> list[Certificate]:
    """Certificates of all moves of a program.

    Limits of the arm, standstill at the ends and clearance are checked, but not a tool path.

    Raises:
        NotCertified: the certificate of a move is not valid.
        InvalidProblem: a move takes too long.
        DeadlinePassed: the watched deadline passed.
    """
    certificates = []
    for index, move in enumerate(program.moves):
        checkpoint()
        if move.duration > DURATIONS.longest:
            raise InvalidProblem(
                "speed_scale",
                f"A move takes more than {DURATIONS.longest:g} s: give a larger speed_scale.",
            )
        ends = move.spline.control_points[0], move.spline.control_points[-1]
        try:
            problem = Problem(start=ends[0], goal=ends[1], arm=move.arm)
        except OutsideLimits as error:
            raise NotCertified(index, str(error), {}) from None
        certificate = certify(problem, move.spline, *ends, Plant(move.arm).energy(move.spline))
        if not certificate.valid:
            raise NotCertified(index, _reason(certificate), certificate.worst_ratio)
        certificates.append(certificate)
    return certificates


def _reason(certificate: Certificate) -> str:
    """Reason for an invalid certificate, in words."""
    worst = max(certificate.worst_ratio, key=lambda name: _nan_first(certificate.worst_ratio[name]))
    if not certificate.worst_ratio[worst] <= 1:
        return f"its {worst} is at {certificate.worst_ratio[worst]:.4g} of the limit"
    if certificate.clearance is not None and certificate.clearance.min_clearance < 0:
        return certificate.clearance.message
    if not certificate.rest_error <= certificate.REST_TOLERANCE:
        return "it does not begin and end at rest"
    return "its energy cannot be confirmed"


def _nan_first(ratio: float) -> float:
    return np.inf if np.isnan(ratio) else ratio
