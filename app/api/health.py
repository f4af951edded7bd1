"""GET /healthz, GET /readyz and GET /cluster."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter

from joulepath.app.api.shared.dependencies import ServiceCluster, ServiceEngine, ServiceStore
from joulepath.app.engine.pool import Engine
from joulepath.app.exceptions.queue import ClusterUnavailable, NotReady
from joulepath.app.exceptions.stored import StoreUnavailable
from joulepath.app.http.openapi import problem_responses
from joulepath.app.schemas.common import Response, described, part
from joulepath.app.store.store import Store

router = APIRouter(tags=["health"])


class Alive(Response):
    """The process is alive."""

    status: Literal["alive"] = described("Always `alive`.", None, "alive")


class Ready(Response):
    """All workers are warm: started, with the kernel loaded. The database can be read and
    written."""

    status: Literal["ready"] = described("Always `ready`.", None, "ready")
    workers: int = described("Number of warm workers.", "1", 2)


@router.get(
    "/healthz", summary="Is the process alive?", response_model=Alive, responses=problem_responses()
)
async def healthz() -> Alive:
    """Answers at once, also while the workers are busy."""
    return Alive(status="alive")


@router.get(
    "/readyz",
    summary="Whether the workers are warm and the database answers",
    response_model=Ready,
    responses=problem_responses(NotReady, StoreUnavailable),
)
async def readyz(engine: ServiceEngine, store: ServiceStore) -> Ready:
    """200 from the time when all workers are warm until the service stops, while the database can
    be read and written, and unless requests wait and no worker is at work."""
    if not engine.ready:
        raise NotReady
    if store.fault is not None:
        raise StoreUnavailable(store.fault)
    return Ready(status="ready", workers=engine.warm_workers)


def is_ready(engine: Engine, store: Store) -> bool:
    """Whether `/readyz` says ready."""
    return engine.ready and store.fault is None


class Machine(Response):
    """One machine of a cluster."""

    address: str = described(
        "Address at which the scheduler reaches it.", None, "tcp://10.0.0.7:41555"
    )
    workers: int = described("Requests that it computes at the same time.", "1", 8)


class ClusterState(Response):
    """The cluster for jobs."""

    scheduler: str | None = described(
        "Address of the scheduler; null if the service's own workers work on jobs.",
        None,
        "tcp://scheduler:8786",
    )
    machines: list[Machine] = part("The machines connected now.")


@router.get(
    "/cluster",
    summary="Machines that work on jobs",
    response_model=ClusterState,
    responses=problem_responses(ClusterUnavailable),
)
async def show_cluster(cluster: ServiceCluster) -> ClusterState:
    """The machines of the cluster for the requests of jobs. Without a cluster, the service's own
    workers compute them."""
    if cluster is None:
        return ClusterState(scheduler=None, machines=[])
    machines = [
        Machine(address=address, workers=count)
        for address, count in sorted(cluster.workers.items())
    ]
    return ClusterState(scheduler=cluster.address, machines=machines)
