"""All figures and pages; the only place that imports matplotlib."""

from sigdb.report.figures import save_figure, signature_figure
from sigdb.report.settings import Report

__all__ = ["Report", "save_figure", "signature_figure"]
