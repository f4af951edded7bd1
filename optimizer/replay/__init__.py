"""Motions played in MuJoCo: a second opinion on torques, energy, contacts and savings."""
