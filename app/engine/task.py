"""Tasks of the engine, run in this process or in a worker."""

from __future__ import annotations

import logging
from typing import Protocol

from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.base import InternalError
from joulepath.optimizer.deadline import Stopped, checkpoint, is_stopped
from joulepath.optimizer.exceptions import DeclaredError

logger = logging.getLogger(__name__)


class Task(Protocol):
    """A picklable piece of work for a worker process."""

    @property
    def request_id(self) -> str:
        """Id of the request, for the worker's log."""

    def run(self, deadline: float) -> TaskResult:
        """The result, within about `deadline` seconds; events go to `listener()`.

        The caller of `Engine.run` receives a JoulepathError or ServiceError unchanged. Any other
        exception is a defect: the worker logs it, and the caller receives InternalError.
        """


def outcome(task: Task, deadline: float) -> TaskResult | DeclaredError | Stopped:
    """The task's result, the error for its caller, or Stopped; all of them can be pickled."""
    ended: TaskResult | DeclaredError
    try:
        checkpoint()
        ended = task.run(deadline)
    except DeclaredError as error:
        ended = error
    except Stopped as stopped:
        return stopped
    except Exception:
        if not is_stopped():
            logger.exception("unforeseen error", extra={"request_id": task.request_id})
        ended = InternalError()
    # A stopped task may end as if its deadline had passed: this is not an answer.
    return Stopped() if is_stopped() else ended
