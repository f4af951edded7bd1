"""uvicorn with the settings of this service."""

from __future__ import annotations

import asyncio
import ctypes
import errno
import math
import socket

import uvicorn
from fastapi import FastAPI

from joulepath.app.access.start import log_access
from joulepath.app.engine.imports import keep
from joulepath.app.engine.pool import Engine
from joulepath.app.http.connection import Ceilings, Connection
from joulepath.app.jobs.jobs import Jobs
from joulepath.app.main import create_app
from joulepath.app.settings import Settings, WrongSettings

_REFUSING_TIME = 0.25
"""Time [s] in which new requests still get a response (`shutting-down`), until load balancers know of the shutdown."""
_SETTLING_TIME = 0.05
"""Time [s] to read requests that have arrived on open connections, before idle connections are closed."""
_M_MMAP_THRESHOLD = -3
"""Parameter of glibc's `mallopt`: the size [byte] from which a block is mapped by itself."""
_LARGE_BLOCK = 1 << 16
_BACKLOG = 2048
"""Connections that wait to be accepted: as uvicorn has it."""
_REMEDIES = {
    errno.EADDRINUSE: "another program has this address, perhaps another service. End it, or choose another port by "
    "--port, JOULEPATH_PORT or PORT (`make serve PORT=8001`); 0 takes a free one",
    errno.EACCES: "ports below 1024 are not for everyone. Choose a larger one by --port, JOULEPATH_PORT or PORT",
    errno.EADDRNOTAVAIL: "this machine does not have this address. Choose one that it has by --host or JOULEPATH_HOST",
}
_CHECK_PERIOD = 0.5
"""Time [s] between two checks of the connections."""


class _Server(uvicorn.Server):
    """Checks its connections. Drains the engine when a shutdown begins: the lifespan ends only after the last
    response, or when the time for it is over."""

    def __init__(self, config: uvicorn.Config, app: FastAPI) -> None:
        super().__init__(config)
        self._app = app

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listens, and begins to check connections."""
        await super().startup(sockets)
        # what there is now stays: a garbage collection that looks through it would hold up every request for 0.1 s
        keep()
        self._checking = asyncio.create_task(self._check_connections())

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Lets the requests in flight finish; those that take too long are `shutting-down`."""
        engine: Engine = self._app.state.engine
        settings: Settings = self._app.state.settings
        engine.drain()
        # the engine has ended its tasks by then, and what still is open does not read
        asyncio.get_running_loop().call_later(settings.shutdown_grace + _SETTLING_TIME, self._abort_connections)
        jobs: Jobs = self._app.state.jobs
        jobs.dispatcher.drain()
        await asyncio.sleep(_REFUSING_TIME)
        for server in self.servers:
            server.close()
        await asyncio.sleep(_SETTLING_TIME)
        await super().shutdown(sockets)
        self._checking.cancel()

    async def _check_connections(self) -> None:
        while True:
            await asyncio.sleep(_CHECK_PERIOD)
            for connection in self._connections():
                connection.check()

    def _abort_connections(self) -> None:
        for connection in self._connections():
            connection.reset()

    def _connections(self) -> list[Connection]:
        return [each for each in self.server_state.connections if isinstance(each, Connection)]


def listen(host: str, port: int) -> list[socket.socket]:
    """Sockets that listen on every address of a host. Raises WrongSettings if nobody can listen there."""
    sockets = list[socket.socket]()
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        for family, kind, protocol, _, address in dict.fromkeys(found):
            sockets.append(one := socket.socket(family, kind, protocol))
            one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if family == socket.AF_INET6:
                # as asyncio has it: a name may have an address of either kind
                one.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            one.bind(address)
            # two processes may bind the same address, and only one of them may listen
            one.listen(_BACKLOG)
    except OSError as error:
        for each in sockets:
            each.close()
        remedy = _REMEDIES.get(error.errno or 0, "choose another address by JOULEPATH_HOST or --host")
        raise WrongSettings(f"The service cannot listen on {host}, port {port} ({error.strerror}): {remedy}.") from None
    return sockets


def serve(settings: Settings) -> None:
    """Serves in this process until a signal arrives. Raises WrongSettings if nobody can listen on its address."""
    sockets = listen(settings.host, settings.port)
    _give_memory_back()
    app = create_app(settings)
    log_access(settings)
    config = uvicorn.Config(
        app,
        host=settings.host,
        port=settings.port,
        loop="uvloop",
        http=_protocol(settings),
        ws="none",
        log_config=None,
        access_log=False,
        server_header=False,
        # `joulepath.app.http.client` reads their headers, from trusted proxies only
        proxy_headers=False,
        # the server ends the connections before this
        timeout_graceful_shutdown=math.ceil(settings.shutdown_grace) + 1,
    )
    _Server(config, app).run(sockets)


def _give_memory_back() -> None:
    """Has the C library return every large block to the system when it is freed.

    Otherwise it keeps the more, the larger the blocks were that it saw: 300 bodies of 4 MiB would never be given back.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:  # glibc has it
        mallopt(_M_MMAP_THRESHOLD, _LARGE_BLOCK)


def _protocol(settings: Settings) -> type[Connection]:
    """The protocol of a server: uvicorn makes one instance for each connection."""

    class Limited(Connection):
        """A connection within the ceilings of the settings."""

        ceilings = Ceilings(
            connections=settings.max_connections,
            connections_of_client=settings.client_connections,
            head_bytes=settings.max_head_bytes,
            head_time=settings.head_timeout,
            body_time=settings.body_timeout,
            write_time=settings.write_timeout,
            proxies=settings.trusted_proxies,
        )

    return Limited
