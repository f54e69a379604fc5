"""Table of the looks of a history: indicators in healthy deviations, doubts and alarms."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from sigdb.core import BoolArray, FloatArray
from sigdb.diagnosis import OTHER_LOAD, OTHER_SPEED
from sigdb.monitoring.alarms import standardised
from sigdb.monitoring.look_results import LookResults, Reference
from sigdb.monitoring.looks import Look
from sigdb.monitoring.settings import MonitorSettings

UNSTATED = "load or sensor"
"""Doubt about a look whose load is not stated, where all mesh harmonics have changed alike."""

_INDICATOR_DEVIATION = 0.05
"""Least deviation of an indicator on a logarithmic scale: that of noise."""

_LEVEL_DEVIATION = 0.2
"""Least deviation of a level, dB: sensors and loads are no steadier. Assumed."""


def look_table(
    looks: Sequence[Look],
    results: LookResults,
    healthy: BoolArray,
    limit: float,
    *,
    reference: Reference,
    settings: MonitorSettings,
) -> pd.DataFrame:
    """Return a row for each look, with the columns of :attr:`.GearHistory.looks`.

    Parameters
    ----------
    looks, results, healthy
        The looks, their numbers, and whether each is healthy.
    limit
        Limit of the indicators in healthy deviations.
    reference
        The healthy looks that they are compared with.
    settings
        Zones.
    """
    levels = 20 * np.log10(np.maximum(results.rms, np.finfo(float).tiny))
    logarithms = {"health_indicator": "misfit", "tooth_indicator": "pulse", "rest_indicator": "rest"}
    indicators = {
        name: standardised(getattr(results, of), healthy, least=_INDICATOR_DEVIATION) for name, of in logarithms.items()
    }
    table = pd.DataFrame(
        {
            "recording": [look.name for look in looks],
            "day": np.array([np.nan if look.day is None else look.day for look in looks]),
            "healthy": healthy,
            **indicators,
            "tooth": results.tooth,
            "level": standardised(levels, healthy, least=_LEVEL_DEVIATION),
            "level_db": levels - levels[healthy].mean(),
            **{name: getattr(results, name) for name in ("likeness", "na4_star", "nb4_star", "rms", "record_rms")},
        }
    )
    table["zone"] = "" if settings.zones is None else [_zone(rms, settings.zones) for rms in results.record_rms]
    table["doubt"] = _doubts(looks, results, healthy, limit, reference)
    exceeds = (table["health_indicator"] > limit) | (table["tooth_indicator"] > limit)
    table["alarm"] = exceeds & (table["doubt"] == "")
    return table


def _doubts(
    looks: Sequence[Look], results: LookResults, healthy: BoolArray, limit: float, reference: Reference
) -> FloatArray:
    """Return what may explain a difference of each look, (L,) texts; empty where nothing but the gear may."""
    load = np.array([np.nan if (each := reference.load_of(look)) is None else each for look in looks])
    speed = results.speed_rpm
    together = np.abs(standardised(results.common_db, healthy, least=_LEVEL_DEVIATION)) > limit
    stated = np.isfinite(load) & np.isfinite(load[healthy]).all()
    return np.select(
        [
            _is_outside(speed, speed[healthy], OTHER_SPEED),
            stated & _is_outside(load, load[healthy], OTHER_LOAD),
            ~stated & together,
        ],
        ["speed", "load", UNSTATED],
        "",
    )


def _is_outside(values: FloatArray, healthy: FloatArray, share: float) -> BoolArray:
    """Return whether values lie outside the range of the healthy ones by more than a share of its nearer end."""
    nearest = np.clip(values, healthy.min(), healthy.max())
    return np.asarray(np.abs(values - nearest) > share * np.abs(nearest))


def _zone(rms: float, ends: tuple[float, float, float]) -> str:
    """Return the zone of an rms in m/s by the ends of zones in mm/s."""
    return "ABCD"[int(np.searchsorted(ends, 1e3 * rms))]
