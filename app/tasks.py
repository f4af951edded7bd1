"""What a worker process does with a request."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import orjson

from app.convert import to_problem, to_response
from app.errors import Reply, ServiceError, problem_reply
from app.schemas.request import OptimizeRequest
from models.registry import robot_names
from optimizer.exceptions import JoulepathError
from optimizer.optimize import optimize, warm_up

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class OptimizeTask:
    """A validated request and its id."""

    request: OptimizeRequest
    request_id: str

    def run(self, deadline: float) -> Reply:
        """The answer, or the problem, within about `deadline` seconds."""
        return answer(self.request_id, lambda: self._solve(deadline))

    def _solve(self, deadline: float) -> Reply:
        solution = optimize(to_problem(self.request, deadline))
        if not solution.certificate.valid:
            raise AssertionError(f"The optimizer returned a motion that does not hold: {solution.certificate}")
        return json_reply(to_response(self.request, self.request_id, solution))


def answer(request_id: str, work: Callable[[], Reply]) -> Reply:
    """What the work returns, or the problem that it raises."""
    try:
        return work()
    except (JoulepathError, ServiceError) as error:
        return problem_reply(error, request_id)
    except Exception as error:
        logger.exception("unforeseen error", extra={"request_id": request_id})
        return problem_reply(error, request_id)


def json_reply(content: dict[str, Any]) -> Reply:
    """An answer as JSON; what is not finite is null."""
    return Reply(200, orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY))


def warm() -> None:
    """Loads all that a first request would otherwise wait for."""
    for name in robot_names():
        warm_up(name)
