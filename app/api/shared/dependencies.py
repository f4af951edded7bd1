"""Dependencies of routes on parts of the service.

No other module of this room reads the application's state.
"""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

from fastapi import Depends, Request

from joulepath.app.access.client import Client
from joulepath.app.api.shared.parameters import is_fresh
from joulepath.app.cluster.link import Cluster
from joulepath.app.engine.pool import Engine
from joulepath.app.http.client import client_of
from joulepath.app.http.metrics import Metrics
from joulepath.app.jobs.jobs import Jobs
from joulepath.app.settings import Settings
from joulepath.app.store.store import Store
from joulepath.app.tasks.answer_cache import AnswerCache
from joulepath.app.tasks.arm_engine import ArmEngine

# coroutines, because FastAPI would run plain functions in a thread


def _of_app(name: str) -> Any:
    """The dependency on an attribute of the application's state."""

    async def of_app(request: Request) -> Any:
        return getattr(request.app.state, name)

    return Depends(of_app)


async def _client(request: Request) -> Client:
    return client_of(request)


ServiceClient = Annotated[Client, Depends(_client)]
"""The client of the request."""
ServiceCluster = Annotated[Cluster | None, _of_app("cluster")]
"""The cluster for jobs; None without a cluster."""
ServiceJobs = Annotated[Jobs, _of_app("jobs")]
ServiceSettings = Annotated[Settings, _of_app("settings")]
ServiceMetrics = Annotated[Metrics, _of_app("metrics")]
ServiceEngine = Annotated[Engine, _of_app("engine")]
ServiceStore = Annotated[Store, _of_app("store")]


async def _arm_engine(
    engine: ServiceEngine, client: ServiceClient, store: ServiceStore
) -> ArmEngine:
    return ArmEngine(partial(engine.run, client=client.name), store)


async def _cache(request: Request, store: ServiceStore, client: ServiceClient) -> AnswerCache:
    return AnswerCache(store, client.owner, is_fresh(request))


ServiceCache = Annotated[AnswerCache, Depends(_cache)]
"""Earlier answers to this client."""
ServiceArmEngine = Annotated[ArmEngine, Depends(_arm_engine)]
