"""Links with hulls: the bodies compared with obstacles, and their distances against distances of
the meshes.
"""

from __future__ import annotations

from dataclasses import replace

import coal
import numpy as np
from scipy.spatial import ConvexHull

from joulepath import Arm, Attachment, Box, Obstacle, Points, Scene, Sphere, load_tool
from joulepath.models.meshes import link_surfaces
from joulepath.optimizer.collision.coal_distance import coal_shape
from joulepath.optimizer.collision.cores import Core
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.problem.arm import TOOL
from tests.mesh_folders import meshes
from tests.models.own_arm.arms import URDF, changed, robot
from tests.optimizer.moves import ROBOT
from tests.optimizer.placement.cells import at

EXCESS = 2.7e-3 + 1e-4  # m; of the fit beyond the hulls of the meshes, and of its last digit
SEARCHED = 1e-6  # m; tolerance of Coal's search


POST = Obstacle("post", Box(np.array([0.1, 0.1, 0.8])), at(0.4, 0.3, 0.4), margin=0.0)
BALL = Obstacle("ball", Sphere(0.1), at(-0.5, 0.2, 0.5), margin=0.0)
SCAN = Obstacle(
    "scan", Points(np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]), 0.01), at(0.5, -0.4, 0.4)
)


def test_obstacles_are_compared_with_hulls_and_clouds_with_capsules() -> None:
    model = CollisionModel(Arm(robot=ROBOT, scene=Scene([POST, BALL, SCAN])))
    pairs = [(model.bodies[i], model.bodies[k]) for i, k in model.pairs.tolist()]
    of = {
        name: {k.is_hull for i, k in pairs if i.name == name} for name in ("post", "ball", "scan")
    }
    assert of == {"post": {True}, "ball": {True}, "scan": {False}}
    assert sum(i.name == "post" for i, _ in pairs) == 6
    assert not any(i.is_hull for i, _ in pairs)


def test_a_link_called_as_the_tool_is_compared_with_obstacles() -> None:
    """Its capsules are compared, in addition to the hulls of a gripper on it."""
    urdf = URDF.replace('"tool"', '"mounting"').replace('"forearm"', '"tool"')
    arm = robot(changed(urdf=urdf, tip="mounting"))
    gripper = load_tool("robotiq_2f_85").shape
    model = CollisionModel(Arm(robot=arm, tool=gripper, scene=Scene([POST])))
    pairs = [(model.bodies[i], k) for i, k in model.pairs.tolist()]
    with_post = [k for i, k in pairs if i.name == "post"]
    of_link = [k for k in with_post if k < len(arm.capsules)]
    assert [model.bodies[k].name for k in of_link] == ["tool"]
    assert sum(model.bodies[k].is_hull for k in with_post) == 1 + sum(p.is_hull for p in gripper)


def test_without_obstacles_there_are_no_hulls() -> None:
    """Links are compared with one another by capsules, with and without hulls."""
    with_hulls, without = (
        CollisionModel(Arm(robot=robot)) for robot in (ROBOT, replace(ROBOT, hulls=()))
    )
    assert [each.name for each in with_hulls.bodies] == [each.name for each in without.bodies]
    np.testing.assert_array_equal(with_hulls.pairs, without.pairs)


def test_links_are_compared_by_hulls_if_the_robot_says_so() -> None:
    """The tool is compared by hulls, too; links without hulls, such as the base, by their capsules.
    Checks of single configurations agree with the distances, and gradients agree with differences.
    """
    rod = Attachment(Sphere(0.03), at(0.0, 0.0, 0.05))
    model = CollisionModel(Arm(robot=replace(ROBOT, hulls_between_links=True), tool=[rod]))
    pairs = [(model.bodies[i], model.bodies[k]) for i, k in model.pairs.tolist()]
    assert all(i.is_hull == (i.link > 0) for i, _ in pairs)
    assert all(k.is_hull == (k.name != TOOL) for _, k in pairs)
    by_capsules = CollisionModel(Arm(robot=ROBOT, tool=[rod]))
    links = [
        {(each.bodies[i].link, each.bodies[k].link) for i, k in each.pairs.tolist()}
        for each in (model, by_capsules)
    ]
    assert links[0] == links[1]
    q = np.random.default_rng(5).uniform(-3, 3, (200, 6))
    distance, gradient = model.signed_distances(q)
    least = distance.min(axis=1)
    assert 0.05 < (least < 0).mean() < 0.5
    check = model.clearance_check(0.0)
    met = np.array([check.is_met(each) for each in q])
    np.testing.assert_array_equal(met, least >= 0)
    apart, step = distance > 1e-3, 1e-6
    for joint in range(6):
        moved = [model.signed_distances(q + sign * step * np.eye(6)[joint])[0] for sign in (1, -1)]
        difference = (moved[0] - moved[1]) / (2 * step)
        # a step across an edge changes the nearest point, and the distance is not differentiable
        # there
        error = np.abs(difference - gradient[:, :, joint])[apart]
        assert np.quantile(error, 0.99) < 1e-6


def test_distances_are_those_of_the_meshes_or_a_little_less() -> None:
    """Coal computes the reference: distances from the convex hulls of both meshes of every link."""
    model = CollisionModel(Arm(robot=ROBOT, scene=Scene([POST, BALL])))
    q = np.random.default_rng(2).uniform(-3, 3, (60, 6))
    frames = model.frames(q)
    distance = model.pair_distances(frames).distance
    request = coal.DistanceRequest(True, True)
    request.gjk_tolerance = SEARCHED / 10
    shapes = {}
    for link in range(1, 7):
        points = np.concatenate(
            [each.reshape(-1, 3) for each in link_surfaces(meshes("ur5e"), "ur5e", link).values()]
        )
        shapes[link] = coal_shape(Core(points[ConvexHull(points).vertices]))[0]
    compared = 0
    for column, (i, k) in enumerate(model.pairs.tolist()):
        obstacle, body = model.bodies[i], model.bodies[k]
        if not body.is_hull:
            continue
        shape, skin, local = coal_shape(obstacle.core)
        T = obstacle.T_link_core
        pose = coal.Transform3s(T[:3, :3].copy(), T[:3, 3].copy()) * local
        for n, own in enumerate(frames[:, body.link]):
            placed = coal.Transform3s(own[:3, :3].copy(), own[:3, 3].copy())
            true = (
                coal.distance(
                    shape, pose, shapes[body.link], placed, request, coal.DistanceResult()
                )
                + skin
                - obstacle.core.radius
            )
            if true > 0.01:
                assert true - EXCESS <= distance[n, column] <= true + SEARCHED
                compared += 1
    assert compared > 500
