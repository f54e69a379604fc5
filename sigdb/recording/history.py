"""Indicators that compare the recordings of a machine over time."""

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from sigdb.core import InputError
from sigdb.recording.signature import RecordedSignature
from sigdb.signature import na4, na4_star, nb4, nb4_star, residual_signal

_SHOWN = ("rms", "fm4", "energy_ratio")


def recorded_history(signatures: Sequence[RecordedSignature], *, baseline: int | None = None) -> pd.DataFrame:
    """Return NA4 and NB4 over the recordings of a machine.

    Parameters
    ----------
    signatures : sequence of RecordedSignature
        Signatures of the same gear and channel, oldest first, with the same number of samples per tooth.
    baseline : int, optional
        Number of first, healthy recordings that are the baseline of NA4* and NB4*; None leaves these two out.

    Returns
    -------
    pandas.DataFrame
        A row for each recording: ``source``, ``speed_rpm``, ``averages``, ``kept``, ``rms``, ``fm4``, ``energy_ratio``,
        ``na4``, ``nb4``, and with a baseline ``na4_star``, ``nb4_star``.

    Raises
    ------
    InputError
        If there are no signatures, if they are not alike, or if the baseline is empty or longer than the history.

    Notes
    -----
    Neither indicator depends on the position of tooth 1, so recordings without a tacho mark can be compared. Both grow
    with the fourth power of the level: a change of load or speed changes them as damage does.
    """
    _check_alike(signatures)
    tsa, teeth = np.array([signature.tsa for signature in signatures]), signatures[0].teeth
    residuals, scale = residual_signal(tsa, teeth=teeth), np.abs(tsa).max(axis=1)
    names = ("source", "speed_rpm", "averages", "kept")
    table = pd.DataFrame({name: [getattr(signature, name) for signature in signatures] for name in names})
    table = table.assign(**{name: [signature.indicators[name] for signature in signatures] for name in _SHOWN}).assign(
        na4=na4(residuals, scale=scale), nb4=nb4(tsa, teeth=teeth)
    )
    if baseline is None:
        return table
    return table.assign(
        na4_star=na4_star(residuals, baseline=baseline, scale=scale),
        nb4_star=nb4_star(tsa, teeth=teeth, baseline=baseline),
    )


def _check_alike(signatures: Sequence[RecordedSignature]) -> None:
    if not signatures:
        raise InputError("a history has no signatures; give at least one recording")
    properties: dict[str, Callable[[RecordedSignature], int | str]] = {
        "tooth count": lambda signature: signature.teeth,
        "channel": lambda signature: signature.channel,
        "unit": lambda signature: signature.unit,
        "count of samples": lambda signature: len(signature.tsa),
    }
    for name, value_of in properties.items():
        values = {value_of(signature): signature.source for signature in signatures}
        if len(values) > 1:
            listed = "; ".join(f"{value!r} in {source}" for value, source in values.items())
            raise InputError(f"the recordings of a history differ in their {name}: {listed}; compare like with like")
    absent = [f"{each.source}: {each.presence.reason}" for each in signatures if not each.presence.present]
    if absent:
        raise InputError(f"{'; '.join(absent)}; leave such recordings out of the history")
