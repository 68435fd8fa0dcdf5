"""Reports as one HTML file that needs no network: the text reports with charts and pictures."""

from guideload.html_report.page import report_page, save_page
from guideload.html_report.pages import comparison_page, duty_page, run_page, save, sizing_page, study_page

__all__ = [
    "comparison_page",
    "duty_page",
    "report_page",
    "run_page",
    "save",
    "save_page",
    "sizing_page",
    "study_page",
]
