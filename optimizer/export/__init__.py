"""Motions as programs and files for robot controllers: one file per format, each a function of a
motion and options.
"""
