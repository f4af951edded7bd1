"""GET /cluster."""

from __future__ import annotations

from fastapi import APIRouter

from joulepath.app.api.shared.dependencies import ServiceCluster
from joulepath.app.exceptions.queue import ClusterUnavailable
from joulepath.app.http.openapi import problem_responses
from joulepath.app.schemas.common import Response, described, part

router = APIRouter(tags=["health"])


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
    machines: list[Machine] = part("The machines that are there now.")


@router.get(
    "/cluster",
    summary="Machines that work on jobs",
    response_model=ClusterState,
    responses=problem_responses(ClusterUnavailable),
)
async def show(cluster: ServiceCluster) -> ClusterState:
    """The machines of the cluster for the requests of jobs. Without a cluster, the service's own
    workers compute them."""
    if cluster is None:
        return ClusterState(scheduler=None, machines=[])
    machines = [
        Machine(address=address, workers=count)
        for address, count in sorted(cluster.workers.items())
    ]
    return ClusterState(scheduler=cluster.address, machines=machines)
