"""`joulepath tools`."""

from __future__ import annotations

import click

from joulepath.app.cli.answer import write
from joulepath.app.cli.terminal import table


@click.command(
    epilog="""\b
Examples:
  joulepath tools
  joulepath tools robotiq_2f_85"""
)
@click.argument("name", required=False)
def tools(name: str | None) -> None:
    """Lists the grippers for the field `tool` of a request, or the figures of the gripper NAME.

    The trust letters are the same as in `joulepath robots`. A: published by the manufacturer, C:
    from a third party's file, second-hand, E: engineering default without a source.
    """
    from joulepath.models.tools.registry import tool_names
    from joulepath.optimizer.exceptions import UnknownTool

    if name is not None and name not in tool_names():
        raise UnknownTool(list(tool_names()))
    write((_list() if name is None else _figures(name)).encode(), None)


def _list() -> str:
    from joulepath.models.tools.registry import FIGURES, tool_figures, tool_names
    from joulepath.models.trust import trust_letters

    rows = [("name", "title", "mass [kg]", "TCP z [m]", "trust")]
    for name in tool_names():
        figures = tool_figures(name)
        letters = trust_letters({each: figures[each] for each in FIGURES})
        mass, tcp = figures["mass"]["value"], figures["tcp"]["value"]
        rows.append((name, figures["title"], f"{mass:g}", f"{tcp[2]:g}", " ".join(sorted(letters))))
    return table(rows)


def _figures(name: str) -> str:
    from joulepath.models.tools.registry import FIGURES, tool_figures

    rows = [("figure", "value", "unit", "trust", "source")]
    for each in FIGURES:
        figure = tool_figures(name)[each]
        rows.append((each, str(figure["value"]), figure["unit"], figure["trust"], figure["source"]))
    return table(rows)
