"""Declared values as dictionaries of plain values, as the service answers them in JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import Enum
from typing import Any

import numpy as np

from joulepath.optimizer.presentation.declared_fields import is_declared, shown_fields


def plain(value: Any) -> Any:
    """A value as dictionaries, lists, texts and numbers; None for a number that is not finite.

    Args:
        value: a value of a declared class, an array, or a collection of these. Internal fields are
            left out.
    """
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    kind: type = type(value)
    if is_declared(kind):
        return {name: plain(getattr(value, name)) for name in shown_fields(kind)}
    if isinstance(value, Mapping):
        return {name: plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value
