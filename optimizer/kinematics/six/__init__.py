"""Inverse kinematics of arms with six joints."""
