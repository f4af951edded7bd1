"""A ROS 2 node that plans motions of least energy."""
