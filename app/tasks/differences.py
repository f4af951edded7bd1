"""The quantities of a motion on a changed arm, and their differences from those of the base."""

from __future__ import annotations

from typing import Any

from joulepath.app.answers.declared import as_json
from joulepath.app.convert.fields import fields
from joulepath.optimizer.energy.losses import ENERGY_FLOOR
from joulepath.optimizer.result.energy import ElectricalEnergy, Energy


def quantities(energy: Energy, duration: float) -> dict[str, Any]:
    """The quantities that base and changes are compared by [s, J, W]; `electrical` is a dict of its parts."""
    return {
        "duration": duration,
        "electrical": fields(energy.electrical, *(n for n in ElectricalEnergy.__dataclass_fields__ if n != "interval")),
        "mechanical": energy.mechanical.total,
        **fields(energy, "mean_power", "peak_power"),
    }


def of_base(energy: Energy, duration: float) -> dict[str, Any]:
    """The quantities of the base, with the interval of its energy."""
    return quantities(energy, duration) | {"electrical": as_json(energy.electrical)}


def differences(base: dict[str, Any], energy: Energy, duration: float) -> dict[str, Any]:
    """The quantities of a motion, each as value, difference and relative difference from that of the base."""
    return {
        name: {part: _difference(base[name][part], value[part]) for part in value}
        if isinstance(value, dict)
        else _difference(base[name], value)
        for name, value in quantities(energy, duration).items()
    }


def _difference(base: float, value: float) -> dict[str, Any]:
    difference = value - base
    return {
        "value": value,
        "difference": difference,
        "relative": difference / abs(base) if abs(base) > ENERGY_FLOOR else None,
    }
