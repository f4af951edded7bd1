"""The table of robots in docs/reference/robots.md, against the figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from joulepath.models.registry import load_figures, robot_names
from joulepath.models.trust import worst_letter
from joulepath.optimizer.problem.robots import load_robot

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "robots.md"


def columns(name: str) -> dict[str, Any]:
    """The figures behind each column of the table."""
    figures = load_figures(name)
    inertials, drives = figures["inertials"], figures["drives"]
    return {
        "kinematics": figures["kinematics"],
        "link masses": inertials["mass"],
        "link inertias": inertials,
        "torque limits": figures["limits"]["torque"],
        "rotor inertias": drives["rotor_inertia"],
        "friction": next(iter(figures["friction_laws"].values())),
        "copper loss": drives["copper"],
        "idle power": figures["electronics"]["idle_power"],
        "capsules": {link: figures["collision"][link] for link in load_robot(name).link_names},
    }


def test_the_table_has_the_worst_letters_of_every_robot() -> None:
    _, mark, rest = PAGE.read_text(encoding="utf-8").partition("| robot |")
    table = mark + rest.partition("\n\n")[0]
    head, _, *body = (line.strip("| ").split(" | ") for line in table.splitlines())
    assert sorted(row[0].strip("`") for row in body) == sorted(robot_names())
    for name, payload, *letters in body:
        figures = columns(name.strip("`"))
        assert float(payload) == load_robot(name.strip("`")).rated_payload
        assert dict(zip(head[2:], letters, strict=True)) == {
            column: worst_letter(of) for column, of in figures.items()
        }
