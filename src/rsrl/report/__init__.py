"""One self-contained HTML page with the tables and figures of a study folder."""

from rsrl.report.page import Report, Section, explanation_page, make_report
from rsrl.report.results import Results, read_results

__all__ = ["Report", "Results", "Section", "explanation_page", "make_report", "read_results"]
