"""Machines over time: a health indicator of each gear, alarms that count the looks, and what has changed."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "GearHistory",
    "Look",
    "MonitorSettings",
    "gear_history",
    "monitor",
]
