"""Errors of the pictures of robots."""

from __future__ import annotations

from joulepath.app.exceptions.base import ServiceError


class NoMeshes(ServiceError):
    """The meshes of a robot are not installed."""

    MESSAGE = "No meshes of this robot are installed: the extra `meshes` has those of ur3e and ur5e."
