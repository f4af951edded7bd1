"""Searches up to a stage."""

from __future__ import annotations

from typing import Any

from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.run import Run


def prepared(problem: Problem, **options: Any) -> Run:
    """A search with prepared and bounded candidates."""
    run = Run(problem, **options)
    run.prepare()
    return run


def explored(problem: Problem) -> Candidate:
    """The best candidate before refinement and bounds, the slowest parts of a search."""
    run = prepared(problem)
    run.explore()
    best = run.state.best()
    assert best is not None
    return best
