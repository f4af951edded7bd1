"""A ROS 2 node for the planning of motions of least energy."""
