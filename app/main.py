"""Composition of the service."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial

from fastapi import FastAPI
from starlette.middleware.cors import CORSMiddleware

from joulepath import __version__
from joulepath.app.access.key_ring import KeyRing
from joulepath.app.access.start import key_ring
from joulepath.app.api import docs, health, metrics, pages, problems
from joulepath.app.api.advice import route as advice
from joulepath.app.api.answers import route as answers
from joulepath.app.api.compare import route as compare
from joulepath.app.api.cycle import route as cycle
from joulepath.app.api.evaluate import route as evaluate
from joulepath.app.api.excitation import route as excitation
from joulepath.app.api.export import route as export
from joulepath.app.api.figures import route as figures
from joulepath.app.api.identifications import route as identifications
from joulepath.app.api.ik import route as ik
from joulepath.app.api.jobs import route as jobs
from joulepath.app.api.logs import route as logs
from joulepath.app.api.optimize import route as optimize
from joulepath.app.api.pareto import route as pareto
from joulepath.app.api.placement import route as placement
from joulepath.app.api.replay import route as replay
from joulepath.app.api.report import route as report
from joulepath.app.api.robots import files as robot_files
from joulepath.app.api.robots import route as robots
from joulepath.app.api.studies import route as studies
from joulepath.app.api.studies.iterations import route as iterations
from joulepath.app.api.studies.suggest import route as suggest
from joulepath.app.api.tools import route as tools
from joulepath.app.api.whatif import route as whatif
from joulepath.app.cluster.link import Cluster
from joulepath.app.engine.pool import Engine
from joulepath.app.engine.warm_up import warm
from joulepath.app.http.bodies import Bodies
from joulepath.app.http.handlers import install_handlers
from joulepath.app.http.metrics import Metrics
from joulepath.app.http.openapi import install_openapi
from joulepath.app.http.request_context import RequestContext
from joulepath.app.http.transfers import Transfers
from joulepath.app.jobs.dispatcher import Dispatcher
from joulepath.app.jobs.executor import Executor
from joulepath.app.jobs.jobs import Jobs
from joulepath.app.settings import Settings
from joulepath.app.store.store import Store

ROUTES = (
    optimize,
    compare,
    pareto,
    cycle,
    placement,
    whatif,
    advice,
    evaluate,
    replay,
    ik,
    jobs,
    studies,
    iterations,
    suggest,
    logs,
    excitation,
    identifications,
    answers,
    export,
    report,
    robots,
    robot_files,
    tools,
    figures,
    health,
    metrics,
    problems,
    docs,
    pages,
)
"""Modules of routes, in the order of the documentation pages."""


def create_app(settings: Settings | None = None) -> FastAPI:
    """The service as an ASGI application. Its workers start and end with the server's lifespan.

    Raises WrongSettings.
    """
    settings = settings or Settings()
    app = FastAPI(
        title="joulepath",
        summary="The robot-arm motion of least energy, with its energy breakdown and a "
        "certificate.",
        description="SI units throughout: m, rad, s, kg, N·m, W, J. Arrays over time are "
        "`[sample][joint]`. "
        "Every error is an `application/problem+json` whose `type` leads to a page that explains "
        "it.",
        version=__version__,
        license_info={"name": "Apache-2.0", "identifier": "Apache-2.0"},
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        # the names of methods in generated clients
        generate_unique_id_function=lambda route: route.name,
        lifespan=_lifespan,
    )
    app.state.settings = settings
    app.state.metrics = Metrics()
    app.state.bodies = Bodies(settings)
    keys = key_ring(settings)
    _add_middleware(app, settings, keys)
    install_handlers(app)
    install_openapi(app, settings, with_keys=keys is not None)
    for module in ROUTES:
        app.include_router(module.router)
    return app


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    settings: Settings = app.state.settings
    app.state.engine = engine = Engine(settings, partial(warm, settings.robots))
    app.state.store = store = Store(settings.database_url)
    link = None if settings.cluster is None else Cluster(settings.cluster)
    app.state.cluster = link
    executor = Executor(engine.spare.run, store, lambda: settings.workers_for_jobs)
    if link is not None:
        executor = Executor(link.run, store, lambda: link.slots)
        link.start()
    dispatcher = Dispatcher(store, executor, settings)
    app.state.jobs = Jobs(store, dispatcher, settings)
    engine.start()
    dispatcher.start()
    # in the background: requests without a database do not wait for it
    opening = asyncio.create_task(store.open())
    yield
    await dispatcher.stop()
    if link is not None:
        await link.stop()
    await engine.stop()
    await opening
    await store.close()


def _add_middleware(app: FastAPI, settings: Settings, keys: KeyRing | None) -> None:
    """Adds the middleware, the innermost first."""
    app.add_middleware(Transfers, bodies=app.state.bodies, keys=keys)
    if settings.cors_origins:
        # There are no cookies: a page may send any of its own headers.
        app.add_middleware(
            CORSMiddleware,
            allow_origins=settings.cors_origins,
            allow_methods=["*"],
            allow_headers=["*"],
            expose_headers=["*"],
            # Chromium asks before a public page may call a service in a private network.
            allow_private_network=True,
        )
    app.add_middleware(RequestContext, settings=settings, metrics=app.state.metrics)
