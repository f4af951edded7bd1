"""Inverse kinematics of redundant arms with seven joints."""
