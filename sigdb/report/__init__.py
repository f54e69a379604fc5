"""All figures and pages; the only place that imports matplotlib."""

from typing import TYPE_CHECKING

from sigdb.core.lazy import lazy_names

if TYPE_CHECKING:
    from sigdb.report.figures import save_figure, signature_figure
    from sigdb.report.settings import Report

__all__ = [
    "Report",
    "save_figure",
    "signature_figure",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "Report": "sigdb.report.settings",
        "save_figure": "sigdb.report.figures",
        "signature_figure": "sigdb.report.figures",
    },
)
