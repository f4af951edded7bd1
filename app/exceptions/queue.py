"""Errors of workers, of the queue in front of them, and of what clients hold."""

from __future__ import annotations

from joulepath.app.exceptions.base import ServiceError


class Busy(ServiceError):
    """The queue is full."""

    MESSAGE = "All workers are busy and the queue is full: try again after a few seconds."


class TooManyConnections(Busy):
    """The service has as many connections as it may."""

    MESSAGE = "The service has as many connections as it may: try again after a few seconds."


class TooManyBytes(Busy):
    """Bodies and answers in flight have as many bytes as the service may hold."""

    MESSAGE = "The service holds as many bytes of requests and answers as it may: try again after a few seconds."


class TooManyRequests(Busy):
    """The client has its share of the queue."""

    MESSAGE = (
        "You have as many requests in flight as one client may: wait for their answers before you send more, or send "
        "them one after another."
    )


class TooManyConnectionsOfClient(TooManyRequests):
    """The client has as many connections, or requests ahead of their answers, as it may."""

    MESSAGE = (
        "You have as many connections, or as many requests ahead on one of them, as one client may: close those that "
        "you do not need, and use one for several requests, one after another."
    )


class TooManyBytesOfClient(TooManyRequests):
    """The client's bodies and answers in flight have as many bytes as one client may."""

    MESSAGE = (
        "The bodies and answers of your requests in flight have as many bytes as one client may: wait for their "
        "answers, read them, and send fewer at a time."
    )


class TooManyWaiting(Busy):
    """Too many requests of jobs wait."""

    MESSAGE = "Too many requests of jobs wait: send this job again when others have ended, or send a smaller one."


class ClusterUnavailable(ServiceError):
    """The scheduler of the cluster cannot be reached, or has not this version of the package."""

    MESSAGE = (
        "The scheduler of the cluster does not answer, or does not have the same version of joulepath as this service, "
        "whose log says which: jobs wait until it does. Requests that are answered at once are "
        "computed by this service meanwhile."
    )


class NotReady(ServiceError):
    """No worker is warm, or requests wait and none is at work."""

    MESSAGE = "The workers are starting or being replaced: try again after a few seconds."


class ShuttingDown(ServiceError):
    """The service stops before the request is done."""

    MESSAGE = "The service is stopping: send the request again."


class WorkerDied(ServiceError):
    """The worker process ended during the task. Who waits for the task learns it if a second one did, too."""

    MESSAGE = (
        "Two processes that worked on this request died, for example because the machine ran out of memory: try again "
        "after some seconds, make the request smaller if that does not help, or report it with the id in `instance`."
    )


class TaskFailed(ServiceError):
    """The task raised an unforeseen exception; the worker's log has it with the request's id."""

    MESSAGE = "This is a defect of the service: report it with the id in `instance`."


class TooManyDeaths(ServiceError):
    """The request ended its worker process again and again."""

    MESSAGE = (
        "Each process that worked on this request died: make the request smaller, or report it with the id in "
        "`instance`."
    )


class ClientDisconnected(Exception):
    """The client closed the connection: nobody is left to answer."""


class Preempted(Exception):
    """Work that can wait had to give its worker to a caller that waits: it is to be run again."""
