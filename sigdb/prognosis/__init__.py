"""Prognosis: damage of a tooth over time, by growth laws with stated priors, and its remaining life."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "GrowthLaw",
    "RemainingLife",
    "SeverityFilter",
    "SeverityPosterior",
    "archard_wear",
    "joined_laws",
    "paris_crack",
    "pit_count",
    "remaining_life",
    "severity_after",
]
