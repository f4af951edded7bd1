"""Late imports of optional packages; computations need none of these packages."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def required(module: str, purpose: str, requirement: str) -> Any:
    """Import an optional module.

    Args:
        module: dotted name of the module.
        purpose: name of the calling function, for the message of the error.
        requirement: argument of `pip install` to install the module.

    Returns:
        The module.

    Raises:
        ModuleNotFoundError: the module is not installed; the message gives the `pip` command.
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
    """Build a data frame of pandas, or of polars if pandas is not installed.

    Args:
        columns: values of the columns by column name.

    Returns:
        A `pandas.DataFrame` or a `polars.DataFrame`.

    Raises:
        ModuleNotFoundError: neither package is installed.
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
