"""`joulepath robots`."""

from __future__ import annotations

import click

from app.cli.answer import write


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
    from models.trust import ENERGY_SECTIONS, trust_letters

    head = (
        "name",
        "title",
        "joints",
        "payload [kg]",
        *(f"trust: {part.replace('_', ' ')}" for part in ENERGY_SECTIONS),
    )
    rows = [head]
    for robot in map(load_robot, robot_names()):
        letters = (" ".join(sorted(trust_letters(robot.figures[part]))) for part in ENERGY_SECTIONS)
        rows.append((robot.name, robot.title, str(robot.nq), f"{robot.rated_payload:g}", *letters))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows)
    write("\n".join(lines).encode(), None)
