"""Estimates of figures, and how well they are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.identify.estimates.grouped import jackknife

Name = tuple[str, int | None]
"""A figure, and the number of the joint from 0; None for a figure of the whole arm."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """Values (p,) of the figures `names`, and their values (G, p) with each cluster of moves left
    out.

    `drift` (p, p) is the covariance that an assumption before the fit adds. `why` (p,) says why the
    robot's own value was kept, or is empty for a figure that was found.
    """

    names: tuple[Name, ...]
    value: Array
    replicates: Array
    why: tuple[str, ...]
    drift: Array

    @property
    def covariance(self) -> Array:
        """Covariance (p, p) of the values."""
        return jackknife(self.replicates) + self.drift


def joined(estimates: list[Estimate], shared: Array | None = None) -> Estimate:
    """Several estimates from the same clusters as one. `shared` is the drift between the first and
    the second.
    """
    estimates = [each for each in estimates if each.names]
    if not estimates:
        return Estimate((), np.zeros(0), np.zeros((0, 0)), (), np.zeros((0, 0)))
    sizes = np.cumsum([0, *(len(each.names) for each in estimates)])
    drift = np.zeros((sizes[-1], sizes[-1]))
    for each, start, end in zip(estimates, sizes[:-1], sizes[1:], strict=True):
        drift[start:end, start:end] = each.drift
    if shared is not None:
        drift[: sizes[1], sizes[1] :], drift[sizes[1] :, : sizes[1]] = shared, shared.T
    return Estimate(
        names=tuple(name for each in estimates for name in each.names),
        value=np.concatenate([each.value for each in estimates]),
        replicates=np.hstack([each.replicates for each in estimates]),
        why=tuple(why for each in estimates for why in each.why),
        drift=drift,
    )
