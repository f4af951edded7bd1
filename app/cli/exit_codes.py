"""Exit codes of `joulepath`. Its `--help` explains them."""

from __future__ import annotations

import orjson

ANSWERED, PROBLEM, INVALID = 0, 1, 2
# 128 + SIGINT, as shells report it
INTERRUPTED = 130

_ABOUT_THE_INPUT = ("/problems/validation", "/problems/invalid-table", "/problems/unknown-robot")


def of_problem(problem: bytes) -> int:
    """INVALID for a problem (its JSON) of the input itself, PROBLEM for any other."""
    return INVALID if orjson.loads(problem)["type"] in _ABOUT_THE_INPUT else PROBLEM
