"""The report that a person reads: report.html and report.json."""

from vrdp_prob.report.content import ReportContent
from vrdp_prob.report.document import schema, to_document
from vrdp_prob.report.from_posterior import build
from vrdp_prob.report.page import render
from vrdp_prob.report.writing import ReportFiles, write_report

__all__ = ["ReportContent", "ReportFiles", "build", "render", "schema", "to_document", "write_report"]
