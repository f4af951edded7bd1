"""Settings of the search for least mechanical work at a fixed duration."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RestartSettings:
    """Settings of the search from random guesses of the best candidate."""

    restarts: int
    """Largest number of random guesses."""
    batch: int
    """Number of guesses solved at once; a batch without improvement is the last."""
    sharpened: int
    """Number of motions that get sharp corners."""
    ratio: float
    """Largest ratio of their work to the least work before."""


@dataclass(frozen=True)
class LeastWorkSettings:
    """Settings of the search for least work; work and energy ratios are to the least known."""

    least_time: float = 3.0
    """Time without which the search may not come to any motion [s]."""
    batch: int = 12
    """Number of candidates whose coarse motions are found at once, in order of lower bounds."""
    coarse_progress: float = 2e-2
    """Relative decrease promised by a further step on few control points at least."""
    restart_progress: float = 2e-3
    """Relative decrease promised by a further step from random guesses at least."""
    middle_progress: float = 2e-3
    """Relative decrease promised by a further step on more control points at least."""
    behind_ratio: float = 1.4
    """Ratio of expected work above which a motion is given up."""
    contender_ratio: float = 1.35
    """Largest ratio of work on few control points if a motion is solved on more of them."""
    most_contenders: int = 8
    """Largest number of motions solved on more control points."""
    restart_ratio: float = 1.6
    """Largest ratio of work of a motion from a random guess if it is solved on more points.

    Half of the motions need more. More control points take longest from there, and hardly ever lead
    to the best motion.
    """
    improvement_ratio: float = 0.99
    """Largest ratio of work to the least before with which a batch counts as an improvement."""
    follow_ratio: float = 1.05
    """Largest ratio of work of a motion without collision that is followed."""
    most_followed: int = 6
    """Largest number of motions followed."""
    promise: float = 0.97
    """Ratio of work with all control points and sharp corners to work of a coarse motion."""
    colliding_ratio: float = 1.05
    """Largest energy ratio of a colliding motion without clearance constraints."""
    sharpening_ratio: float = 1.04
    """Largest energy ratio of a motion before its corners are sharpened."""
    sole: RestartSettings = RestartSettings(restarts=32, batch=32, sharpened=4, ratio=1.03)
    """Restarts of a sole candidate.

    The motion of least work often is a wide swing. Some percent of the guesses lead to it, and on
    few control points it does not stand out. Coarse motions within some percent do not tell which
    needs the least with sharp corners.
    """
    several: RestartSettings = RestartSettings(restarts=32, batch=8, sharpened=1, ratio=1.0)
    """Restarts of the best of several candidates, whose choice has taken time already."""


LEAST_WORK = LeastWorkSettings()
