"""Robots of own arms, built once per content of their figures."""

from __future__ import annotations

import hashlib
import json
import threading
from pathlib import Path
from typing import Any

from cachetools import LRUCache, cached

from joulepath.models.from_figures import robot_of
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.own_arm.reading import read_description
from joulepath.models.robot import MOST_ROBOTS, Robot


def _content(name: str, figures: dict[str, Any]) -> tuple[str, bytes]:
    return name, hashlib.sha256(json.dumps(figures, sort_keys=True).encode()).digest()


@cached(LRUCache(MOST_ROBOTS), key=_content, lock=threading.Lock())
def own_robot(name: str, figures: dict[str, Any]) -> Robot:
    """The robot of these figures: the same object for the same name and content. Raises
    ValueError."""
    return robot_of(name, figures)


def read_robot(path: Path) -> Robot:
    """The robot of a YAML description, named after the file. Raises InvalidArm or OSError.

    Engineering defaults have the trust letter E in `Robot.figures`.
    """
    return own_robot(path.stem, own_figures(path.stem, read_description(path))[0])
