"""Between the schemas of the contract and the optimizer's dataclasses, both ways."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from app.convert_arm import arm_fields
from app.convert_pose import to_matrix, to_rotation
from app.schemas import request as asked
from app.schemas.compare import ROW_FIELDS, CompareRequest
from app.schemas.ik import IKRequest
from app.schemas.orientation import InCone
from app.schemas.orientation import LoosePose as LoosePoseSchema
from app.schemas.response import Clearance
from optimizer.arm import Pose
from optimizer.collision import Contact
from optimizer.dwell import Cycle
from optimizer.inverse_kinematics import IKSolution
from optimizer.orientation import LoosePose
from optimizer.problem import BranchFilter, Method, Problem
from optimizer.solution import Candidate, Certificate, ElectricalEnergy, Energy, Solution, StorageUse, UnreachableTarget
from optimizer.targets import AnyOf, Single, Target


def to_problem(request: asked.OptimizeRequest, deadline: float) -> Problem:
    """The optimizer's problem for a request of which `deadline` [s] is left.

    Raises UnknownRobot, InvalidProblem or OutsideLimits.
    """
    shortest, longest = _duration(request)
    branch = request.branch
    return Problem(
        start=to_target(request.start),
        goal=to_target(request.goal),
        **arm_fields(request),
        method=request.method,
        objective=request.objective,
        duration_min=shortest,
        duration_max=longest,
        cycle=cycle(request.cycle),
        branch=None if branch is None else BranchFilter(branch.shoulder, branch.elbow, branch.wrist),
        windings=request.windings,
        sample_period=request.sample_period,
        deadline=deadline,
    )


def cycle(asked_for: asked.Cycle | None) -> Cycle | None:
    """The optimizer's cycle. Raises InvalidProblem."""
    if asked_for is None:
        return None
    return Cycle(asked_for.time, asked_for.hold, asked_for.brake_delay, asked_for.brake_power)


def to_target(target: asked.Target) -> Target:
    """The optimizer's target."""
    if isinstance(target, asked.AnyOfTarget):
        return AnyOf(tuple(_single(member) for member in target.any_of))
    return _single(target)


def _single(target: asked.JointTarget | asked.PoseTarget) -> Single:
    if isinstance(target, asked.JointTarget):
        return np.array(target.q)
    return _loose(target.pose) if isinstance(target.pose, LoosePoseSchema) else Pose(to_matrix(target.pose))


def _loose(pose: LoosePoseSchema) -> LoosePose:
    position, orientation = np.array(pose.position), pose.orientation
    if isinstance(orientation, str):
        return LoosePose(position)
    if isinstance(orientation, InCone):
        cone = orientation.cone
        return LoosePose(position, np.array(cone.axis), np.array(cone.direction), cone.half_angle)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = to_rotation(orientation), position
    return LoosePose.about(Pose(T), np.array(orientation.free_about))


def _duration(request: asked.MotionRequest) -> tuple[float | None, float | None]:
    """Bounds on the duration. An open end is closed for the electrical objective: an answer has to end some time."""
    if isinstance(request.duration, float | int):
        return request.duration, request.duration
    given = request.duration or asked.DurationRange()
    if given.max is None and request.objective == "electrical":
        return given.min, min(asked.MAX_DURATION, request.sample_period * asked.MAX_SAMPLES)
    return given.min, given.max


def to_response(request: asked.OptimizeRequest, request_id: str, solution: Solution) -> dict[str, Any]:
    """The answer as the contract lays it out: numbers, strings, lists, dicts, and C-contiguous arrays."""
    trajectory = solution.trajectory
    return {
        "id": request_id,
        "robot": request.robot,
        "method": request.method,
        "objective": request.objective,
        "duration": solution.duration,
        "status": solution.status,
        "branch": {end: fields(getattr(solution, end), "label", "q", "target") for end in ("start", "goal")},
        "trajectory": {
            **fields(trajectory, "t", "q", "v", "a", "tau", "tau_motor", "power", "charge"),
            "spline": fields(trajectory.spline, "degree", "knots", "control_points"),
        },
        "energy": {
            **energy_fields(solution.energy),
            "lower_bound": solution.lower_bound,
            "optimality_gap": _gap(solution.lower_bound, _objective(request, solution)),
        },
        "baselines": baseline_fields(solution),
        "candidates": [candidate_fields(candidate) for candidate in solution.candidates],
        "unreachable": [unreachable_fields(target) for target in solution.unreachable],
        "certificate": certificate_fields(solution.certificate),
        "solver": fields(solution.solver, "wall_time", "iterations", "nlp_solves", "stationarity"),
    }


