"""Kinematics of serial chains, forward and inverse; the only room that knows the form of an arm."""
