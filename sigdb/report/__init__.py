"""All figures and pages; the only place that imports matplotlib."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "Case",
    "Picture",
    "ReportSettings",
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
    "identification_figures",
    "joint_diagnosis_text",
    "overview_text",
    "plan_figures",
    "plan_text",
    "recorded_figures",
    "recorded_text",
    "recordings_card_markdown",
    "rig_figure",
    "rig_text",
    "save_figure",
    "signature_figure",
    "write_diagnosis_report",
    "write_evaluation_report",
    "write_identification_report",
    "write_joint_report",
    "write_plan_report",
    "write_recorded_report",
]