def to_comparison(
    request: CompareRequest, request_id: str, found: Mapping[Method, Solution], failed: Mapping[Method, dict[str, Any]]
) -> dict[str, Any]:
    """The answer of `POST /compare`: what every method found, at least one, or the problem that it met."""
    energies = {method: _objective(request, solution) for method, solution in found.items()}
    best = min(energies, key=energies.__getitem__)
    # the same candidates, so the same bound, whatever the method
    bound = found[best].lower_bound
    rows = []
    for method in request.methods:
        row: dict[str, Any] = dict.fromkeys(ROW_FIELDS)
        if method in found:
            solution = found[method]
            own = energies[method]
            row |= {
                "status": solution.status,
                "duration": solution.duration,
                "electrical": solution.energy.electrical.total,
                "mechanical": solution.energy.mechanical.total,
                "excess": own / energies[best] - 1 if energies[best] > 0 else 0.0,
                "optimality_gap": _gap(bound, own),
                **fields(solution.solver, "wall_time", "iterations", "nlp_solves"),
                "valid": solution.certificate.valid,
                "worst_ratio": max(solution.certificate.worst_ratio.values()),
            }
            if request.answers:
                row["answer"] = to_response(single(request, method), request_id, solution)
        rows.append({**row, "method": method, "problem": failed.get(method)})
    return {
        "id": request_id,
        "robot": request.robot,
        "objective": request.objective,
        "lower_bound": bound,
        "best": best,
        "methods": rows,
        "baselines": baseline_fields(found[best]),
    }


def single(request: CompareRequest, method: Method) -> asked.OptimizeRequest:
    """The request to `POST /optimize` that a row of a comparison answers."""
    shared = {name: getattr(request, name) for name in asked.MotionRequest.model_fields}
    # each part has been validated
    return asked.OptimizeRequest.model_construct(method=method, **shared)


def _objective(request: asked.MotionRequest, solution: Solution) -> float:
    energy = solution.energy
    return energy.electrical.total if request.objective == "electrical" else energy.mechanical.total


def _gap(bound: float, energy: float) -> float:
    """1 - bound / energy; a motion that costs nothing is as good as can be."""
    return 1 - bound / energy if energy > 0 else 0.0


def baseline_fields(solution: Solution) -> list[dict[str, Any]]:
    """The entries of `baselines`."""
    names = ("name", "duration", "electrical", "mechanical", "within_limits", "saving")
    return [fields(baseline, *names) for baseline in solution.baselines]


def candidate_fields(candidate: Candidate) -> dict[str, Any]:
    """One entry of `candidates`."""
    ends = ("start", "start_target", "goal", "goal_target", "q_start", "q_goal")
    return fields(candidate, *ends, "status", "reason", "lower_bound", "energy", "duration")


def unreachable_fields(target: UnreachableTarget) -> dict[str, Any]:
    """One entry of `unreachable`."""
    return fields(target, "end", "target", "reason")


def energy_fields(energy: Energy) -> dict[str, Any]:
    """Energy as every answer lays it out."""
    return {
        "electrical": fields(energy.electrical, *ElectricalEnergy.__dataclass_fields__),
        "mechanical": fields(energy.mechanical, "total", "per_joint"),
        "per_joint": fields(energy.per_joint, "friction", "copper", "inverter", "shaft"),
        "storage": None if energy.storage is None else fields(energy.storage, *StorageUse.__dataclass_fields__),
        **fields(energy, "peak_power", "mean_power"),
    }


def certificate_fields(certificate: Certificate) -> dict[str, Any]:
    """A certificate as every answer lays it out."""
    clearance = certificate.clearance
    return {
        "worst_ratio": certificate.worst_ratio,
        "start_error": dict(zip(("position", "rotation"), certificate.start_error, strict=True)),
        "goal_error": dict(zip(("position", "rotation"), certificate.goal_error, strict=True)),
        **fields(certificate, "energy_error", "balance_error"),
        "clearance": None if clearance is None else fields(clearance, *Clearance.model_fields),
    }


def fields(source: object, *names: str) -> dict[str, Any]:
    """Attributes by name. The JSON encoder takes arrays in C order only, and writes what is not finite as null."""
    values = {name: getattr(source, name) for name in names}
    return {
        name: np.ascontiguousarray(value) if isinstance(value, np.ndarray) else value for name, value in values.items()
    }


def to_ik_response(
    request: IKRequest, request_id: str, solutions: Sequence[IKSolution], contacts: Sequence[Contact]
) -> dict[str, Any]:
    """The answer of `POST /ik`."""
    return {
        "id": request_id,
        "robot": request.robot,
        "solutions": [
            {
                "label": str(solution.label),
                **fields(solution, "q", "limit_distance", "smallest_singular_value"),
                "collides": contact.distance < 0,
                "nearest": fields(contact, "pair", "distance"),
            }
            for solution, contact in zip(solutions, contacts, strict=True)
        ],
    }
