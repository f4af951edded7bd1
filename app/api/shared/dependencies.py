"""What the service provides to its routes. The only module of this room that reads the
application's state.
"""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Request

from joulepath.app.access.client import Client
from joulepath.app.api.shared.parameters import is_fresh
from joulepath.app.cluster.link import Cluster
from joulepath.app.engine.pool import ClientEngine, Engine
from joulepath.app.http.client import client_of
from joulepath.app.http.metrics import Metrics
from joulepath.app.jobs.jobs import Jobs
from joulepath.app.settings import Settings
from joulepath.app.store.store import Store
from joulepath.app.tasks.answer_cache import AnswerCache
from joulepath.app.tasks.arm_engine import ArmEngine
from joulepath.app.tasks.in_flight import InFlight

# coroutines, because FastAPI would run plain functions in a thread


async def _settings(request: Request) -> Settings:
    settings: Settings = request.app.state.settings
    return settings


async def _engine(request: Request) -> Engine:
    engine: Engine = request.app.state.engine
    return engine


async def _client_engine(request: Request) -> ClientEngine:
    return (await _engine(request)).of_client(client_of(request).name)


async def _store(request: Request) -> Store:
    store: Store = request.app.state.store
    return store


async def _metrics(request: Request) -> Metrics:
    metrics: Metrics = request.app.state.metrics
    return metrics


async def _client(request: Request) -> Client:
    return client_of(request)


ServiceClient = Annotated[Client, Depends(_client)]
"""Who sent the request."""


async def _jobs(request: Request) -> Jobs:
    jobs: Jobs = request.app.state.jobs
    return jobs


async def _cluster(request: Request) -> Cluster | None:
    cluster: Cluster | None = request.app.state.cluster
    return cluster


ServiceCluster = Annotated[Cluster | None, Depends(_cluster)]
"""The cluster that works on jobs; None without one."""
ServiceJobs = Annotated[Jobs, Depends(_jobs)]
ServiceSettings = Annotated[Settings, Depends(_settings)]
ServiceMetrics = Annotated[Metrics, Depends(_metrics)]
ServiceEngine = Annotated[Engine, Depends(_engine)]
ServiceClientEngine = Annotated[ClientEngine, Depends(_client_engine)]
"""The engine for the requests of the client that sent this one."""
ServiceStore = Annotated[Store, Depends(_store)]


async def _arm_engine(engine: ServiceClientEngine, store: ServiceStore) -> ArmEngine:
    return ArmEngine(engine, store)


async def _cache(request: Request, store: ServiceStore, client: ServiceClient) -> AnswerCache:
    in_flight: InFlight = request.app.state.in_flight
    return AnswerCache(store, client.owner, is_fresh(request), in_flight)


ServiceCache = Annotated[AnswerCache, Depends(_cache)]
"""Answers that this client was given before."""
ServiceArmEngine = Annotated[ArmEngine, Depends(_arm_engine)]
