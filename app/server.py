"""uvicorn with the settings of this service."""

from __future__ import annotations

import asyncio
import ctypes
import errno
import logging
import math
import os
import re
import socket
import sys
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, cast

import uvicorn
from fastapi import FastAPI

from joulepath.app.access.start import log_access
from joulepath.app.engine.imports import keep
from joulepath.app.http.connection import Connection, Connections
from joulepath.app.main import create_app
from joulepath.app.schemas.names import nearest
from joulepath.app.settings import Settings, WrongSettings

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class ServerSettings:
    """Settings of the server process."""

    refusing_time: float = 0.25
    """Time [s] of `shutting-down` responses, until load balancers know of the shutdown."""
    settling_time: float = 0.05
    """Time [s] to read arrived requests before idle connections are closed."""
    sending_time: float = 0.75
    """Time [s] after the grace in which the last responses are sent, also by a busy machine."""
    large_block: int = 1 << 20
    """Least size of separately mapped blocks [byte], above the pieces of bodies."""
    document_delay: float = 5.0
    """Time after the start [s] at which the OpenAPI document is built, which takes 1 s: the first
    reader of `/docs` does not wait for it, and the start of the workers has ended by then."""
    backlog: int = 2048
    """Connections waiting to be accepted, the default of uvicorn."""


SERVER = ServerSettings()

_OTHER_VARIABLES = ("CACHE_DIR", "URL", "API_KEY")
"""Variables with the prefix of the settings that the library and the commands read."""
_SERVICE_LINKS = re.compile(r"SERVICE_(HOST|PORT)(_.*)?|PORT_[0-9]+_.*")
"""Variables that Kubernetes sets in the pods beside a service named `joulepath`."""
_M_MMAP_THRESHOLD = -3
"""Parameter of glibc's `mallopt`: the least size of separately mapped blocks [byte]."""
_REMEDIES = {
    errno.EADDRINUSE: "another program, perhaps another service, uses this address. End it, or "
    "choose another port with --port, JOULEPATH_PORT or PORT (`make serve "
    "PORT=8001`); 0 takes a free one",
    errno.EACCES: "ports below 1024 need special rights. Choose a larger one with --port, "
    "JOULEPATH_PORT or PORT",
    errno.EADDRNOTAVAIL: "this machine does not have this address. Choose one that it has with "
    "--host or JOULEPATH_HOST",
}


class _Server(uvicorn.Server):
    """Drains the service when a shutdown begins: the lifespan ends only after the last response, or
    when the time for it is over.
    """

    def __init__(self, config: uvicorn.Config, app: FastAPI, connections: Connections) -> None:
        super().__init__(config)
        self._state, self._connections = app.state, connections
        # A daemon: the stop of the service does not wait for its end.
        self._document = threading.Thread(target=app.openapi, daemon=True)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begins to listen; builds the OpenAPI document later, in a thread."""
        await super().startup(sockets)
        if sockets and sys.stderr.isatty():
            print(told(sockets), file=sys.stderr)
        asyncio.get_running_loop().call_later(SERVER.document_delay, self._document.start)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Lets running requests finish; too long ones are answered by `shutting-down`."""
        self._state.engine.drain()
        self._state.jobs.dispatcher.drain()
        self._state.bodies.drain()
        # The engine has ended its tasks by then; remaining connections do not read.
        end = self._state.settings.shutdown_grace + SERVER.sending_time
        asyncio.get_running_loop().call_later(end, self._connections.reset)
        await asyncio.sleep(SERVER.refusing_time)
        for server in self.servers:
            server.close()
        await asyncio.sleep(SERVER.settling_time)
        await super().shutdown(sockets)


def log_unknown_variables(environment: Mapping[str, str]) -> None:
    """Warns of variables with the prefix of the settings that set nothing."""
    prefix = Settings.model_config["env_prefix"]
    known = {*(name.upper() for name in Settings.model_fields), *_OTHER_VARIABLES}
    for variable in sorted(environment):
        name = variable.upper().removeprefix(prefix)
        is_known = name in known or _SERVICE_LINKS.fullmatch(name)
        if variable.upper().startswith(prefix) and not is_known:
            meant = nearest(name, known)
            remedy = "unset it" if meant is None else f"did you mean {prefix}{meant.upper()}?"
            logger.warning("unknown setting", extra={"variable": variable, "remedy": remedy})


def listen(host: str, port: int) -> list[socket.socket]:
    """Sockets listening on every address of a host. Raises WrongSettings if impossible."""
    sockets = list[socket.socket]()
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        for family, _, _, _, address in dict.fromkeys(found):
            # Two processes may bind an address, but only one can listen.
            sockets.append(
                socket.create_server(cast(Any, address), family=family, backlog=SERVER.backlog)
            )
    except OSError as error:
        for each in sockets:
            each.close()
        remedy = _REMEDIES.get(
            error.errno or 0, "choose another address with JOULEPATH_HOST or --host"
        )
        reason = (error.strerror or "").partition(" (while")[0]
        raise WrongSettings(
            f"The service cannot listen on {host}, port {port} ({reason}): {remedy}."
        ) from None
    return sockets


def told(sockets: list[socket.socket]) -> str:
    """What a terminal shows between the lines of the log: where the service is."""
    addresses = (each.getsockname()[:2] for each in sockets)
    urls = [f"http://{f'[{host}]' if ':' in host else host}:{port}" for host, port in addresses]
    return (
        f"joulepath is at {' and '.join(urls)}: the studio at /studio, the pages at /help, the API "
        "at /docs. Ctrl-C ends it."
    )


def serve(settings: Settings) -> None:
    """Serves until a signal arrives. Raises WrongSettings for an unusable address."""
    sockets = listen(settings.host, settings.port)
    _give_memory_back()
    app = create_app(settings)
    connections = Connections(settings)
    log_access(settings)
    log_unknown_variables(os.environ)
    config = uvicorn.Config(
        app,
        loop="uvloop",
        http=cast(type[asyncio.Protocol], partial(Connection, connections)),
        ws="none",
        h11_max_incomplete_event_size=settings.max_head_bytes,
        log_config=None,
        # its warnings tell of malformed requests, and advise to install a library for websockets
        log_level="error",
        access_log=False,
        server_header=False,
        # `joulepath.app.http.client` reads their headers, from trusted proxies only
        proxy_headers=False,
        # the server ends the connections before this
        timeout_graceful_shutdown=math.ceil(settings.shutdown_grace) + 1,
    )
    # Present objects stay: collecting garbage among them would delay requests by 0.1 s.
    keep()
    logger.info("listening", extra={"addresses": [each.getsockname()[:2] for each in sockets]})
    _Server(config, app, connections).run(sockets)


def _give_memory_back() -> None:
    """Makes the C library return freed large blocks to the system.

    By default, it keeps more memory after larger blocks: 300 bodies of 4 MiB would never be
    returned.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:  # glibc has it
        mallopt(_M_MMAP_THRESHOLD, SERVER.large_block)
