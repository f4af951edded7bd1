"""What a peer is: something that plans a motion between two configurations of a robot."""

from __future__ import annotations

from importlib.metadata import version
from typing import Protocol

from benchmarks.motion import Motion
from models.robot import Array

# of the energy-optimal peers: as many control points and nodes as joulepath's own first attempt
CONTROL_POINTS, NODES = 13, 31


class Peer(Protocol):
    """Plans motions from rest to rest under all limits of a robot; building it may take its time, planning counts.

    `title` names it, `versions` are the packages behind it, `what` says in a sentence what it does.
    """

    title: str
    packages: tuple[str, ...]
    what: str

    def plan(self, q_start: Array, q_goal: Array) -> Motion | None:
        """A motion between two configurations (nq,), None where it finds none."""


def versions(peer: Peer) -> str:
    """Its packages and their versions."""
    return ", ".join(f"{name} {version(name)}" for name in peer.packages) or "this repository"
