"""Errors of HTTP itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from joulepath.app.exceptions.base import ServiceError
from joulepath.optimizer.declared import Internal, Seconds, Unit


class NotFound(ServiceError):
    """The service has nothing at this path."""

    status = 404
    title = "Not found"
    remedy = "Use one of the paths that `GET /openapi.json` lists."
    detail = (
        "This path does not exist: use one that GET /openapi.json lists, and leave out a slash at "
        "its end."
    )


class PagesNotBuilt(ServiceError):
    """This installation was made without the pages at this path: the studio, or the documentation
    at `/help`."""

    status = 404
    title = "Pages not built"
    remedy = (
        "Install the wheel or the image, which have them, or build them in a clone: "
        "`python scripts/build_studio.py`, `python scripts/build_docs.py`."
    )
    detail = (
        "This installation was made without these pages: build them by scripts/build_studio.py or "
        "scripts/build_docs.py, or install the wheel."
    )


class MethodNotAllowed(ServiceError):
    """This path does not support the HTTP method of the request."""

    status = 405
    title = "Method not allowed"
    remedy = "Use one of the methods in the header `Allow`."
    detail = "This path does not accept this HTTP method: use one from the Allow header."


class BodyTooLarge(ServiceError):
    """The body exceeds the service's limit, as it arrives or unpacked. A normal request needs a few
    kilobytes. Motions sent to `POST /evaluate` may be about a thousand times larger."""

    status = 413
    title = "Body too large"
    remedy = "Send a smaller body, for example with fewer samples."
    detail = "The body is larger than the service accepts: send a smaller body."


class UploadNotStored(ServiceError):
    """The folder of temporary files, `TMPDIR` of the service, has no space for the body or cannot
    be written; the service's log has the reason."""

    status = 503
    retry_after = 5
    title = "Upload not stored"
    remedy = (
        "Try again after the time [s] in the header `Retry-After`. If the problem remains, the "
        "operator must enlarge or empty the folder."
    )
    detail = (
        "The service cannot write the body to its folder of temporary files: try again later, or "
        "ask the operator to make space in TMPDIR."
    )


@dataclass(eq=False)
class HeadTooLarge(ServiceError):
    """The request's line and headers exceed `JOULEPATH_MAX_HEAD_BYTES`. The connection is
    closed."""

    status = 431
    title = "Request head too large"
    remedy = (
        "Requests to this service need few headers: leave out cookies and headers that it does not "
        "use."
    )

    limit: Annotated[int, Unit("byte"), Internal]
    """Largest size of the line and the headers."""

    def __str__(self) -> str:
        return (
            f"The line and the headers of the request have more than {self.limit} bytes: send "
            "shorter ones."
        )


@dataclass(eq=False)
class RequestTimeout(ServiceError):
    """The request did not arrive in time: its line and headers within `JOULEPATH_HEAD_TIMEOUT`, its
    body within `JOULEPATH_BODY_TIMEOUT`."""

    status = 408
    title = "Request not received in time"
    remedy = "Send it again, over a faster connection or with a smaller body."

    limit: Annotated[Seconds, Internal]
    """Longest time until the arrival of the request."""

    def __str__(self) -> str:
        return (
            f"The request did not arrive whole within {self.limit:g} s: send it again, over a "
            "faster connection or with a smaller body."
        )


class UnsupportedMediaType(ServiceError):
    """The header `Content-Type` declares a body not accepted by this path."""

    status = 415
    title = "Unsupported media type"
    remedy = (
        "JSON is `application/json`; the CSV of `POST /evaluate` and `POST /logs` is `text/csv`, "
        "and a bag of ROS 2 for `POST /logs` is `application/octet-stream`. "
        "`text/plain`, a form, and no header at all are read as JSON, too, where a path takes "
        "JSON. The body is the document itself: `curl --data-binary @file`, not `curl -F "
        "file=@file`."
    )
    detail = (
        "The header Content-Type declares something else than this path takes: send JSON as "
        "application/json, and to POST /evaluate also CSV as text/csv; to POST /logs CSV as "
        "text/csv, or a bag of ROS 2 as application/octet-stream. The body is the document itself, "
        "not a form with a file."
    )


class UnsupportedCoding(ServiceError):
    """The header `Content-Encoding` names an unsupported coding, or several at once."""

    status = 415
    title = "Unsupported content coding"
    remedy = (
        "Pack the body with `gzip`, `deflate` or `zstd`, or send it as it is, without this header."
    )
    detail = (
        "The header Content-Encoding names something else than gzip, deflate or zstd: use one of "
        "them, or none."
    )


class MalformedHttp(ServiceError):
    """The received bytes are not a valid HTTP/1.1 request: a TLS handshake, a request line or
    header with invalid characters, two lengths of the body, or a chunk without a length. The
    service closes the connection."""

    status = 400
    title = "Malformed HTTP"
    remedy = "Speak HTTP to this port, or HTTPS to the proxy before it."
    detail = (
        "What arrived is not an HTTP/1.1 request: check the address and that the client speaks "
        "HTTP, not HTTPS, to this port, and the request line, the headers and the chunks of the "
        "body."
    )


class NotAcceptable(ServiceError):
    """The header `Accept-Encoding` allows none of the codings of the service: `zstd`, `gzip` and
    `identity` (no compression). Nothing was computed."""

    status = 406
    title = "No acceptable coding"
    remedy = "Allow one of them, or leave the header out."
    detail = (
        "The header Accept-Encoding excludes all of zstd, gzip and identity: allow one of them."
    )
