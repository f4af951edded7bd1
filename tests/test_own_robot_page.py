"""The page on files of users' own robots names every field."""

from __future__ import annotations

from pathlib import Path

from joulepath.models.own_arm.description import Collision, Description, Drives, Electronics

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "reference" / "own_robot.md").read_text(encoding="utf-8")


def test_every_field_is_on_the_page() -> None:
    for kind, place in (
        (Description, ""),
        (Drives, "drives."),
        (Electronics, "electronics."),
        (Collision, "collision."),
    ):
        for name in kind.__dataclass_fields__:
            known = (
                f"`{place}{name}`" in PAGE
                or f"`.{name}`" in PAGE
                or name in ("drives", "electronics", "collision")
            )
            assert known, name
