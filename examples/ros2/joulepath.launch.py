"""Starts the node that plans motions of least energy, and sends its plans to a controller.

ros2 launch ./joulepath.launch.py robot:=ur5e controller:=scaled_joint_trajectory_controller
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """The node, with its arguments."""
    arguments = {
        "robot": ("ur5e", "Name of the robot; empty: the arm on robot_description."),
        "prefix": ("", "Prefix of all joint names."),
        "controller": ("joint_trajectory_controller", "Controller that runs every plan."),
    }
    controller = LaunchConfiguration("controller")
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=default, description=text)
                for name, (default, text) in arguments.items()
            ),
            Node(
                executable="joulepath",
                arguments=["ros2"],
                name="joulepath",
                parameters=[
                    {name: LaunchConfiguration(name) for name in ("robot", "prefix")},
                ],
                # a plan moves the arm as soon as it is published
                remappings=[("~/trajectory", ["/", controller, "/joint_trajectory"])],
                output="screen",
            ),
        ]
    )
