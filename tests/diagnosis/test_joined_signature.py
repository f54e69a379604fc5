"""Several recordings of one machine as one average: its noise, and what it shows that no single one does."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core import InputError
from sigdb.diagnosis import diagnose
from sigdb.diagnosis.change.average_spectrum import AverageSpectrum
from sigdb.diagnosis.change.finding import find, healthy_law
from sigdb.diagnosis.change.healthy_set import HealthySet
from sigdb.diagnosis.change.level import level_change
from sigdb.diagnosis.change.location import locate
from sigdb.diagnosis.joined_signature import joined_load, joined_signature
from sigdb.recording import Channel, Recording, recorded_signature

TEETH, RATE, SPEED, TOOTH, SIZE = 24, 12_800.0, 28.0, 7, 0.4
N, GROUPS, NOISE = 1536, 24, 0.3


def vibration(passes, size):
    """A mesh with errors of its teeth, and an event in each turn of the gear, 1.1 passes after its tooth's contact."""
    trace = np.random.default_rng(TEETH).standard_normal(TEETH)[passes.astype(int) % TEETH]
    x = sum((1 + 0.1 * trace) * np.cos(2 * np.pi * h * passes + h) / h for h in (1, 2, 3, 4))
    after = (passes - (TOOTH - 1) - 1.1 + TEETH / 2) % TEETH - TEETH / 2
    return x + size * np.exp(-3 * after**2) * np.cos(3 * np.pi * after)


def recorded(seed, *, size=0.0, torque=None):
    t = np.arange(int(3 * RATE)) / RATE
    passes = TEETH * (0.3 + 0.07 * seed + SPEED * t)
    x = vibration(passes, size) + 0.3 * np.random.default_rng(seed).standard_normal(t.size)
    tacho = Channel(name="tacho", samples=1.0 * (passes / TEETH % 1 < 0.1), sampling_rate=RATE)
    channels = (Channel(name="a1", samples=x, sampling_rate=RATE, unit="m/s^2"), tacho)
    return Recording(source=f"recording {seed}", channels=channels, tacho="tacho", torque=torque)


@pytest.fixture(scope="module")
def one():
    return recorded_signature(recorded(0), teeth=TEETH)


@pytest.fixture(scope="module")
def signature_of(one):
    """The signature of a recording with noise of its own in the average."""

    def make(seed, *, size=0.0, turn=0, **facts):
        noise = NOISE * np.sqrt(GROUPS) * np.random.default_rng(seed).standard_normal((GROUPS, N))
        groups = np.roll(vibration(TEETH * np.arange(N) / N, size), turn)[None] + noise
        facts = {"source": f"recording {seed}", "noise": np.full(N // 2 + 1, NOISE)} | facts
        return replace(one, tsa=groups.mean(axis=0), groups=groups, absolute=not turn, **facts)

    return make


@pytest.fixture(scope="module")
def healthy(signature_of):
    return HealthySet.of([signature_of(seed) for seed in range(100, 104)], [None] * 4)


@pytest.fixture(scope="module")
def compared(healthy):
    """The finding of a signature by pulses alone, and the change of its levels."""
    law = healthy_law(healthy, None)

    def compare(signature):
        run = AverageSpectrum.of(signature)
        reference, turn, _ = healthy.reference(run, speed_rpm=signature.speed_rpm, torque=None)
        level = level_change(run, reference.turned(turn), healthy, speeds_rpm=(None, None), torques=(None, None))
        return find(run, reference, turn=turn, law=law, templates=None), level

    return compare


def test_each_recording_counts_with_its_revolutions(signature_of, one):
    first, second = (
        signature_of(1),
        signature_of(2, averages=2 * one.averages, scatter=2.0, noise=np.full(N // 2 + 1, 0.05)),
    )
    joined = joined_signature([first, second])
    assert joined.averages == 3 * one.averages
    mesh, expected = (np.abs(np.fft.rfft(x)[TEETH::TEETH][:4]) for x in (joined.tsa, (first.tsa + 2 * second.tsa) / 3))
    assert_allclose(mesh, expected, rtol=0.1)  # the second is turned by at most 0.02 of a tooth pass
    assert_allclose(joined.noise, np.sqrt(NOISE**2 + 4 * 0.05**2) / 3)
    assert_allclose(joined.scatter**2, (first.scatter**2 + 2 * 2.0**2) / 3)
    assert joined.groups.shape == (2 * GROUPS, N)
    assert joined.source == "recording 1, recording 2"
    assert joined_signature([first]) is first


def test_an_event_below_the_limit_of_each_recording_stands_out_of_all(signature_of, compared):
    runs = [signature_of(seed, size=SIZE) for seed in range(8)]
    single, together = [compared(run)[0] for run in runs], compared(joined_signature(runs))[0]
    assert not any(each.stands_out for each in single)
    assert together.stands_out
    assert [each.low <= TOOTH <= each.high for each in locate(together, None)] == [True]


def test_without_marks_recordings_are_turned_to_the_first(signature_of):
    """The mean of averages that begin at other angles would lose the errors of the teeth."""
    each = [
        signature_of(1, size=0.5),
        signature_of(2, size=0.5, turn=N // 3 + N // TEETH // 2),
        signature_of(3, size=0.5, turn=200),
    ]
    joined = joined_signature(each)
    assert not joined.absolute
    assert np.corrcoef(joined.tsa, each[0].tsa)[0, 1] > 0.9
    assert np.corrcoef(joined.tsa, sum(one.tsa for one in each))[0, 1] < 0.7


def test_joined_healthy_recordings_show_no_change(signature_of, compared):
    """The levels of more revolutions have less noise in them, which is no change of the machine."""
    for start in range(10, 60, 10):
        finding, level = compared(joined_signature([signature_of(start + i) for i in range(4)]))
        assert not finding.stands_out
        assert not level.changed


def test_recordings_have_one_answer(few_tries):
    runs = [recorded(seed, size=1.0, torque=20.0) for seed in (1, 2)]
    found = diagnose(runs, teeth=TEETH, healthy=recorded(10))
    assert (found.kind, found.exit_code) == ("one tooth", 1)
    assert TOOTH in found.candidates
    assert found.signature.notes[0].code == "joined-recordings"
    assert found.as_json()["teeth"][0]["tooth"] in found.candidates


def test_recordings_that_are_not_of_one_state_are_refused(signature_of):
    first = signature_of(1)
    faster, other = signature_of(2, speed_rpm=1.05 * first.speed_rpm), signature_of(3, channel="a2")
    for wrong, says in ((faster, "recordings are joined at one speed, within 2 %"), (other, "joined by one channel")):
        with pytest.raises(InputError, match=says):
            joined_signature([first, wrong])
    with pytest.raises(InputError, match="torque of the recordings is 20 to 30; recordings are joined at one load"):
        joined_load([20.0, 30.0], "torque")
    assert joined_load([20.0, 20.4], "torque") == pytest.approx(20.2)
    assert joined_load([20.0, None], "torque") is None
    with pytest.raises(InputError, match="several recordings are joined to be compared with healthy recordings"):
        diagnose([recorded(1), recorded(2)], teeth=TEETH)
    with pytest.raises(InputError, match="there is no recording for healthy recordings; give one"):
        diagnose([], teeth=TEETH)
