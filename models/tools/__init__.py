"""Grippers and other tools by name: a tool is a file of figures in this folder."""
