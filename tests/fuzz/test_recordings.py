"""Verification: some hundred cases of the fuzzer hold, and each kind of wrong reading is a fault of it."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sigdb.core import InputError
from sigdb.recording import Channel, Recording, read_recording

FUZZER = Path(__file__).with_name("fuzz.py")


def fuzz(*arguments):
    return subprocess.run(
        [sys.executable, FUZZER, "--kind", "recordings", *arguments],
        capture_output=True, text=True, check=False, timeout=900,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip


@pytest.fixture
def fuzzing(monkeypatch):
    """The modules of the fuzzer."""
    monkeypatch.syspath_prepend(str(FUZZER.parent))
    import cases

    return cases


@pytest.mark.parametrize(
    ("arguments", "cases"), [(["--cases", "80"], 80), (["--formats", "damage", "--cases", "800"], 120)]
)
def test_recordings_of_every_kind_hold(tmp_path, arguments, cases):
    done = fuzz(*arguments, "--seconds", "800", "--seed", "20", "--keep", str(tmp_path))
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert f"{cases} cases" in done.stdout


def test_a_crash_of_a_library_is_a_fault(tmp_path, monkeypatch):
    """The files of the case are kept."""
    (tmp_path / "sitecustomize.py").write_text(
        "import os, numpy\nfirst = numpy.random.default_rng\n"
        "def crashing(seed=None):\n    os.abort() if seed == [5, 1] else None\n    return first(seed)\n"
        "numpy.random.default_rng = crashing\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    done = fuzz("--first", "1", "--cases", "1", "--seed", "5", "--keep", str(tmp_path / "kept"))
    assert done.returncode == 1
    assert "--seed 5 --case 1 crash" in done.stdout
    assert (tmp_path / "kept/recordings-seed-5-case-1").is_dir()


def test_a_case_is_the_same_again(fuzzing, tmp_path):
    for number in (0, 5, 13):
        outcomes = []
        for folder in (tmp_path / "one", tmp_path / "two"):
            folder.mkdir(exist_ok=True)
            case = fuzzing.run_case(folder, 3, number)
            files = {path.name: path.read_bytes() for path in folder.iterdir()}
            outcomes.append((case[1], sorted(files), [files[name] for name in sorted(files) if name[-4:] == ".csv"]))
        assert outcomes[0] == outcomes[1]


@pytest.fixture
def known(fuzzing):
    """What a file holds, and the recording that is right for it."""
    choices = {key: values[0] for key, values in fuzzing.known_recordings.CHOICES.items()}
    truth = fuzzing.known_recording((1, 2), **choices)
    expected = fuzzing.known_recordings.Expected(
        names=truth.names, units=truth.units, samples=tuple(truth.samples), rate=truth.rate
    )
    channels = tuple(
        Channel(name=name, unit=unit, samples=x.copy(), sampling_rate=truth.rate)
        for name, unit, x in zip(truth.names, truth.units, truth.samples, strict=True)
    )
    return expected, Recording(source="run", channels=channels)


@pytest.mark.parametrize(
    ("wrong", "fault"),
    [
        (lambda c: [replace(c[0], unit="g"), *c[1:]], "wrong unit"),
        (lambda c: [replace(c[0], unit=""), *c[1:]], "wrong unit"),
        (lambda c: [replace(c[0], name="column1"), *c[1:]], "wrong name"),
        (lambda c: [replace(part, sampling_rate=part.sampling_rate * 1000) for part in c], "wrong rate"),
        (lambda c: [replace(part, sampling_rate=part.sampling_rate * 1.0001) for part in c], "wrong rate"),
        (lambda c: [replace(c[0], samples=c[0].samples / 10), *c[1:]], "wrong samples"),
        (lambda c: [replace(part, samples=part.samples[1:]) for part in c], "wrong samples"),
        (lambda c: [replace(c[0], start=0.001), *c[1:]], "wrong instants"),
        (lambda c: [replace(c[0], name="index", samples=np.arange(240.0)), *c], "wrong channels"),
        (lambda c: c[1:], "wrong channels"),
    ],
)
def test_wrong_readings_are_faults(fuzzing, known, wrong, fault):
    expected, recording = known
    fuzzing.outcomes.compare(expected, recording)
    with pytest.raises(fuzzing.FaultError, match=fault):
        fuzzing.outcomes.compare(expected, replace(recording, channels=tuple(wrong(list(recording.channels)))))


@pytest.mark.parametrize(
    ("raised", "fault"),
    [
        (ValueError("deep in a library"), "escaped: ValueError"),
        (InputError("two\nlines"), "message"),
        (InputError("a tab\t"), "message"),
        (InputError("x" * 2000), "message"),
        (UserWarning("of a library"), "escaped: UserWarning"),
    ],
)
def test_what_escapes_is_a_fault(fuzzing, monkeypatch, tmp_path, raised, fault):
    def reader(path, **options):
        raise raised

    monkeypatch.setattr(fuzzing.outcomes, "read_recording", reader)
    with pytest.raises(fuzzing.FaultError, match=fault):
        fuzzing.outcomes.read(tmp_path / "run.csv", {})


def _turn_for_ever():
    while True:
        pass


def test_a_slow_case_and_a_large_one_are_faults(fuzzing):
    with pytest.raises(fuzzing.FaultError, match="slow"), fuzzing.outcomes.bounded(seconds=0.05):
        _turn_for_ever()
    with pytest.raises(fuzzing.FaultError, match="memory"), fuzzing.outcomes.bounded(mib=20):
        np.ones(2**25).sum()


def test_a_fault_is_reported_with_its_number_and_its_least_choices(fuzzing, monkeypatch, tmp_path):
    """A reader that takes milliseconds for seconds, whatever else the file holds."""

    def hasty(path, **options):
        recording = read_recording(path, **options)
        factor = 0.001 if b"ms" in path.read_bytes()[:200] else 1.0
        channels = (replace(part, sampling_rate=part.sampling_rate * factor) for part in recording.channels)
        return replace(recording, channels=tuple(channels))

    monkeypatch.setattr(fuzzing.outcomes, "read_recording", hasty)
    how = fuzzing._plain("text") | {"time_unit": "ms", "separator": ";", "line_end": "\r\n"}
    _, _, fault = fuzzing._meaning_case(tmp_path, "text", how, (1, 2))
    assert fault.startswith("wrong rate: a1 has 2 Hz in place of 2000")
    least, _ = fuzzing._shrunk(tmp_path, "text", how, (1, 2), fault)
    assert fuzzing._unlike_plain("text", least) == {"time_unit": "ms"}
