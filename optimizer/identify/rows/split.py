"""Moves held out: whole motions, never single samples."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Mask
from joulepath.optimizer.identify.errors import NothingHeldOut
from joulepath.optimizer.identify.rows.fit_rows import Rows


def held_out(rows: Rows, fraction: float) -> list[Mask]:
    """The rows (n,) of motions held out: about `fraction` of the moving time; if that is 1, each
    motion in its turn.

    The same rows give the same ones. Raises NothingHeldOut if there are fewer than two motions.
    """
    groups = rows.groups
    if len(groups) < 2:
        raise NothingHeldOut(len(np.unique(rows.move[~rows.rest])))
    if fraction == 1:
        return [rows.group == group for group in groups]
    time = np.array([rows.weight[(rows.group == group) & ~rows.rest].sum() for group in groups])
    order = np.random.default_rng(0).permutation(len(groups))
    ahead = np.cumsum(time[order]) - time[order]
    # at least one motion on each side
    chosen = order[: max(1, min(int((ahead < fraction * time.sum()).sum()), len(groups) - 1))]
    return [np.isin(rows.group, groups[chosen])]
