"""POST /optimize: from a solution to its answer."""

from __future__ import annotations

from typing import Any, Protocol

from joulepath.app.convert.candidates import candidate_counts, candidate_fields, chosen
from joulepath.app.convert.fields import fields, unreachable_fields
from joulepath.app.convert.warnings import certified_warnings
from joulepath.app.schemas.request import WhichCandidates
from joulepath.app.schemas.response import Clearance
from joulepath.optimizer.problem.arm import LIMIT_NAMES
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.solution import (
    Certificate,
    ElectricalEnergy,
    Energy,
    EnergyInterval,
    LimitsInForce,
    Objective,
    Solution,
    StorageUse,
    Trajectory,
)


class Asked(Protocol):
    """What an answer repeats of its request."""

    robot: str
    method: MethodName
    candidates: WhichCandidates

    @property
    def objective(self) -> Objective:
        """The energy that is minimised."""
        ...


def to_optimize_response(
    request: Asked, request_id: str, solution: Solution, arm: dict[str, Any] | None
) -> dict[str, Any]:
    """The answer of `POST /optimize`: numbers, strings, lists, dicts, and arrays in C order.

    `arm` is that of `arm_fields`. Its `id` and its last field, `answer`, are None: who keeps the answer sets them.
    """
    return {
        "request": request_id,
        "id": None,
        "robot": request.robot,
        "arm": arm,
        "method": request.method,
        "objective": request.objective,
        "duration": solution.duration,
        "status": solution.status,
        "branch": {end: fields(getattr(solution, end), "label", "q", "target") for end in ("start", "goal")},
        "trajectory": trajectory_fields(solution.trajectory),
        "energy": {
            **energy_fields(solution.energy),
            "lower_bound": solution.lower_bound,
            "optimality_gap": optimality_gap(solution.lower_bound, solution.energy.of(request.objective)),
        },
        "limits": limit_fields(solution.limits),
        "baselines": baseline_fields(solution),
        "candidates": [candidate_fields(candidate) for candidate in chosen(solution.candidates, request.candidates)],
        "candidate_counts": candidate_counts(solution.candidates),
        "unreachable": [unreachable_fields(target) for target in solution.unreachable],
        "certificate": certificate_fields(solution.certificate),
        "warnings": certified_warnings(solution),
        "solver": fields(solution.solver, "wall_time", "iterations", "nlp_solves", "stationarity"),
        # the last: see `TaskResult.of_kept_json`
        "answer": None,
    }


def trajectory_fields(trajectory: Trajectory) -> dict[str, Any]:
    """The fields of a motion."""
    return {
        **fields(trajectory, "t", "q", "v", "a", "tau", "tau_motor", "power", "charge"),
        "spline": fields(trajectory.spline, "degree", "knots", "control_points"),
    }


def optimality_gap(bound: float, energy: float) -> float:
    """1 - bound / energy; 0 if the energy is not positive."""
    return 1 - bound / energy if energy > 0 else 0.0


def baseline_fields(solution: Solution) -> list[dict[str, Any]]:
    """The entries of `baselines`."""
    names = ("name", "duration", "electrical", "mechanical", "within_limits", "reason", "saving")
    return [
        {
            **fields(each, *names),
            "saving_interval": None if each.saving_interval is None else vars(each.saving_interval),
        }
        for each in solution.baselines
    ]


def limit_fields(limits: LimitsInForce) -> dict[str, Any]:
    """The limits in force; an infinite one becomes null in JSON."""
    names = {name: getattr(limits.joints, attribute) for name, attribute in LIMIT_NAMES.items()}
    return {
        "position_min": limits.joints.q_min,
        "position_max": limits.joints.q_max,
        **names,
        **fields(limits, "tcp_speed", "elbow_speed"),
    }


def energy_fields(energy: Energy) -> dict[str, Any]:
    """The fields `electrical` to `mean_power` of an energy."""
    interval = energy.electrical.interval
    return {
        "electrical": {
            **fields(energy.electrical, *ElectricalEnergy.__dataclass_fields__),
            "interval": None if interval is None else fields(interval, *EnergyInterval.__dataclass_fields__),
        },
        "mechanical": fields(energy.mechanical, "total", "per_joint"),
        "per_joint": fields(energy.per_joint, "friction", "copper", "inverter", "shaft"),
        "storage": None if energy.storage is None else fields(energy.storage, *StorageUse.__dataclass_fields__),
        **fields(energy, "peak_power", "mean_power"),
    }


def certificate_fields(certificate: Certificate) -> dict[str, Any]:
    """The fields of a certificate."""
    clearance = certificate.clearance
    return {
        "worst_ratio": certificate.worst_ratio,
        "start_error": dict(zip(("position", "rotation"), certificate.start_error, strict=True)),
        "goal_error": dict(zip(("position", "rotation"), certificate.goal_error, strict=True)),
        **fields(certificate, "energy_error", "balance_error"),
        "clearance": None if clearance is None else fields(clearance, *Clearance.model_fields),
    }
