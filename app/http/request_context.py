"""The outermost layer: gives each request an id and its client, logs it, and answers every exception."""

from __future__ import annotations

import logging
import re
import time
import uuid
from collections.abc import Callable

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import ClientDisconnect, Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from joulepath.app.access.client import Client
from joulepath.app.exceptions import ClientDisconnected
from joulepath.app.http.handlers import problem_response
from joulepath.app.http.metrics import Metrics
from joulepath.app.http.sites import PROBES

logger = logging.getLogger("app.request")

METRICS = "/metrics"
REQUEST_ID_HEADER = "X-Request-ID"
_SANE_ID = re.compile(r"[A-Za-z0-9._-]{1,64}")
_CLIENT_CLOSED_REQUEST = 499
"""Status in the log, never sent, of a request whose client closed the connection: nginx's convention."""


class RequestContext:
    """ASGI middleware: the id goes to `request.state.id`, the header of the response and the log. Requests are counted.

    The client, as `sender` finds it, goes to `request.state.client` and the log. Layers inside may put another there.
    """

    def __init__(self, app: ASGIApp, sender: Callable[[Scope], Client], metrics: Metrics) -> None:
        self._app = app
        self._sender = sender
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answers the request, also if an exception comes from inside."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).get(REQUEST_ID_HEADER, "")
        request_id = given if _SANE_ID.fullmatch(given) else str(uuid.uuid4())
        state = scope.setdefault("state", {})
        state["id"], state["client"] = request_id, self._sender(scope)
        status = 0

        async def send_with_id(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)[REQUEST_ID_HEADER] = request_id
            await send(message)

        left = False

        async def receive_until_left() -> Message:
            nonlocal left
            message = await receive()
            left = left or (message["type"] == "http.disconnect" and not status)
            return message

        began = time.perf_counter()
        asked = {"request_id": request_id, "method": scope["method"], "path": scope["path"]}
        logger.debug("received", extra=asked)
        try:
            await self._app(scope, receive_until_left, send_with_id)
        except (ClientDisconnected, ClientDisconnect):  # the other one: while its body was read
            left = True
        except Exception as error:
            logger.exception("unforeseen error", extra={"request_id": request_id})
            if status:
                raise  # the server closes the connection, so that the client sees that the response is incomplete
            response = await problem_response(Request(scope), error)
            await response(scope, receive, send_with_id)
        finally:
            if left:
                status = _CLIENT_CLOSED_REQUEST
            duration = time.perf_counter() - began
            problem = state.get("problem")
            self._metrics.observe(scope["method"], state.get("route"), status, problem, duration)
            client: Client = state["client"]
            logger.log(
                # these come every few seconds
                logging.DEBUG if scope["path"] in (*PROBES, METRICS) else logging.INFO,
                "request",
                extra=asked
                | {"client": client.address, "key": client.key}
                | {"status": status, "problem": problem, "duration": round(duration, 6)},
            )
