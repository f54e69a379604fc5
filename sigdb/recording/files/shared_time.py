"""The time that all channels of a recording share."""

from collections.abc import Sequence

import numpy as np

from sigdb.core import FloatArray, InputError, Note
from sigdb.recording.files.missing_samples import MOST_CUT, common_part, ends
from sigdb.recording.files.sampling_rates import SeriesTiming

LEAST_SHARED = 0.5
"""Smallest share of the longest channel that is cut to the time of the others where the file states starts."""

_WHOLE = 1e-3
"""Distance from whole samples, in samples, up to which an offset is a whole number of samples."""


def share_time(
    series: Sequence[FloatArray], names: Sequence[str], timing: Sequence[SeriesTiming]
) -> tuple[list[FloatArray], list[float], list[Note]]:
    """Return the series cut to the time that all have, the time of the first sample of each in s, and notes.

    Cuts are by whole samples, so channels that begin between two samples of each other keep their different starts.

    Raises
    ------
    InputError
        If some starts are stated and others are not, or too little is shared.
    """
    starts = _starts(names, timing)
    rates = [each.sampling_rate for each in timing]
    if len(set(rates)) == 1 and np.ptp(starts) * rates[0] < _WHOLE:
        first, end = common_part(list(series), list(names))
        cut = max(x.size for x in series) - (end - first)
        text = f"cut to samples {first} to {end}, which all channels have"
        note = Note(code="cut-to-common-part", text=text, values={"first": first, "end": end})
        begin = starts[0] + first / rates[0]
        return [x[first:end] for x in series], [begin] * len(series), [note] if cut else []
    return _by_seconds(series, names, starts, rates)


def _starts(names: Sequence[str], timing: Sequence[SeriesTiming]) -> list[float]:
    """Return the start of each series, s."""
    stated = {name: each.start for name, each in zip(names, timing, strict=True) if each.start is not None}
    if len(stated) == len(names):
        return list(stated.values())
    values = list(stated.values())
    if values and np.ptp(values) * max(each.sampling_rate for each in timing) > _WHOLE:
        missing = next(name for name in names if name not in stated)
        raise InputError(
            f"channels start at different times, {min(values):.6g} to {max(values):.6g} s, and the start of {missing} "
            "is not stated; choose channels whose start is stated"
        )
    return [values[0] if values else 0.0] * len(names)


def _by_seconds(
    series: Sequence[FloatArray], names: Sequence[str], starts: list[float], rates: list[float]
) -> tuple[list[FloatArray], list[float], list[Note]]:
    bounds = [ends(x, name) for x, name in zip(series, names, strict=True)]
    begins = [start + first / fs for start, (first, _), fs in zip(starts, bounds, rates, strict=True)]
    stops = [start + end / fs for start, (_, end), fs in zip(starts, bounds, rates, strict=True)]
    begin, stop = max(begins), min(stops)
    longest = max(x.size / fs for x, fs in zip(series, rates, strict=True))
    shifted = np.ptp(starts) * max(rates) >= _WHOLE
    if stop - begin < (LEAST_SHARED if shifted else 1 - MOST_CUT) * longest:
        late, early = names[int(np.argmax(begins))], names[int(np.argmin(stops))]
        raise InputError(
            f"the channels do not cover the same time: {late} begins at {begin:.6g} s and {early} ends at {stop:.6g} "
            f"s, so {max(stop - begin, 0.0):.6g} of {longest:.6g} s are shared; choose channels that do"
        )
    cut, firsts = [], []
    for x, start, fs in zip(series, starts, rates, strict=True):
        first = max(int(np.ceil((begin - start) * fs - _WHOLE)), 0)
        end = min(int(np.ceil((stop - start) * fs - _WHOLE)), x.size)
        cut.append(x[first:end])
        at = start + first / fs
        firsts.append(begin if abs(at - begin) * fs < _WHOLE else at)
    if len(set(rates)) == 1:
        shortest = min(x.size for x in cut)
        cut = [x[:shortest] for x in cut]
    return cut, firsts, _notes(series, names, cut, firsts, rates, shifted=shifted)


def _notes(
    series: Sequence[FloatArray],
    names: Sequence[str],
    cut: list[FloatArray],
    starts: list[float],
    rates: list[float],
    *,
    shifted: bool,
) -> list[Note]:
    notes = []
    if len(set(rates)) > 1:
        text = f"channels have {len(set(rates))} sampling rates"
        notes.append(Note(code="several-sampling-rates", text=text, values={"rates": len(set(rates))}))
    changed = [name for name, x, y in zip(names, series, cut, strict=True) if y.size < x.size]
    if changed:
        begin, stop = max(starts), min(start + x.size / fs for start, x, fs in zip(starts, cut, rates, strict=True))
        why = "channels start at different times; " if shifted else ""
        text = f"{why}cut to {begin:.6g} to {stop:.6g} s, which all channels have ({', '.join(changed[:8])})"
        notes.append(Note(code="cut-to-shared-time", text=text, values={"first_s": begin, "end_s": stop}))
    apart = np.ptp(starts)
    if apart * max(rates) > _WHOLE:
        text = f"channels begin up to {apart:.3g} s apart, between two samples, which their starts state"
        notes.append(Note(code="starts-between-samples", text=text, values={"apart_s": float(apart)}))
    return notes
