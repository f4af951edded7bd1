"""`joulepath robots`."""

from __future__ import annotations

from typing import Any

import click

from app.cli.answer import write

ENERGY_PARTS = ("inertials", "friction_laws", "drives", "electronics")
"""Sections of a robot's parameters that its energies depend on."""


@click.command(
    epilog="""\b
Example:
  joulepath robots"""
)
def robots() -> None:
    """Lists the robots that a request can name.

    The columns are the name, the title, the number of joints, the rated payload [kg], and the trust letters of the
    parameters that energies depend on. A: published by the manufacturer, B: fitted to measured data, C: second-hand
    from a paper, T: transferred from a sister robot, E: engineering default without a source.
    """
    from models.registry import load_robot, robot_names

    head = ("name", "title", "joints", "payload [kg]", *(f"trust: {part.replace('_', ' ')}" for part in ENERGY_PARTS))
    rows = [head]
    for robot in map(load_robot, robot_names()):
        letters = (" ".join(sorted(trust_letters(robot.figures[part]))) for part in ENERGY_PARTS)
        rows.append((robot.name, robot.title, str(robot.nq), f"{robot.rated_payload:g}", *letters))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows)
    write("\n".join(lines).encode(), None)


def trust_letters(section: Any) -> set[str]:
    """The trust letters of all parameters in a section of a robot's parameters."""
    if not isinstance(section, dict):
        return set()
    if "trust" in section:
        return {str(section["trust"])}
    return set().union(*map(trust_letters, section.values()))
