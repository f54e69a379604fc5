"""Indicators that compare the recordings of a machine with one another, oldest first."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core import InputError
from sigdb.recording.signature import RecordedSignature
from sigdb.signature import na4, na4_star, nb4, nb4_star, residual_signal

_SHOWN = ("rms", "fm4", "energy_ratio")


def recorded_history(signatures: Sequence[RecordedSignature], *, baseline: int | None = None) -> pd.DataFrame:
    """NA4 and NB4 over the recordings of one machine.

    Parameters
    ----------
    signatures
        Of one gear and channel, oldest first, with one count of samples a tooth.
    baseline
        Count of first, healthy recordings that NA4* and NB4* are held against; None leaves them out.

    Returns
    -------
    pandas.DataFrame
        One row a recording: ``source``, ``speed_rpm``, ``averages``, ``kept``, ``rms``, ``fm4``, ``energy_ratio``,
        ``na4``, ``nb4``, and with a baseline ``na4_star``, ``nb4_star``.

    Raises
    ------
    InputError
        If there are no signatures, they are not alike, or the baseline has no or more recordings than there are.

    Notes
    -----
    Neither indicator depends on where tooth 1 is, so recordings without a tacho mark can be compared. Both grow with
    the fourth power of the level: a change of load or speed changes them as damage does.
    """
    _check_alike(signatures)
    tsa, teeth = np.array([one.tsa for one in signatures]), signatures[0].teeth
    residuals, scale = residual_signal(tsa, teeth=teeth), np.abs(tsa).max(axis=1)
    columns: dict[str, list[Any]] = {"source": [one.source for one in signatures]}
    columns |= {name: [getattr(one, name) for one in signatures] for name in ("speed_rpm", "averages", "kept")}
    columns |= {name: [one.indicators[name] for one in signatures] for name in _SHOWN}
    table = pd.DataFrame(columns).assign(na4=na4(residuals, scale=scale), nb4=nb4(tsa, teeth=teeth))
    if baseline is None:
        return table
    return table.assign(
        na4_star=na4_star(residuals, baseline=baseline, scale=scale),
        nb4_star=nb4_star(tsa, teeth=teeth, baseline=baseline),
    )


def _check_alike(signatures: Sequence[RecordedSignature]) -> None:
    if not signatures:
        raise InputError("a history has no signatures; give at least one recording")
    for what, of in (
        ("tooth count", lambda one: one.teeth),
        ("channel", lambda one: one.channel),
        ("unit", lambda one: one.unit),
        ("count of samples", lambda one: len(one.tsa)),
    ):
        values = {of(one): one.source for one in signatures}
        if len(values) > 1:
            listed = "; ".join(f"{value!r} in {source}" for value, source in values.items())
            raise InputError(f"the recordings of a history differ in their {what}: {listed}; compare like with like")
