"""POST /compare: from its request to those of POST /optimize, and from solutions to its answer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from joulepath.app.answers.bounded_energy import optimality_gap
from joulepath.app.convert.fields import fields
from joulepath.app.schemas import request as asked
from joulepath.app.schemas.compare import ROW_FIELDS, CompareRequest
from joulepath.optimizer.compare import Comparison
from joulepath.optimizer.problem.problem import MethodName


def to_compare_response(
    request: CompareRequest,
    request_id: str,
    found: Comparison,
    failed: Mapping[MethodName, dict[str, Any]],
    answers: Mapping[MethodName, Any],
) -> dict[str, Any]:
    """The answer of `POST /compare`.

    `failed` has the error document of every method that found no motion, `answers` the complete
    answers that the rows are to contain.
    """
    rows, bound = list[dict[str, Any]](), found.lower_bound
    for method, solution in ((each.method, each.solution) for each in found.methods):
        row: dict[str, Any] = dict.fromkeys(ROW_FIELDS)
        if solution is not None:
            row |= {
                "status": solution.status,
                "duration": solution.duration,
                "electrical": solution.energy.electrical.total,
                "mechanical": solution.energy.mechanical.total,
                "excess": found.excess(method),
                "optimality_gap": optimality_gap(bound, solution.energy.of(found.objective)),
                **fields(solution.solver, "wall_time", "iterations", "nlp_solves"),
                "valid": solution.certificate.valid,
                "worst_ratio": max(solution.certificate.worst_ratio.values()),
            }
            row["answer"] = answers.get(method)
        rows.append({**row, "method": method, "problem": failed.get(method)})
    return {
        "request": request_id,
        "id": None,
        "robot": request.robot,
        "objective": request.objective,
        "lower_bound": bound,
        "best": found.best,
        "methods": rows,
        "baselines": found.solutions[found.best].baselines,
    }


def to_optimize_request(request: CompareRequest, method: MethodName) -> asked.OptimizeRequest:
    """The request of `POST /optimize` whose answer a row of the comparison has."""
    shared = {name: getattr(request, name) for name in asked.MotionRequest.model_fields}
    # every field was validated with the request
    return asked.OptimizeRequest.model_construct(method=method, **shared)
