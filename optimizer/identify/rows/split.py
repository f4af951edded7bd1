"""Split into training and held-out rows by whole motions, never by single samples."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Mask
from joulepath.optimizer.identify.errors import NothingHeldOut
from joulepath.optimizer.identify.rows.fit_rows import Rows


def held_out_masks(rows: Rows, fraction: float) -> list[Mask]:
    """Rows held out for validation, the same for the same input.

    Args:
        rows: rows of all logs.
        fraction: share of the moving time to hold out; 1 holds out one motion after another.

    Returns:
        Masks (n,), one for every fit.

    Raises:
        NothingHeldOut: there are fewer than two motions.
    """
    groups = rows.groups
    if len(groups) < 2:
        raise NothingHeldOut(len(np.unique(rows.move[~rows.rest])))
    if fraction == 1:
        return [rows.group == group for group in groups]
    time = np.array([rows.weight[(rows.group == group) & ~rows.rest].sum() for group in groups])
    order = np.random.default_rng(0).permutation(len(groups))
    time_before = np.cumsum(time[order]) - time[order]
    wanted = int((time_before < fraction * time.sum()).sum())
    # at least one motion on each side
    chosen = order[: max(1, min(wanted, len(groups) - 1))]
    return [np.isin(rows.group, groups[chosen])]
