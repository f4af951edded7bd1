"""A user's own arm: from a URDF and a short description to the figures of a robot, what is missing
by stated rules.
"""
