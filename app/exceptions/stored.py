"""Errors of the database and of what is stored in it."""

from __future__ import annotations

from typing import ClassVar, Literal

from joulepath.app.exceptions.base import ServiceError

StoreFault = Literal["full", "read-only", "locked", "deleted", "unreachable"]
"""What is wrong with the database."""


class StoreUnavailable(ServiceError):
    """The database cannot be reached, read or written; the log has the driver's words."""

    MESSAGES: ClassVar[dict[StoreFault, str]] = {
        "full": "The disk of the database is full: delete studies that are not needed, or enlarge the disk. Deleting "
        "works.",
        "read-only": "The database is read-only: reading works, and the operator of the service must make it writable.",
        "locked": "Another process locks the database: try again later, or ask the operator of the service to end that "
        "process.",
        "deleted": "The file of the database was deleted or replaced: the operator of the service must put it back, or "
        "restart the service, which then begins an empty one.",
        "unreachable": "The database does not answer: try again later, or ask the operator of the service.",
    }

    def __init__(self, cause: StoreFault) -> None:
        Exception.__init__(self, self.MESSAGES[cause])
        self.cause = cause


class UnknownAnswer(ServiceError):
    """No stored answer has that id."""

    MESSAGE = "No stored answer has this id: send the request that produced the answer again."


class PartsNeeded(UnknownAnswer):
    """An export refers to kept answers, by their ids or paths `names`, that are not at hand."""

    MESSAGE = "The answer refers to kept answers that are not at hand: export it where the service keeps them."

    def __init__(self, names: list[str]) -> None:
        super().__init__()
        self.names = names


class UnknownStudy(ServiceError):
    """No study has that id."""

    MESSAGE = "No study has this id: GET /studies lists all studies."


class UnknownIteration(UnknownStudy):
    """The study has no iteration of that number."""

    MESSAGE = "The study has no iteration of this number: GET /studies/{id} lists its iterations."


class UnknownJob(ServiceError):
    """No job has that id."""

    MESSAGE = "No job has this id: GET /jobs lists all jobs."


class JobNotCancellable(ServiceError):
    """The job has ended."""

    MESSAGE = "The job has ended: there is nothing left to cancel. DELETE /jobs/{id} deletes it with its answers."


class EmptyStudy(ServiceError):
    """The study has no iteration that suggestions could start from."""

    MESSAGE = "The study has no iteration yet: add a first iteration, then ask for suggestions."


class RobotExists(ServiceError):
    """The name of a robot is taken."""

    MESSAGE = "A robot has this name: use another name, or replace the robot (`PUT`, on the command line `--replace`)."


class BundledRobot(RobotExists):
    """The robot comes with the service: nobody adds, replaces or deletes it."""

    MESSAGE = (
        "This robot comes with the service and can be neither replaced nor deleted: only robots that were added can. "
        "Give a robot of your own another name."
    )


class TooManyRobots(ServiceError):
    """The service holds as many robots of users as it may."""

    MESSAGE = "The service holds as many added robots as it may: delete one that is not used."


class UnknownLog(ServiceError):
    """No log has the `id` that the request names."""

    MESSAGE = "No log has this id: GET /logs lists all logs."

    def __init__(self, id: str = "") -> None:
        super().__init__()
        self.id = id


class UnknownIdentification(ServiceError):
    """No identification has that id."""

    MESSAGE = "No identification has this id: it may be older than the service keeps jobs. Send it again."


class TooManyLogs(ServiceError):
    """The stored logs and a new one would exceed `limit` bytes."""

    def __init__(self, limit: int) -> None:
        Exception.__init__(
            self, f"The stored logs would exceed {limit} bytes, compressed: delete some that are not needed."
        )
        self.limit = limit


class KeyReused(ServiceError):
    """The Idempotency-Key was used for a different request."""

    MESSAGE = "This Idempotency-Key was already used for a different request: use a new key for each new request."


class AnswerInUse(ServiceError):
    """The answer belongs to a study or a job, which refers to it."""

    MESSAGE = "This answer belongs to a study or a job: delete that."
