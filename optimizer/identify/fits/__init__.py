"""Fits of figures to rows, one kind per file: torques, links, power, payload, temperature."""
