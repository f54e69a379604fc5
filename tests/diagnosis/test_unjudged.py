"""A recording in which the gear is not to be seen is not judged, whatever the other one holds."""

import json

import numpy as np
import pytest

import sigdb
from sigdb.recording import Channel, Recording
from sigdb.report import diagnosis_text, write_diagnosis_report

FS, SECONDS = 6400, 2
T = np.arange(SECONDS * FS) / FS


def noise(seed, slope=0):
    X = np.fft.rfft(np.random.default_rng(seed).standard_normal(T.size))
    x = np.fft.irfft(X / np.maximum(np.arange(len(X)), 1) ** (slope / 2), T.size)
    return x / x.std()


def gear(seed):
    theta = 2 * np.pi * 30 * T
    mesh = np.cos(19 * theta) + 0.6 * np.cos(38 * theta + 1) + 0.4 * np.cos(57 * theta + 2)
    return (1 + 0.3 * np.cos(theta) + 0.2 * np.cos(2 * theta)) * mesh + 0.1 * noise(seed)


def hum(seed):
    return sum(np.cos(2 * np.pi * 50 * k * T) / k for k in range(1, 30)) + 0.01 * noise(seed)


def other(seed):
    theta = 2 * np.pi * 25 * T
    return (1 + 0.3 * np.cos(theta)) * (np.cos(24 * theta) + 0.5 * np.cos(48 * theta)) + 0.1 * noise(seed)


def recording(x, source="run.csv"):
    return Recording(source=source, channels=(Channel(name="a1", samples=x, sampling_rate=FS),))


RUN, HEALTHY, BOTH = "of this recording.", "of the healthy recording.", "of this recording, nor of the healthy one."


@pytest.mark.parametrize(
    ("run", "healthy", "which"),
    [
        (noise(1), noise(2), BOTH),
        (noise(3, 1), noise(4, 1), BOTH),
        (hum(1), hum(2), BOTH),
        (other(1), other(2), BOTH),
        (noise(5), gear(1), RUN),
        (gear(1), noise(6), HEALTHY),
        (noise(7), None, RUN),
    ],
    ids=["white", "pink", "hum", "another gear", "fallen off", "healthy is noise", "no healthy"],
)
def test_noise_is_not_judged(run, healthy, which, tmp_path):
    found = sigdb.diagnose(
        recording(run),
        "spur-test-rig",
        healthy=[] if healthy is None else recording(healthy, "new.csv"),
        mesh_phase=True,
    )
    assert (found.kind, found.exit_code, found.finding, found.severity) == ("cannot be judged", 3, None, None)
    assert found.answer == f"Cannot be judged: no mesh of 19 teeth stands out {which}"
    facts = json.loads(json.dumps(found.as_json(), allow_nan=False))
    assert (facts["statistics"], facts["teeth"], facts["power"]) == (None, [], None)
    assert {note["code"] for note in facts["notes"]} == {"no-mesh"}
    named = {note["values"]["recording"] for note in facts["notes"]}
    assert named == {RUN: {"recording"}, HEALTHY: {"healthy 1"}, BOTH: {"recording", "healthy 1"}}[which]
    assert diagnosis_text(found).startswith(found.answer)
    page = write_diagnosis_report(found, tmp_path).read_text(encoding="utf-8")
    assert f'<p class="alarm"><strong>{found.answer}</strong></p>' in page
    assert "Statistics and their limits" not in page
