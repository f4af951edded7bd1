"""From the documents of a report to the report."""

from __future__ import annotations

from joulepath.app.api.report.bundle import Bundle
from joulepath.app.api.report.job_report import job_report
from joulepath.app.api.report.log_report import log_report
from joulepath.app.api.report.motion_report import motion_report
from joulepath.app.api.report.placement_report import placement_report
from joulepath.app.api.report.programs import program_of
from joulepath.app.api.report.report import Report


def report_of(bundle: Bundle) -> Report:
    """The report of documents. Raises NotCertified or InvalidProblem."""
    if bundle.kind == "job":
        return job_report(bundle)
    if bundle.kind == "evaluate":
        return log_report(bundle)
    if bundle.kind == "placement":
        return placement_report(bundle)
    return motion_report(bundle, program_of(bundle))
