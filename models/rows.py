"""Dataclasses of arrays with rows in common, such as the cells of a cover."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array


@dataclass(frozen=True)
class Rows:
    """Base of dataclasses of arrays (n, …), or of tables, with rows in common."""

    def __getitem__(self, chosen: NDArray[np.intp] | slice) -> Self:
        return type(self)(*(getattr(self, field.name)[chosen] for field in fields(self)))

    def joined(self, other: Self) -> Self:
        """The rows of this table, followed by the rows of the other."""
        return type(self)(
            *(
                _joined(getattr(self, field.name), getattr(other, field.name))
                for field in fields(self)
            )
        )


def _joined(first: Array | Rows, second: Array | Rows) -> Array | Rows:
    if isinstance(first, Rows):
        assert isinstance(second, Rows)
        return first.joined(second)
    return np.concatenate([first, second])
