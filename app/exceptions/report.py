"""Errors of reports."""

from __future__ import annotations

from joulepath.app.exceptions.base import ServiceError


class NoTypst(ServiceError):
    """The package for PDF files, Typst, is not installed."""

    status = 501
    title = "PDF not available"
    remedy = (
        "Ask for `html` and print the page from the browser; or install Typst by `pip install "
        "'joulepath[report]'`."
    )
    detail = "PDFs need the extra `report` of the package: ask for `html`, or install it."
