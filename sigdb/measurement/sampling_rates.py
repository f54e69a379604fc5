"""The sampling rate of each channel: as given, as stated with it, by a column of times, or as stated for the file."""

import numpy as np

from sigdb.core.errors import InputError
from sigdb.measurement.readers.contents import Column
from sigdb.measurement.time_base import EVEN, time_base

SAME = 1e-3
"""Rates nearer than this part are not told as different."""

HIGHEST = 1e9
"""Hz; a file that states more is wrong."""


def sampling_rates(
    columns: tuple[Column, ...], *, given: float | None, time: Column | None, stated: float | None
) -> tuple[list[float], list[str]]:
    """Rate of each column, Hz, and where they are from.

    Parameters
    ----------
    columns
        Series, with the rate that the file states for each, if any.
    given
        By the user; it wins.
    time
        A column of times, if there is one.
    stated
        By the file for all.

    Raises
    ------
    InputError
        If there is none, or the times are not even.
    """
    if given is not None:
        return [given] * len(columns), _disagreeing(given, columns, time, stated)
    general, notes = stated, [] if stated is None else [f"sampling rate {stated:.9g} Hz from the file"]
    if time is not None:
        general, notes = _from_times(time, columns)
        if stated is not None and abs(stated - general) > SAME * general:
            notes.append(f"the file states {stated:.9g} Hz; the times were taken")
    rates = [_known(column, column.sampling_rate or general) for column in columns]
    own = sorted({column.sampling_rate for column in columns if column.sampling_rate})
    return rates, [*notes, *(f"sampling rate {rate:.9g} Hz from the file" for rate in own)]


def _from_times(time: Column, columns: tuple[Column, ...]) -> tuple[float, list[str]]:
    for column in columns:
        if column.values.size != time.values.size and column.sampling_rate is None:
            raise InputError(
                f"{time.name} has {time.values.size} times, channel {column.name} {column.values.size} samples; "
                "choose channels that belong to it"
            )
    base = time_base(np.asarray(time.values, dtype=float), name=time.name, unit=time.unit)
    notes = [f"sampling rate {base.sampling_rate:.9g} Hz from column {time.name}, in {time.unit or 's'}"]
    if base.jitter > EVEN:
        notes.append(f"column {time.name} is up to {base.jitter:.2g} steps away from even times, which were taken")
    return base.sampling_rate, notes


def _disagreeing(given: float, columns: tuple[Column, ...], time: Column | None, stated: float | None) -> list[str]:
    """What the file says otherwise; times with samples missing are refused also where a rate is given."""
    rates = {column.sampling_rate for column in columns if column.sampling_rate} | ({stated} if stated else set())
    if time is not None:
        rates.add(time_base(np.asarray(time.values, dtype=float), name=time.name, unit=time.unit).sampling_rate)
    return [
        f"the file states {rate:.9g} Hz; the given {given:.9g} Hz was taken"
        for rate in sorted(rates)
        if abs(rate - given) > SAME * given
    ]


def _known(column: Column, rate: float | None) -> float:
    if rate is None:
        raise InputError(
            f"channel {column.name}: the file does not state the sampling rate; give sampling_rate, in Hz, or the "
            "column of times by time"
        )
    if not 0 < rate <= HIGHEST:
        raise InputError(f"channel {column.name}: the file states a sampling rate of {rate:.3g} Hz; give sampling_rate")
    return float(rate)
