"""Fits, one kind per file: torques, links, power, payload, temperature."""
