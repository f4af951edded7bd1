"""Channels of a log for its report."""

from __future__ import annotations

from collections.abc import Iterator

from joulepath.models.robot import Array
from joulepath.optimizer.identify.logs.columns import NOT_LOGGED, Columns
from joulepath.optimizer.identify.logs.filters import noise
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.logs.log_formats import ChannelName
from joulepath.optimizer.identify.logs.log_report import Channel

_UNITS = {"q": "rad", "v": "rad/s", "a": "rad/s²", "power": "W", "temperature": "°C"}
_EFFORT_UNITS = {"current": "A", "torque": "N·m", "external": "N·m"}


def channels_of(log: Log, columns: Columns, effort: ChannelName | None) -> tuple[Channel, ...]:
    """All channels of a log.

    Args:
        log: the log.
        columns: columns of the file.
        effort: group of columns of the efforts.
    """
    return tuple(_channels(log, columns, effort))


def _channels(log: Log, columns: Columns, effort: ChannelName | None) -> Iterator[Channel]:
    units = _UNITS | {"effort": _EFFORT_UNITS.get(log.effort_meaning or "", "")}
    sources: dict[str, ChannelName | None] = {
        "q": "q",
        "v": "v",
        "a": "a",
        "effort": effort,
        "temperature": "temperature",
    }
    for name, group in sources.items():
        values: Array | None = getattr(log, name)
        if values is None:
            continue
        indices = columns.groups.get(group) if group is not None else None
        for j, size in enumerate(noise(values, log.rate)):
            if indices is not None and indices[j] == NOT_LOGGED:
                continue
            column = None if indices is None else columns.names[indices[j]]
            yield Channel(f"{name}{j + 1}", column, units[name], *_range(values[:, j]), float(size))
    if log.wrench is not None:
        for j, size in enumerate(noise(log.wrench, log.rate)):
            column = columns.names[columns.groups["wrench"][j]]
            yield Channel(
                f"wrench{j + 1}",
                column,
                "N" if j < 3 else "N·m",
                *_range(log.wrench[:, j]),
                float(size),
            )
    if log.power is not None:
        column = " · ".join(columns.names[k] for k in columns.groups["power"])
        (size,) = noise(log.power[:, None], log.rate)
        yield Channel("power", column, "W", *_range(log.power), float(size))


def _range(values: Array) -> tuple[float, float]:
    """Least and greatest value, with the digits of single precision."""
    low, high = (float(f"{each:.7g}") for each in (values.min(), values.max()))
    return low, high
