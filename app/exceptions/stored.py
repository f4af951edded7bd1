"""Errors of the database and of its objects."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Literal

from joulepath.app.exceptions.base import ServiceError
from joulepath.optimizer.declared import Internal, Unit

StoreFault = Literal[
    "full", "read-only", "locked", "deleted", "other-version", "damaged", "unreachable"
]
"""Faults of the database."""
_FAULTS: dict[StoreFault, str] = {
    "full": "The disk of the database is full: delete answers, jobs, logs or studies that are "
    "not needed, or enlarge the disk. Deleting works.",
    "read-only": "The database is read-only: reading works, and the operator of the service must "
    "make it writable.",
    "locked": "Another process locks the database: try again later, or ask the operator of the "
    "service to end that process.",
    "deleted": "The file of the database was deleted or replaced: the operator of the service must "
    "put it back, or restart the service, which then begins an empty one.",
    "other-version": "Another version of the service made the database: the operator must start "
    "that version, or move the database away, after which the service begins an empty one.",
    "damaged": "The database cannot be read: its file is damaged or no database, or its tables are "
    "not those of the service. The operator must restore a backup, or move the database away, "
    "after which the service begins an empty one.",
    "unreachable": "The database does not answer, or its file cannot be opened: try again later, "
    "or ask the operator of the service, whose log says why.",
}


@dataclass(eq=False)
class StoreUnavailable(ServiceError):
    """The database of studies and answers cannot be reached, read or written; `cause` says why, and
    the service's log has more. Nothing of the request was stored. Requests without a database, for
    example `POST /optimize`, still work. On a full disk, `DELETE` works to free space."""

    status = 503
    retry_after = 5
    title = "Database unavailable"
    remedy = "Try again after the time [s] in the header `Retry-After`."

    cause: StoreFault
    """`full`: no space is left. `read-only`: it takes no changes. `locked`: another process locks
    it. `deleted`: its file was deleted or replaced while the service ran. `other-version`: another
    version of the service made its tables. `damaged`: its file is damaged or no database, or its
    tables are not those of the service. `unreachable`: it does not answer, or its file cannot be
    opened."""

    def __str__(self) -> str:
        return _FAULTS[self.cause]


class UnknownAnswer(ServiceError):
    """No answer with this id is stored. It never existed, its study was deleted, or it was deleted
    to make space for newer answers."""

    status = 404
    title = "Unknown answer"
    remedy = (
        "To get it again, repeat the request that produced it. The command line stores no answers: "
        "`joulepath cycle --answers FOLDER` writes those of a cycle's moves, and `export` and "
        "`replay` read them by the same option."
    )
    detail = "No stored answer has this id: send the request that produced the answer again."


@dataclass(eq=False)
class PartsNeeded(UnknownAnswer):
    """An export refers to missing kept answers."""

    detail = (
        "The answer refers to stored answers that are not available here: export it where the "
        "service stores them."
    )

    names: Annotated[list[str], Internal]
    """Ids or paths of these answers."""


class AnswerInUse(ServiceError):
    """A study or a job refers to the answer."""

    status = 409
    title = "Answer in use"
    remedy = "Delete the study or the job: `DELETE /studies/{id}` or `DELETE /jobs/{id}`."
    detail = "This answer belongs to a study or a job: delete the study or the job."


class UnknownStudy(ServiceError):
    """No study has this id, or the study has no iteration with this number. It never existed, or
    the study was deleted."""

    status = 404
    title = "Unknown study"
    remedy = "Use a study that `GET /studies` lists."
    detail = "No study has this id: GET /studies lists all studies."


class UnknownIteration(UnknownStudy):
    """The study has no iteration with this number."""

    detail = "The study has no iteration of this number: GET /studies/{id} lists its iterations."


class EmptyStudy(ServiceError):
    """The request needs an iteration of the study, but the study has none."""

    status = 409
    title = "Empty study"
    remedy = "Add one with `POST /studies/{id}/iterations`."
    detail = "The study has no iteration yet: add a first iteration, then ask for suggestions."


class UnknownJob(ServiceError):
    """No job has this id. It never existed, it was deleted, or it ended longer ago than jobs are
    kept.
    """

    status = 404
    title = "Unknown job"
    remedy = "Use a job that `GET /jobs` lists."
    detail = "No job has this id: GET /jobs lists all jobs."


class JobNotCancellable(ServiceError):
    """The job has ended: there is nothing left to cancel."""

    status = 409
    title = "Job not cancellable"
    remedy = "Its answers stay until it is deleted with `DELETE /jobs/{id}`."
    detail = (
        "The job has ended: there is nothing left to cancel. DELETE /jobs/{id} deletes it with its "
        "answers."
    )


class RobotExists(ServiceError):
    """The name of the robot is taken."""

    status = 409
    title = "Robot exists"
    remedy = (
        "Use another name, or `PUT /robots/{name}` to replace a robot that was added. The robots "
        "that come with the service can be neither replaced nor deleted."
    )
    detail = (
        "A robot has this name: use another name, or replace the robot (`PUT`, on the command line "
        "`--replace`)."
    )


class BundledRobot(RobotExists):
    """The robot comes with the service and cannot be changed."""

    detail = (
        "This robot comes with the service and can be neither replaced nor deleted: only robots "
        "that were added can. Give a robot of your own another name."
    )


class TooManyRobots(ServiceError):
    """The service holds as many added robots as `JOULEPATH_MAX_ROBOTS` allows, or you have added
    your share of them, which is half of what the other clients leave."""

    status = 409
    title = "Too many robots"
    remedy = "Delete one of yours that is not used with `DELETE /robots/{name}`."
    detail = (
        "The service has reached its limit of added robots, or you have added half of what "
        "other clients leave: delete one that is not used."
    )


class NoMeshes(ServiceError):
    """The meshes of this robot are not installed: `has_meshes` of `GET /robots/{name}` is false."""

    status = 404
    title = "No meshes"
    remedy = (
        "The meshes of ur3e and ur5e come with `pip install 'joulepath[meshes]'`. The capsules of "
        "`GET /robots/{name}` show every robot."
    )
    detail = "No meshes of this robot are installed: the extra `meshes` has those of ur3e and ur5e."


@dataclass(eq=False)
class UnknownLog(ServiceError):
    """No log has this id. It never existed, or it was deleted."""

    status = 404
    title = "Unknown log"
    remedy = "Use a log that `GET /logs` lists."
    detail = "No log has this id: GET /logs lists all logs."

    id: Annotated[str, Internal] = ""
    """The id in the request."""

    def __str__(self) -> str:
        # a text of any other form may be anything, also something secret: it is not repeated
        is_id = re.fullmatch("[0-9a-f-]{36}", self.id) is not None
        return f"No log has the id {self.id}: GET /logs lists all logs." if is_id else self.detail


@dataclass(eq=False)
class TooManyLogs(ServiceError):
    """The stored logs and this one would exceed `JOULEPATH_LOGS_MAX_BYTES`, or your logs your
    share, which is half of what the other clients leave."""

    status = 409
    title = "Too many logs"
    remedy = (
        "Delete logs that are not needed with `DELETE /logs/{id}`; what was identified from them "
        "stays."
    )

    limit: Annotated[int, Unit("byte")]
    """Largest total size of the logs, compressed."""

    def __str__(self) -> str:
        return (
            f"The stored logs would exceed {self.limit} bytes, compressed, or yours half of what "
            "other clients leave of them: delete some of yours that are not needed."
        )


class UnknownIdentification(ServiceError):
    """No identification has this id. It never existed, or it was deleted: an identification is a
    job, kept for the time `JOULEPATH_ANSWERS_MAX_AGE`."""

    status = 404
    title = "Unknown identification"
    remedy = "Send it again with `POST /identifications`."
    detail = (
        "No identification has this id: it may have been deleted because of its age. Send the "
        "request again."
    )


@dataclass(eq=False)
class UnknownFigures(ServiceError):
    """No figures have this id, or no longer."""

    status = 404
    title = "Unknown figures"
    remedy = (
        "Use figures that `GET /figures` lists, or send their document again with `PUT /figures`."
    )
    detail = "No figures have this id: GET /figures lists all figures."

    id: Annotated[str, Internal] = ""
    """The id in the request."""


class FiguresInUse(ServiceError):
    """A study uses these figures."""

    status = 409
    title = "Figures in use"
    remedy = "Delete the study first, with `DELETE /studies/{id}`, or keep the figures."
    detail = "A study uses these figures: delete the study first, with DELETE /studies/{id}."


class TooManyFigures(ServiceError):
    """The service holds as many figures as `JOULEPATH_MAX_FIGURES` allows, or you have stored your
    share of them, which is half of what the other clients leave."""

    status = 409
    title = "Too many figures"
    remedy = "Delete some of yours that are not used with `DELETE /figures/{id}`."
    detail = (
        "The service has reached its limit of figures, or you have stored half of what other "
        "clients leave: delete some that are not used."
    )


class KeyReused(ServiceError):
    """This `Idempotency-Key` was already used for a different request. A key belongs to one request
    and its repetitions."""

    title = "Idempotency-Key reused"
    remedy = "Use a new key for each new request."
    detail = (
        "This Idempotency-Key was already used for a different request: use a new key for each new "
        "request."
    )
