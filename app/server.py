"""uvicorn, told what this service needs."""

from __future__ import annotations

import asyncio
import math
import socket

import uvicorn
from fastapi import FastAPI

from app.engine.pool import Engine
from app.main import create_app
from app.settings import Settings

_REFUSING_TIME = 0.25
"""Time [s] in which new requests are still taken, to be refused, while whoever sends them learns of the end."""
_SETTLING_TIME = 0.05
"""Time [s] in which what has arrived on open connections is read before the idle ones are closed."""


class _Server(uvicorn.Server):
    """Tells the engine when a shutdown begins: the lifespan's end comes only after the last answer."""

    def __init__(self, config: uvicorn.Config, app: FastAPI) -> None:
        super().__init__(config)
        self._app = app

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Lets the requests in flight finish, or be refused."""
        engine: Engine = self._app.state.engine
        engine.drain()
        await asyncio.sleep(_REFUSING_TIME)
        for server in self.servers:
            server.close()
        await asyncio.sleep(_SETTLING_TIME)
        await super().shutdown(sockets)


def serve(settings: Settings) -> None:
    """Serves in this process until a signal comes."""
    app = create_app(settings)
    config = uvicorn.Config(
        app,
        host=settings.host,
        port=settings.port,
        loop="uvloop",
        http="httptools",
        ws="none",
        log_config=None,
        access_log=False,
        server_header=False,
        # requests in flight are refused by the engine before this
        timeout_graceful_shutdown=math.ceil(settings.shutdown_grace) + 1,
    )
    _Server(config, app).run()
