"""A report as PDF: one page of A4, laid out by Typst, with its documents attached."""

from __future__ import annotations

from dataclasses import asdict
from datetime import UTC, datetime
from importlib.resources import as_file, files
from importlib.util import find_spec

import orjson

from joulepath.app.api.report.bundle import NAME, Bundle
from joulepath.app.api.report.report import Report
from joulepath.app.exceptions.report import NoTypst

MEDIA_TYPE = "application/pdf"


def check_typst() -> None:
    """Raises NoTypst without the package for PDFs."""
    if find_spec("typst") is None:
        raise NoTypst


def pdf(report: Report, bundle: Bundle) -> bytes:
    """The file. Equal reports are equal files. `check_typst` comes before it."""
    import typst

    made = datetime.fromisoformat(bundle.made).replace(tzinfo=UTC)
    with as_file(files("joulepath.app") / "static/report") as folder:
        content: bytes = typst.compile(
            folder / "report.typ",
            root=folder,
            font_paths=[folder / "fonts"],
            ignore_system_fonts=False,
            sys_inputs={
                "report": orjson.dumps(asdict(report)).decode(),
                "attachment": NAME,
                "attached": bundle.packed().decode(),
            },
            format="pdf",
            timestamp=int(made.timestamp()),
        )
    return content
