"""The report: one self-contained HTML page that opens offline."""

from covertool.report.page.document import report_page
from covertool.report.page.study import LAYERS, TABLES, ReportStudy

__all__ = ["LAYERS", "TABLES", "ReportStudy", "report_page"]
