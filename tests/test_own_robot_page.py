"""The page on robots of users' own, run as it is printed, with the URDF of another package."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

from joulepath.models.own_arm.description import Collision, Description, Drives, Electronics
from tests.mesh_folders import meshes as arm_folder

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "reference" / "own_robot.md").read_text()


def block(kind: str) -> str:
    """The only block of code of a kind."""
    (found,) = re.findall(rf"```{kind}\n(.*?)```", PAGE, re.DOTALL)
    return str(found)


def test_from_the_file_to_the_answer(tmp_path: Path) -> None:
    """Its digits are few enough to be the same on every machine."""
    shutil.copy(arm_folder("ur5e") / "ur5e.urdf", tmp_path)
    (tmp_path / "cell_arm.yaml").write_text(block("yaml"))
    code = f"import sys; sys.path.insert(0, {str(ROOT)!r})\n{block('python')}"
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    (printed,) = re.findall(r"It prints\n\n```\n(.*?)```", PAGE, re.DOTALL)
    assert run.stdout == printed


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
