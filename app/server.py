"""uvicorn with the settings of this service."""

from __future__ import annotations

import asyncio
import math
import socket

import uvicorn
from fastapi import FastAPI

from app.access.start import log_access
from app.engine.pool import Engine
from app.http.malformed import TypedHttpProtocol
from app.main import create_app
from app.settings import Settings

_REFUSING_TIME = 0.25
"""Time [s] in which new requests still get a response (`shutting-down`), until load balancers know of the shutdown."""
_SETTLING_TIME = 0.05
"""Time [s] to read requests that have arrived on open connections, before idle connections are closed."""


class _Server(uvicorn.Server):
    """Drains the engine when a shutdown begins: the lifespan ends only after the last response."""

    def __init__(self, config: uvicorn.Config, app: FastAPI) -> None:
        super().__init__(config)
        self._app = app

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Lets the requests in flight finish; those that take too long are `shutting-down`."""
        engine: Engine = self._app.state.engine
        engine.drain()
        await asyncio.sleep(_REFUSING_TIME)
        for server in self.servers:
            server.close()
        await asyncio.sleep(_SETTLING_TIME)
        await super().shutdown(sockets)


def serve(settings: Settings) -> None:
    """Serves in this process until a signal arrives."""
    app = create_app(settings)
    log_access(settings)
    config = uvicorn.Config(
        app,
        host=settings.host,
        port=settings.port,
        loop="uvloop",
        http=TypedHttpProtocol,
        ws="none",
        log_config=None,
        access_log=False,
        server_header=False,
        # `app.http.client` reads their headers, from trusted proxies only
        proxy_headers=False,
        # the engine ends the requests in flight before this
        timeout_graceful_shutdown=math.ceil(settings.shutdown_grace) + 1,
    )
    _Server(config, app).run()
