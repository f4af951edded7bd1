"""Packages that are not needed to compute, and are imported where one is used."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def required(module: str, purpose: str, requirement: str) -> Any:
    """An imported module.

    Args:
        module: name of the module.
        purpose: the function that needs it, for the error.
        requirement: what to install.

    Raises:
        ModuleNotFoundError: the module is not installed; says what to install.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        package = module.partition(".")[0]
        raise ModuleNotFoundError(
            f"`{purpose}` needs {package}, which is not installed: pip install '{requirement}'.",
            name=error.name,
        ) from None


def data_frame(columns: dict[str, Any]) -> Any:
    """A table of pandas, or of polars where pandas is not installed.

    Raises:
        ModuleNotFoundError: neither is installed.
    """
    for name in ("pandas", "polars"):
        try:
            frames = import_module(name)
        except ModuleNotFoundError:
            continue
        return frames.DataFrame(columns)
    raise ModuleNotFoundError(
        "`to_frame` needs pandas or polars, and neither is installed: pip install pandas.",
        name="pandas",
    )
