"""Bodies of the collision model as MuJoCo geoms, and the pairs that are checked.

A geom collides only with the geoms of its pairs. Margins are left out: a contact is a touch.
Obstacles with many parts (point clouds, voxels, mesh files) are left out, too, because MuJoCo
supports convex shapes only.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Body
from joulepath.optimizer.collision.model import CollisionModel, collision_model
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.clouds import Cloud


def unsimulated(arm: Arm) -> list[str]:
    """Names of the obstacles without a geom."""
    if not arm.collisions:
        return []
    return [obstacle.name for obstacle in arm.scene.obstacles if isinstance(obstacle.shape, Cloud)]


def add_shapes(simulator: Any, spec: Any, links: list[Any], arm: Arm) -> list[str]:
    """Add geoms and their pairs to an MjSpec.

    Args:
        simulator: the module `mujoco`.
        spec: the MjSpec.
        links: bodies of the MjSpec, from the world to the last link.
        arm: the arm with its scene.

    Returns:
        Names of the bodies by the number of their geom.
    """
    if not arm.collisions:
        return []
    found = collision_model(arm)
    added: dict[int, int] = {}
    for k in sorted({int(k) for k in found.pairs.ravel() if found.bodies[k].cloud is None}):
        _add_geom(simulator, spec, links[found.bodies[k].link], found.bodies[k], f"body {k}")
        added[k] = len(added)
    _add_pairs(spec, found, added)
    # the compiler numbers geoms by their link, and within a link in the order of their addition
    order = sorted(added, key=lambda k: (found.bodies[k].link, added[k]))
    return [found.bodies[k].name for k in order]


def _add_pairs(spec: Any, found: CollisionModel, added: dict[int, int]) -> None:
    for first, second in found.pairs.tolist():
        if first in added and second in added:
            spec.add_pair(geomname1=f"body {first}", geomname2=f"body {second}")


def _add_geom(simulator: Any, spec: Any, link: Any, body: Body, name: str) -> None:
    core, kinds = body.core, simulator.mjtGeom
    own: dict[str, Any]
    if core.is_half_space:
        own = {"type": kinds.mjGEOM_PLANE, "size": [0.0, 0.0, 1.0]}
    elif core.half_size is not None:
        own = {"type": kinds.mjGEOM_BOX, "size": core.half_size}
    elif core.disc_radius > 0:
        half = float(np.abs(core.points[:, 2]).max())
        own = {"type": kinds.mjGEOM_CYLINDER, "size": [core.disc_radius, half, 0.0]}
    elif len(core.points) == 1 or (len(core.points) == 2 and np.array_equal(*core.points)):
        own = {"type": kinds.mjGEOM_SPHERE, "size": [core.radius, 0.0, 0.0]}
    elif len(core.points) == 2:
        own = {
            "type": kinds.mjGEOM_CAPSULE,
            "size": [core.radius, 0.0, 0.0],
            "fromto": body.points.ravel(),
        }
    else:
        # MuJoCo grows no mesh: six points of each ball are inside the grown hull
        grown = core.points[:, None] + core.radius * np.concatenate([np.eye(3), -np.eye(3)])
        mesh = spec.add_mesh(name=name, uservert=grown.ravel())
        mesh.inertia = simulator.mjtMeshInertia.mjMESH_INERTIA_CONVEX
        own = {"type": kinds.mjGEOM_MESH, "meshname": name}
    if "fromto" not in own:
        centre = np.eye(4)
        if own["type"] == kinds.mjGEOM_SPHERE:
            centre[:3, 3] = core.points[0]
        own |= pose(body.T_link_core @ centre)
    # no collision bits: a geom collides only with the geoms of its pairs
    link.add_geom(name=name, contype=0, conaffinity=0, mass=0.0, **own)


def pose(T: Array) -> dict[str, Array]:
    """Position and quaternion w, x, y, z of a transform (4, 4)."""
    return {"pos": T[:3, 3], "quat": Rotation.from_matrix(T[:3, :3]).as_quat(scalar_first=True)}
