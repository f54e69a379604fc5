"""A plan is a pure function of the recipe; a run is plan minus receipts.

First the templates (each distinct case once, simulated), then the rows (a template, turned, with a specimen and noise,
analysed).
"""

from sigdb.database.integrity import Finding
from sigdb.sweep.coverage import Coverage, coverage
from sigdb.sweep.design import Design, Grid
from sigdb.sweep.plan import Plan
from sigdb.sweep.planning import make_plan
from sigdb.sweep.progress import Progress
from sigdb.sweep.reconstruction import plan_from
from sigdb.sweep.refine import Refinement, refine
from sigdb.sweep.run import Summary, run
from sigdb.sweep.verify import Repair, repair, verify

__all__ = [
    "Coverage",
    "Design",
    "Finding",
    "Grid",
    "Plan",
    "Progress",
    "Refinement",
    "Repair",
    "Summary",
    "coverage",
    "make_plan",
    "plan_from",
    "refine",
    "repair",
    "run",
    "verify",
]
