"""GET /cluster."""

from __future__ import annotations

from fastapi import APIRouter

from joulepath.app.exceptions.queue import ClusterUnavailable
from joulepath.app.http.openapi import problem_responses
from joulepath.app.routes.dependencies import ServiceCluster
from joulepath.app.schemas.cluster import ClusterState, Machine

router = APIRouter(tags=["health"])


@router.get(
    "/cluster",
    summary="Machines that work on jobs",
    response_model=ClusterState,
    responses=problem_responses(ClusterUnavailable),
)
async def show(cluster: ServiceCluster) -> ClusterState:
    """The machines of the cluster that this service sends the requests of jobs to. Without a cluster, the service's own
    workers compute them."""
    if cluster is None:
        return ClusterState(scheduler=None, machines=[])
    machines = [Machine(address=address, workers=count) for address, count in sorted(cluster.workers.items())]
    return ClusterState(scheduler=cluster.address, machines=machines)
