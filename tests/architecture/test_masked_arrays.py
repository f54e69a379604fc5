"""Public functions that take arrays refuse masked values, whose numbers stand for nothing."""

import functools
import inspect

import numpy as np
import pandas as pd
import pytest

from sigdb import dynamics, measurement, recognition, signature
from sigdb.core.errors import InputError
from sigdb.database.matching.nearest import checked_average, whole_shifts
from sigdb.dynamics.excitation import checked_index_errors
from sigdb.recognition.rows.batch import Batch
from sigdb.recording import Channel, Recording, recording_from

TEETH, SAMPLES, FS = 12, 384, 384.0
SIGNAL = np.cos(TEETH * 2 * np.pi * np.arange(SAMPLES) / SAMPLES) + np.random.default_rng(0).normal(size=SAMPLES)
PULSES = np.arange(1.0, 9.0)
RECORD = np.tile(SIGNAL, 9)

REQUIRED = {
    "teeth": TEETH,
    "regular": SIGNAL,
    "x": RECORD,
    "difference": SIGNAL,
    "average": SIGNAL,
    "tsa": SIGNAL,
    "averages": np.tile(SIGNAL, (3, 1)),
    "residuals": np.tile(SIGNAL, (3, 1)),
    "baseline": 1,
    "fs": FS,
    "pulse_times": PULSES,
    "samples_per_rev": SAMPLES,
    "mesh_frequency": TEETH * 1.0,
    "bandwidth": 1.0,
    "bands": [0.0, 20.0],
}
"""Arguments of the functions on signals, by name."""


def functions_of_signals():
    """Each public function on signals by name, with the array that it takes first."""
    found = {}
    for name in signature.__all__:
        function = getattr(signature, name)
        if not inspect.isfunction(function) or name in ("mesh_bands", "mesh_pulses"):
            continue
        first, *others = inspect.signature(function).parameters.values()
        needed = {one.name: REQUIRED[one.name] for one in others if one.default is one.empty}
        found[name] = functools.partial(function, **needed), REQUIRED.get(first.name, SIGNAL)
    return found


def averaged(x=RECORD, pulses=PULSES):
    return signature.synchronous_average(x, FS, pulses, samples_per_rev=SAMPLES)


def pushed(x):
    signature.SynchronousAverager(FS, samples_per_rev=SAMPLES).push(x)


def fitted(x):
    return recognition.SignatureTransformer(teeth=TEETH).fit(np.tile(SIGNAL, (2, 1))).transform(x)


CALLS = {
    **functions_of_signals(),
    "scale": (lambda s: signature.na4(np.tile(SIGNAL, (3, 1)), scale=s), np.ones(3)),
    "wigner_ville": (signature.wigner_ville, SIGNAL),
    "record_window": (lambda w: signature.wigner_ville(SIGNAL, record_window=w), np.ones(SAMPLES)),
    "lag_window": (lambda w: signature.wigner_ville(SIGNAL, lag_window=w), np.ones(9)),
    "pulse_times": (lambda t: averaged(pulses=t), PULSES),
    "averager": (pushed, RECORD),
    "mesh_pulses": (functools.partial(signature.mesh_pulses, fs=FS, mesh_frequency=12.0, teeth=TEETH), RECORD),
    "tacho detector": (lambda x: signature.TachoDetector(FS, threshold=0.5, hysteresis=0.2).push(x), np.zeros(9)),
    "transformer": (fitted, np.tile(SIGNAL, (2, 1))),
    "match": (checked_average, SIGNAL),
    "turns": (lambda t: whole_shifts(t, 32, SAMPLES), np.ones(2)),
    "index_errors": (lambda e: checked_index_errors(e, TEETH), np.zeros(TEETH)),
    "time profile": (lambda t: dynamics.TimeProfile(t, np.ones(3)), np.arange(3.0)),
    "noise_deviation": (lambda v: measurement.noise_deviation(v, np.ones(3)), np.ones(3)),
    "channel": (lambda x: Channel(name="a", samples=x, sampling_rate=FS), SIGNAL),
    "recording": (
        lambda t: Recording(
            source="here", channels=(Channel(name="a", samples=SIGNAL, sampling_rate=FS),), pulse_times=t
        ),
        PULSES,
    ),
    "rows": (
        lambda x: Batch.from_rows(pd.DataFrame({"teeth": [TEETH], "tsa": [x]}), {"teeth", "tsa"}),
        SIGNAL,
    ),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_masked_value_is_refused(name):
    call, values = CALLS[name]
    masked = np.ma.masked_array(values, mask=np.arange(values.size).reshape(values.shape) == 1)
    with pytest.raises(InputError, match=r"has 1 masked value, and a mask is not a number; fill it, or leave it out"):
        call(masked)


@pytest.mark.parametrize("name", CALLS)
def test_a_mask_of_nothing_changes_nothing(name):
    call, values = CALLS[name]
    call(np.ma.masked_array(values))


@pytest.mark.parametrize("sequence", [list, tuple])
def test_a_masked_value_in_a_sequence_of_arrays_is_refused(sequence):
    rows = sequence([np.ma.masked_array(SIGNAL), np.ma.masked_less(SIGNAL, 0.0)])
    with pytest.raises(InputError, match=f"rms: tsa has {(SIGNAL < 0).sum()} masked values"):
        signature.rms(rows)


def test_masked_samples_of_a_recording_are_missing_and_those_of_a_sequence_are_refused():
    masked = np.ma.masked_array(RECORD, mask=np.arange(RECORD.size) == 7)
    with pytest.raises(InputError, match="data: the array has 2 masked values"):
        recording_from([masked, masked], sampling_rate=FS)
    wrong = np.ma.masked_array(np.where(masked.mask, 1e6, RECORD), mask=masked.mask)
    recording = recording_from(wrong, sampling_rate=FS)
    assert np.abs(recording.channels[0].samples).max() < 10
    assert [note.code for note in recording.notes] == [
        note.code for note in recording_from(masked, sampling_rate=FS).notes
    ]
    assert recording.notes
