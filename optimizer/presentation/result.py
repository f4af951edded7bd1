"""Representations of the library's results in notebooks and scripts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from enum import Enum
from html import escape
from typing import Any

import numpy as np

from joulepath.optimizer.presentation.chart import Chart, as_svg, plotted
from joulepath.optimizer.presentation.declared_fields import is_declared, shown_fields
from joulepath.optimizer.presentation.equality import Comparable
from joulepath.optimizer.presentation.extras import data_frame
from joulepath.optimizer.presentation.files import Saved

Rows = Sequence[Sequence[str]]


class Result(Comparable, Saved):
    """Base of the library's results.

    Subclasses implement the methods with an underscore; the public methods use them.
    """

    def _headline(self) -> str:
        """The result in a few words, with its most important figures."""
        raise NotImplementedError

    def _rows(self) -> Rows:
        """A small table of texts, its titles first."""
        raise NotImplementedError

    def _shown(self) -> Any:
        """Declared values, or a dictionary of declared values."""
        raise NotImplementedError

    def _columns(self) -> dict[str, Any]:
        """Columns of the table by their names."""
        raise NotImplementedError

    def _charts(self) -> Sequence[Chart]:
        """Charts, the most important charts first; empty for a result without curves."""
        return ()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._headline()})"

    def _repr_html_(self) -> str:
        pictures = "".join(map(as_svg, list(self._charts())[:1]))
        return (
            f"<div><p><b>{type(self).__name__}</b>: {escape(self._headline())}</p>"
            f"{_html_table(self._rows())}{pictures}</div>"
        )

    def to_dict(self) -> dict[str, Any]:
        """The result as plain values, with the names and units of the service's JSON.

        Returns:
            Dictionaries, lists, texts and numbers, for `json.dumps`; None for non-finite numbers.
        """
        found: dict[str, Any] = plain(self._shown())
        return found

    def to_frame(self) -> Any:
        """The result as a table of pandas, or of polars if pandas is not installed.

        Returns:
            A `DataFrame`; its columns have the names and units of the service's JSON, with the
            number of a joint behind them.

        Raises:
            ModuleNotFoundError: neither pandas nor polars is installed.
        """
        return data_frame(self._columns())

    def plot(self) -> Any:
        """Draw the result by Matplotlib, of the extra `plot`.

        Returns:
            The figure.

        Raises:
            ModuleNotFoundError: Matplotlib is not installed.
            ValueError: there is nothing to draw.
        """
        charts = self._charts()
        if not charts:
            raise ValueError(
                f"{self!r} has no curves to draw. An evaluation has curves with a "
                "`sample_period`; other results without curves are tables: see `to_frame`."
            )
        return plotted(charts, self._headline())


def _html_table(rows: Rows) -> str:
    head, *body = ([escape(cell) for cell in row] for row in rows)
    titles = "".join(f"<th>{cell}</th>" for cell in head)
    lines = (f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in body)
    return f"<table><thead><tr>{titles}</tr></thead><tbody>{''.join(lines)}</tbody></table>"


def per_joint(name: str, values: Any) -> dict[str, Any]:
    """The columns of an array (n, nq), named by the quantity and the joint's number from 1."""
    return {f"{name}{j}": column for j, column in enumerate(values.T, 1)}


def plain(value: Any) -> Any:
    """A value as dictionaries, lists, texts and numbers; None for a non-finite number.

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
