"""Unit: options of reading and averaging are declared once and checked once, whichever call takes them."""

import inspect

import numpy as np
import pytest

import sigdb
from sigdb.core import InputError
from sigdb.diagnosis.machine.machine_recordings import DiagnosisOptions
from sigdb.recording import (
    AveragingOptions,
    AveragingSettings,
    Channel,
    Recording,
    RecordingOptions,
    RecordingSettings,
    recorded_signature,
)

FS = 2000.0
TURNS = 20 * np.arange(8000) / FS


@pytest.fixture
def recording():
    channels = (
        Channel(name="a1", samples=np.cos(2 * np.pi * 12 * TURNS), sampling_rate=FS, unit="m/s^2"),
        Channel(name="tacho", samples=np.cos(2 * np.pi * TURNS), sampling_rate=FS),
    )
    return Recording(source="here", channels=channels, tacho="tacho")


@pytest.mark.parametrize(
    ("options", "settings"), [(AveragingOptions, AveragingSettings), (RecordingOptions, RecordingSettings)]
)
def test_keyword_arguments_are_the_fields_of_the_settings(options, settings):
    assert options.__optional_keys__ == frozenset(settings.model_fields)


def test_a_diagnosis_takes_the_options_of_both():
    named = set(inspect.signature(sigdb.diagnose).parameters)
    assert DiagnosisOptions.__optional_keys__ | named >= {
        *RecordingSettings.model_fields,
        *AveragingSettings.model_fields,
    }


def test_options_win_over_settings(recording):
    settings = AveragingSettings(teeth=12, revolutions=10, samples_per_tooth=8)
    assert recorded_signature(recording, settings).averages == 10
    found = recorded_signature(recording, settings, revolutions=5)
    assert (found.averages, len(found.tsa)) == (5, 96)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tooth": 12}, "recorded_signature: unknown key tooth; did you mean 'teeth'"),
        ({"teeth": 0}, "recorded_signature: teeth = 0 must be greater than or equal to 1"),
        ({"teeth": 12, "speed_rpm": "fast"}, "recorded_signature: speed_rpm: 'fast' is no number with a unit; a speed"),
        ({"teeth": 12, "speed_range_rpm": [100.0]}, "recorded_signature: speed_range_rpm"),
    ],
)
def test_a_wrong_option_is_named_before_any_work(recording, options, message):
    with pytest.raises(InputError, match=message):
        recorded_signature(recording, **options)


def test_a_diagnosis_names_a_wrong_option(recording):
    with pytest.raises(InputError, match="diagnose: unknown key harmonics; did you mean 'harmonic'"):
        sigdb.diagnose(recording, "nasa-spiral-bevel", harmonics=2)
    with pytest.raises(InputError, match="tacho, units: options of reading a file, and no recording is a path"):
        sigdb.diagnose(recording, "nasa-spiral-bevel", tacho="tacho", units="g")


def test_a_diagnosis_of_a_path_reads_with_the_options_of_reading(tmp_path, recording):
    columns = np.column_stack([channel.samples for channel in recording.channels])
    np.savetxt(tmp_path / "run.csv", columns, delimiter=",", header="a1,tacho", comments="", fmt="%.6f")
    with pytest.raises(InputError, match=r"run\.csv: tacho names 'mark', which is no channel"):
        sigdb.diagnose(tmp_path / "run.csv", "nasa-spiral-bevel", sampling_rate=FS, tacho="mark")
    with pytest.raises(InputError, match=r"a1 is in 'g', the simulated sensor in 'm/s'|revolutions"):
        sigdb.diagnose(
            tmp_path / "run.csv", "nasa-spiral-bevel", sampling_rate=FS, tacho="tacho", units="g", revolutions=10_000
        )
