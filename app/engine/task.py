"""Tasks: what the engine runs, here or in another process."""

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
        """Id of the request that the task belongs to; the worker's log names it."""

    def run(self, deadline: float) -> TaskResult:
        """The result, within about `deadline` seconds. What it finds before goes to `listener()`.

        A JoulepathError or ServiceError reaches the caller of `Engine.run` as it is. Any other
        exception is a defect: the worker logs it, and the caller gets InternalError.
        """


def outcome(task: Task, deadline: float) -> TaskResult | DeclaredError | Stopped:
    """The task's result, the error that its caller gets, or that it was stopped; all can be
    pickled.
    """
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
    # a task that is stopped may end as if its deadline had passed: that is no answer for whoever
    # gave its worker back
    return Stopped() if is_stopped() else ended
