"""Bounded, interruptible readers of uploaded files."""
