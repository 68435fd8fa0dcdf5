"""Reports as one HTML file that needs no network: sentences and tables of the text reports, charts and pictures."""

from guideload.html_report.run import run_page, save

__all__ = ["run_page", "save"]
