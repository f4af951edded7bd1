"""Replay of motions in MuJoCo: an independent check of torques, energy, contacts and savings."""
