"""A plan is a pure function of the recipe; a run is plan minus receipts.

First the templates (each distinct case once, simulated), then the rows (a template, turned, with a specimen and noise,
analysed).
"""

from sigdb.database.integrity import Finding
from sigdb.sweep.design import Design, Grid
from sigdb.sweep.plan import Plan
from sigdb.sweep.planning import make_plan
from sigdb.sweep.reconstruction import plan_from
from sigdb.sweep.run import Progress, Summary, run
from sigdb.sweep.verify import Repair, repair, verify

__all__ = [
    "Design",
    "Finding",
    "Grid",
    "Plan",
    "Progress",
    "Repair",
    "Summary",
    "make_plan",
    "plan_from",
    "repair",
    "run",
    "verify",
]
