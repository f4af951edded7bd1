"""What a worker process does with a request."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import orjson

from app.convert import to_problem, to_response
from app.errors import Reply, problem_reply
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
        try:
            solution = optimize(to_problem(self.request, deadline))
            if not solution.certificate.valid:
                raise AssertionError(f"The optimizer returned a motion that does not hold: {solution.certificate}")
            content = to_response(self.request, self.request_id, solution)
            return Reply(200, orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY))
        except JoulepathError as error:
            return problem_reply(error, self.request_id)
        except Exception as error:
            logger.exception("unforeseen error", extra={"request_id": self.request_id})
            return problem_reply(error, self.request_id)


def warm() -> None:
    """Loads all that a first request would otherwise wait for."""
    for name in robot_names():
        warm_up(name)
