"""Errors of workers, of their queue, and of the shares of clients."""

from __future__ import annotations

from joulepath.app.exceptions.base import ServiceError


class Busy(ServiceError):
    """All workers are taken and the queue is full, too many requests of jobs wait, or the service
    has reached its limit of connections, or of bytes of bodies and answers in flight."""

    status = 503
    retry_after = 2
    title = "Busy"
    remedy = "Try again after the time [s] in the header `Retry-After`."
    detail = "All workers are busy and the queue is full: try again after a few seconds."


class TooManyConnections(Busy):
    """The service has as many connections as it may."""

    detail = "The service has reached its limit of connections: try again after a few seconds."


class TooManyBytes(Busy):
    """Bodies and answers in flight have as many bytes as the service may hold."""

    detail = (
        "The service has reached its limit of bytes of requests and answers: try again after a "
        "few seconds."
    )


class TooManyWaiting(Busy):
    """Too many requests of jobs wait."""

    detail = (
        "Too many requests of jobs wait: send this job again when others have ended, or send a "
        "smaller one."
    )


class TooManyRequests(Busy):
    """You have used your share of the service: requests in flight and waiting, waiting requests of
    jobs, connections, or bytes of bodies and answers in flight, as `detail` says. Other clients are
    served meanwhile."""

    status = 429
    title = "Too many requests"
    remedy = (
        "Wait for your answers, read them, and send fewer requests at a time. Try again after the "
        "time [s] in the header `Retry-After`."
    )
    detail = (
        "You have reached the limit of requests in flight per client: wait for their answers "
        "before you send more, or send them one after another."
    )


class TooManyConnectionsOfClient(TooManyRequests):
    """The client has as many connections, or requests without a complete answer, as it may."""

    detail = (
        "You have reached the limit of connections, or of requests without a complete answer, "
        "per client: close those that you do not need, such as streams of events, and use one "
        "for several requests, one after another."
    )


class TooManyWaitingOfClient(TooManyRequests):
    """The client's requests of jobs that wait are half of those that the others leave room for."""

    detail = (
        "Your jobs would have more waiting requests than allowed per client, which is half of "
        "what the other clients leave: send this job again when others of yours have ended, or "
        "send a smaller one."
    )


class TooManyBytesOfClient(TooManyRequests):
    """The client's bodies and answers in flight have as many bytes as one client may."""

    detail = (
        "The bodies and answers of your requests in flight have reached the limit of bytes per "
        "client: wait for their answers, read them, and send fewer at a time."
    )


class ClusterUnavailable(ServiceError):
    """The scheduler of the cluster for jobs cannot be reached, or has another version of joulepath
    than the service; the log of the service says more. Jobs are accepted and wait for the cluster.
    The service itself computes the answers to other requests."""

    status = 503
    retry_after = 5
    title = "Cluster unavailable"
    remedy = "Try again after the time [s] in the header `Retry-After`."
    detail = (
        "The scheduler of the cluster does not answer, or does not have the same version of "
        "joulepath as this service, whose log says which: jobs wait until it does. Requests that "
        "are answered at once are computed by this service meanwhile."
    )


class NotReady(ServiceError):
    """The workers are still starting, or all of them have ended and are being replaced: requests
    wait, and none is running."""

    status = 503
    retry_after = 2
    title = "Not ready"
    remedy = "Try again after the time [s] in the header `Retry-After`."
    detail = "The workers are starting or being replaced: try again after a few seconds."


class ShuttingDown(ServiceError):
    """The service is stopping and did not finish this request."""

    status = 503
    retry_after = 5
    title = "Shutting down"
    remedy = (
        "Send it again after the time [s] in the header `Retry-After`: another instance, or the "
        "restarted one, answers."
    )
    detail = "The service is stopping: send the request again."


class WorkerLost(ServiceError):
    """Two worker processes died during this request, one after the other, most often because the
    machine ran out of memory. The service does not try a third time."""

    status = 503
    retry_after = 5
    title = "Worker lost"
    remedy = (
        "Try again after the time [s] in the header `Retry-After`; if that does not help, make the "
        "request smaller, or report it with the value of `instance`."
    )
    detail = (
        "Two processes that worked on this request died, for example because the machine ran out "
        "of memory: try again after some seconds, make the request smaller if that does not help, "
        "or report it with the id in `instance`."
    )


class WorkerDied(ServiceError):
    """Three worker processes died during this request of a job, for example because of a lack of
    memory. The service does not try again."""

    status = 500
    title = "Worker died"
    remedy = (
        "Make the request smaller, and send it again; if that does not help, please report it with "
        "the value of `instance`."
    )
    detail = (
        "Each process that worked on this request died: make the request smaller, or report it "
        "with the id in `instance`."
    )


class ClientDisconnected(Exception):
    """The client closed the connection."""


class Preempted(Exception):
    """Deferrable work had to give its worker to a waiting caller, and must run again."""
