"""Errors of reports."""

from __future__ import annotations

from joulepath.app.exceptions.base import ServiceError


class NoTypst(ServiceError):
    """The package for PDF files, Typst, is not installed."""

    status = 501
    title = "PDF not available"
    remedy = (
        "Ask for `html` and print the page from the browser; or install Typst in the environment "
        "of the service, by `pip install 'joulepath[report]'`, or by `.venv/bin/pip install typst` "
        "after `make serve`. The service need not be restarted."
    )
    detail = (
        "PDFs need the package `typst`, which is not installed beside the service: ask for `html`, "
        "or install it by `pip install typst`."
    )
