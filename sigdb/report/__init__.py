"""All figures and pages; the only place that imports matplotlib."""

from typing import TYPE_CHECKING

from sigdb.core.lazy import lazy_names

if TYPE_CHECKING:
    from sigdb.report.campbell import campbell_figure
    from sigdb.report.card_page import database_card_markdown
    from sigdb.report.claims_page import claims_markdown, claims_text
    from sigdb.report.comparison import Case, comparison_figure
    from sigdb.report.coverage import coverage_figure
    from sigdb.report.diagnosis_page import diagnosis_text, write_diagnosis_report
    from sigdb.report.evaluation_page import evaluation_figures, evaluation_html, write_evaluation_report
    from sigdb.report.figures import check_picture, save_figure, signature_figure
    from sigdb.report.recorded_page import write_recorded_report
    from sigdb.report.recorded_pictures import history_figure, recorded_figures
    from sigdb.report.recorded_tables import history_text, recorded_text
    from sigdb.report.rig_drawing import rig_figure
    from sigdb.report.rig_page import rig_text
    from sigdb.report.settings import Picture, Report

__all__ = [
    "Case",
    "Picture",
    "Report",
    "campbell_figure",
    "check_picture",
    "claims_markdown",
    "claims_text",
    "comparison_figure",
    "coverage_figure",
    "database_card_markdown",
    "diagnosis_text",
    "evaluation_figures",
    "evaluation_html",
    "history_figure",
    "history_text",
    "recorded_figures",
    "recorded_text",
    "rig_figure",
    "rig_text",
    "save_figure",
    "signature_figure",
    "write_diagnosis_report",
    "write_evaluation_report",
    "write_recorded_report",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "diagnosis_text": "sigdb.report.diagnosis_page",
        "write_diagnosis_report": "sigdb.report.diagnosis_page",
        "Case": "sigdb.report.comparison",
        "Picture": "sigdb.report.settings",
        "Report": "sigdb.report.settings",
        "campbell_figure": "sigdb.report.campbell",
        "check_picture": "sigdb.report.figures",
        "claims_markdown": "sigdb.report.claims_page",
        "claims_text": "sigdb.report.claims_page",
        "comparison_figure": "sigdb.report.comparison",
        "database_card_markdown": "sigdb.report.card_page",
        "coverage_figure": "sigdb.report.coverage",
        "evaluation_figures": "sigdb.report.evaluation_page",
        "evaluation_html": "sigdb.report.evaluation_page",
        "history_figure": "sigdb.report.recorded_pictures",
        "history_text": "sigdb.report.recorded_tables",
        "recorded_figures": "sigdb.report.recorded_pictures",
        "recorded_text": "sigdb.report.recorded_tables",
        "rig_figure": "sigdb.report.rig_drawing",
        "rig_text": "sigdb.report.rig_page",
        "save_figure": "sigdb.report.figures",
        "signature_figure": "sigdb.report.figures",
        "write_evaluation_report": "sigdb.report.evaluation_page",
        "write_recorded_report": "sigdb.report.recorded_page",
    },
)
