"""The base of the service's own errors, and what does not fit the schema.

ServiceError
├── InvalidRequest      the request does not fit the schema
├── Busy                the queue is full
│   ├── TooManyConnections, TooManyBytes          so is what the service holds in all
│   ├── TooManyWaiting                            too many requests of jobs wait
│   └── TooManyRequests     the client has its share of the queue
│       └── TooManyConnectionsOfClient, TooManyBytesOfClient
├── ClusterUnavailable  the scheduler of the cluster cannot be used
├── NotReady            no worker is warm
├── ShuttingDown        the service stops before the request is done
├── WorkerDied          the worker process ended during the task, and that of a second attempt
├── TaskFailed          the task raised an unforeseen exception
├── StoreUnavailable    the database cannot be reached, read or written
├── UnknownAnswer       no stored answer has that id
│   └── PartsNeeded         an export refers to answers that are not at hand
├── UnknownStudy        no study has that id
│   └── UnknownIteration
├── UnknownJob          no job has that id
├── JobNotCancellable   the job has ended
├── TooManyDeaths       the request ended its worker process again and again
├── EmptyStudy          the study has no iteration yet
├── RobotExists         the name of a robot is taken
│   └── BundledRobot        by a robot that comes with the service
├── TooManyRobots       the service holds as many robots of users as it may
├── UnknownLog          no log has that id
├── UnknownIdentification   no identification has that id
├── TooManyLogs         the service holds as many bytes of logs as it may
├── UnknownFigures      no figures have that id
├── FiguresInUse        a study uses the figures
├── TooManyFigures      the service holds as many figures as it may
├── KeyReused           the Idempotency-Key was used for a different request
├── NoKey               the request needs an API key
│   └── WrongKey        its API key is not valid
├── RoleTooLow          its API key may not do that
├── NotOwner            another client created the thing
├── AnswerInUse         the answer belongs to a study or a job
├── CrossSite           a web page of another site sent the request
├── WrongHost           the request is for another host
├── HeadTooLarge        line and headers of the request are larger than the limit
├── RequestTimeout      the request did not arrive in time
└── NotFound, MethodNotAllowed, BodyTooLarge, UnsupportedMediaType, UnsupportedCoding, NotAcceptable, MalformedHttp
"""

from __future__ import annotations

import copyreg
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar


class ServiceError(Exception):
    """Base of the service's own errors; the message is one sentence that says what to do."""

    MESSAGE: ClassVar[str]

    def __init__(self) -> None:
        super().__init__(self.MESSAGE)

    def __reduce__(self) -> tuple[Any, ...]:
        # the default calls the constructor with the message, but the constructors take data or nothing
        return copyreg.__newobj__, (type(self), *self.args), vars(self)  # type: ignore[attr-defined]


class InvalidRequest(ServiceError):
    """The request does not fit the schema; `errors` has one entry {loc, msg} per fault."""

    MESSAGE = "Correct the fields listed under `errors`."

    def __init__(self, errors: Sequence[Mapping[str, Any]]) -> None:
        super().__init__()
        self.errors = list(errors)
