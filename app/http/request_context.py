"""The outermost layer: request ids, clients, logs, and answers to all exceptions."""

from __future__ import annotations

import logging
import re
import time
import uuid
from contextlib import nullcontext
from functools import partial
from typing import Any
from urllib.parse import unquote

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import ClientDisconnect, Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from joulepath.app.exceptions.base import ServiceError
from joulepath.app.exceptions.queue import ClientDisconnected
from joulepath.app.exceptions.transport import HeadTooLarge
from joulepath.app.http.client import sender
from joulepath.app.http.handlers import problem_response
from joulepath.app.http.metrics import Metrics
from joulepath.app.http.sites import PROBES, known_host, same_site
from joulepath.app.settings import Settings

logger = logging.getLogger("app.request")

METRICS = "/metrics"
REQUEST_ID_HEADER = "X-Request-ID"
_ABSOLUTE_FORM = re.compile(rb"(?i:https?)://([^/]*)(/.*)?")
_SANE_ID = re.compile(r"[A-Za-z0-9._-]{1,64}")
_CLIENT_CLOSED_REQUEST = 499
"""Logged status of a request with a closed connection, by nginx's convention; never sent."""


class RequestContext:
    """ASGI middleware: the id goes to `request.state.id`, the header of the response and the log.
    Requests are counted.

    The client goes to `request.state.client` and the log; an inner layer adds its key. `HEAD` is
    answered as `GET`, and the server omits the body. Forbidden cross-site requests are refused.
    """

    def __init__(self, app: ASGIApp, settings: Settings, metrics: Metrics) -> None:
        self._app, self._metrics = app, metrics
        self._sender = partial(
            sender, proxies=settings.trusted_proxies, header=settings.proxy_header
        )
        self._most = settings.max_head_bytes
        self._checks = (
            self._check_head,
            known_host(settings.allowed_hosts, settings.host),
            same_site(settings.cors_origins),
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answers the request, also if an exception comes from inside."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        scope = _in_origin_form(scope)
        given = Headers(scope=scope).get(REQUEST_ID_HEADER, "")
        state = scope.setdefault("state", {})
        state["id"] = given if _SANE_ID.fullmatch(given) else str(uuid.uuid4())
        state["client"] = self._sender(scope)
        exchange = _Exchange(scope, receive, send)
        logger.debug("received", extra=exchange.asked)
        with state.get("connection") or nullcontext():
            try:
                for check in self._checks:
                    check(Request(exchange.scope))
                await self._app(exchange.scope, exchange.receive, exchange.send)
            except (ClientDisconnected, ClientDisconnect):  # the other one: while its body was read
                exchange.left = True
            except _HeadSent:
                pass
            except Exception as error:
                if not isinstance(error, ServiceError):
                    logger.exception("unforeseen error", extra={"request_id": state["id"]})
                if exchange.status:
                    # The server closes the connection, which shows an incomplete response.
                    raise
                response = await problem_response(Request(exchange.scope), error)
                await response(exchange.scope, receive, exchange.send)
            finally:
                self._note(exchange)

    def _check_head(self, request: Request) -> None:
        """Raises HeadTooLarge for a head received at once; the server bounds incomplete heads."""
        headers = sum(
            len(name) + len(value) + len(b": \r\n") for name, value in request.scope["headers"]
        )
        if (
            headers + len(request.scope.get("raw_path", b"")) + len(request.scope["query_string"])
            > self._most
        ):
            raise HeadTooLarge(self._most)

    def _note(self, exchange: _Exchange) -> None:
        """Counts and logs the request."""
        scope, state = exchange.scope, exchange.scope["state"]
        status = _CLIENT_CLOSED_REQUEST if exchange.left else exchange.status
        duration, problem = time.perf_counter() - exchange.began, state.get("problem")
        route = getattr(scope.get("route"), "path", None)
        self._metrics.observe(exchange.asked["method"], route, status, problem, duration)
        told = {
            "client": state["client"].address,
            "key": state["client"].key,
            "status": status,
            "problem": problem,
        }
        # probes come every few seconds
        level = logging.DEBUG if scope["path"] in (*PROBES, METRICS) else logging.INFO
        logger.log(level, "request", extra=exchange.asked | told | {"duration": round(duration, 6)})


def _in_origin_form(scope: Scope) -> Scope:
    """The scope of a request with the target `http://host/path`, as of `/path` with this host.

    Clients behind a proxy send such targets. The host of the target replaces the header (RFC 9112,
    section 3.2.2).
    """
    found = _ABSOLUTE_FORM.fullmatch(scope.get("raw_path", b""))
    if found is None:
        return scope
    host, path = found[1], found[2] or b"/"
    others = [(name, value) for name, value in scope["headers"] if name != b"host"]
    return {
        **scope,
        "path": unquote(path.decode("ascii")),
        "raw_path": path,
        "headers": [(b"host", host), *others],
    }


class _HeadSent(Exception):
    """The head of a stream was sent, the complete answer to `HEAD`."""


class _Exchange:
    """A request and its answer, observed. `status` is 0 before the answer; `left`: the client left
    before it.
    """

    def __init__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self._receive, self._send = receive, send
        self.began = time.perf_counter()
        self.asked: dict[str, Any] = {
            "request_id": scope["state"]["id"],
            "method": scope["method"],
            "path": scope["path"],
        }
        self._is_head = scope["method"] == "HEAD"
        # a copy: the server leaves out the body by the method, too
        self.scope: Scope = {**scope, "method": "GET" if self._is_head else scope["method"]}
        self.status = 0
        self.left = False

    async def receive(self) -> Message:
        """The next message from the client."""
        message = await self._receive()
        self.left = self.left or (message["type"] == "http.disconnect" and not self.status)
        return message

    async def send(self, message: Message) -> None:
        """Sends a message. Raises _HeadSent in place of the rest of a stream."""
        if message["type"] == "http.response.start":
            self.status = message["status"]
            MutableHeaders(scope=message)[REQUEST_ID_HEADER] = self.asked["request_id"]
        elif self._is_head and message.get("more_body", False):
            await self._send({"type": "http.response.body"})
            raise _HeadSent
        await self._send(message)
