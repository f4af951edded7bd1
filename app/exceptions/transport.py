"""Errors of HTTP itself."""

from __future__ import annotations

from joulepath.app.exceptions.base import ServiceError


class NotFound(ServiceError):
    """The path does not exist."""

    MESSAGE = "This path does not exist: GET /openapi.json lists all paths."


class MethodNotAllowed(ServiceError):
    """The path does not accept the HTTP method."""

    MESSAGE = "This path does not accept this HTTP method: use one from the Allow header."


class BodyTooLarge(ServiceError):
    """The body is larger than the limit."""

    MESSAGE = "The body is larger than the service accepts: send a smaller body."


class HeadTooLarge(ServiceError):
    """Line and headers of the request are larger than the limit [byte]."""

    MESSAGE = "The line and the headers of the request are too large."

    def __init__(self, most: int) -> None:
        super().__init__()
        self.args = (f"The line and the headers of the request have more than {most} bytes: send shorter ones.",)


class RequestTimeout(ServiceError):
    """The request did not arrive within the limit [s]."""

    MESSAGE = "The request did not arrive in time."

    def __init__(self, most: float) -> None:
        super().__init__()
        self.args = (
            f"The request did not arrive whole within {most:g} s: send it again, over a faster connection or with a "
            "smaller body.",
        )


class UnsupportedMediaType(ServiceError):
    """The path does not accept the media type of the body."""

    MESSAGE = (
        "The header Content-Type declares something else than this path takes: send JSON as application/json, and to "
        "POST /evaluate also CSV as text/csv, to POST /logs CSV only. The body is the document itself, not a form with "
        "a file."
    )


class UnsupportedCoding(ServiceError):
    """The body is packed in a way that the service cannot unpack."""

    MESSAGE = "The header Content-Encoding names something else than gzip, deflate or zstd: use one of them, or none."


class MalformedHttp(ServiceError):
    """What arrived is no HTTP."""

    MESSAGE = (
        "What arrived is no HTTP/1.1 request: check the address and that the client speaks HTTP, not HTTPS, to this "
        "port, and the request line, the headers and the chunks of the body."
    )


class NotAcceptable(ServiceError):
    """The header `Accept-Encoding` allows no coding that the service has."""

    MESSAGE = "The header Accept-Encoding excludes all of zstd, gzip and identity: allow one of them."
