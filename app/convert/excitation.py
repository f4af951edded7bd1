"""POST /excitation: from its request to a problem, and from the motion found to its answer, as JSON or CSV."""

from __future__ import annotations

import csv
from io import StringIO
from typing import Any

import numpy as np

from joulepath.app.convert.arm import to_arm
from joulepath.app.convert.arm_fields import arm_fields
from joulepath.app.convert.fields import fields
from joulepath.app.convert.until import time_left, until
from joulepath.app.schemas.excitation import ExcitationRequest
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.excitation.excitation_problem import LEAST_DEADLINE, ExcitationProblem
from joulepath.optimizer.excitation.excite import Excitation


def to_excitation_problem(request: ExcitationRequest, deadline: float) -> ExcitationProblem:
    """The problem of a request, of whose time `deadline` [s] is left.

    Raises UnknownRobot, InvalidProblem or DeadlineExceeded.
    """
    # it may have passed while the request waited
    end = Deadline.after(max(deadline, LEAST_DEADLINE))
    with until(end):
        arm = to_arm(request)
    same = ("period", "harmonics", "criterion", "speed_fraction", "clearance", "mounting_plane", "starts")
    return ExcitationProblem(
        arm=arm,
        parts=tuple(request.parameters),
        centre=None if request.centre is None else np.array(request.centre),
        noise=None if request.noise is None else np.array(request.noise),
        sample_period=request.sample_period,
        deadline=time_left(end),
        **{name: getattr(request, name) for name in same},
    )


def to_excitation_response(request: ExcitationRequest, request_id: str, found: Excitation) -> dict[str, Any]:
    """The answer of `POST /excitation`."""
    return {
        "request": request_id,
        "id": None,
        "robot": request.robot,
        "arm": arm_fields(request),
        "coefficients": fields(found, "period", "centre", "a", "b"),
        "trajectory": found.trajectory,
        "energy": found.energy,
        **fields(found, "condition", "scaled_condition"),
        "predicted_sd": [
            {"parameter": name, "sd": sd} for name, sd in zip(found.names, found.predicted_sd.tolist(), strict=True)
        ],
        **fields(found, "starts", "feasible"),
        "certificate": found.certificate,
    }


def to_excitation_csv(found: Excitation) -> str:
    """CSV with the columns t, then q, v and a of every joint: what `POST /evaluate` takes."""
    samples, text = found.trajectory, StringIO()
    joints = range(1, samples.q.shape[1] + 1)
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["t", *(f"{name}{joint}" for name in "qva" for joint in joints)])
    writer.writerows(np.hstack([samples.t[:, None], samples.q, samples.v, samples.a]).tolist())
    return text.getvalue()
