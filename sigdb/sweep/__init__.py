"""A plan is a pure function of the recipe; a run is plan minus receipts.

First the templates (each distinct case once, simulated), then the rows (a template, turned, with a specimen and noise,
analysed).
"""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "AddedSummary",
    "Coverage",
    "Grid",
    "Job",
    "Life",
    "NuisanceModes",
    "Plan",
    "Refinement",
    "Repair",
    "SweepLimits",
    "SweepSettings",
    "SweepSummary",
    "add_features",
    "coverage",
    "life_rows",
    "make_plan",
    "plan_from",
    "refine",
    "remove_features",
    "repair",
    "run",
    "verify",
]
