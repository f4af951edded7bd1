"""What `GET /cluster` answers."""

from __future__ import annotations

from joulepath.app.schemas.common import Response, described, part


class Machine(Response):
    """One machine of a cluster."""

    address: str = described("Address at which the scheduler reaches it.", None, "tcp://10.0.0.7:41555")
    workers: int = described("Requests that it computes at the same time.", "1", 8)


class ClusterState(Response):
    """The cluster that works on jobs."""

    scheduler: str | None = described(
        "Address of the scheduler; null if the service's own workers work on jobs.", None, "tcp://scheduler:8786"
    )
    machines: list[Machine] = part("The machines that are there now.")
