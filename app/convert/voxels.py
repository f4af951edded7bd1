"""Conversion of occupied grid cells of requests."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from joulepath.app.convert.base64_data import decoded
from joulepath.app.schemas.shapes import MOST_CELLS, VoxelBits, Voxels
from joulepath.optimizer.exceptions import InvalidProblem


def occupied_cells(given: Voxels) -> npt.NDArray[np.int64]:
    """Occupied cells (n, 3). Raises InvalidProblem with the field."""
    if (given.cells is None) == (given.bits is None):
        raise InvalidProblem("cells", "Give the occupied cells either as `cells` or as `bits`.")
    return np.array(given.cells, dtype=np.int64) if given.bits is None else _from_bits(given.bits)


def _from_bits(bits: VoxelBits) -> npt.NDArray[np.int64]:
    count = int(np.prod(bits.dimensions))
    if count > MOST_CELLS:
        raise InvalidProblem(
            "bits.dimensions",
            f"bits.dimensions must make at most {MOST_CELLS} cells: use larger ones.",
        )
    data = decoded(bits.data, "bits.data")
    if len(data) != -(-count // 8):
        raise InvalidProblem(
            "bits.data",
            f"bits.data holds {len(data)} bytes, but {count} cells need {-(-count // 8)}: one bit "
            "per cell, eight to a byte.",
        )
    numbers = np.flatnonzero(
        np.unpackbits(np.frombuffer(data, dtype=np.uint8), count=count, bitorder="little")
    )
    return np.stack(np.unravel_index(numbers, bits.dimensions, order="F"), axis=1).astype(np.int64)
