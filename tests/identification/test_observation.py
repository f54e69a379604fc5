"""Observations: their numbers by simulation, their sentences, and a search for rigs in which one holds."""

import numpy as np
import pytest
from scipy.signal import hilbert

import sigdb
from sigdb.core import InputError
from sigdb.identification import Targets, identification_markdown, identify
from sigdb.identification.observation import Observation
from sigdb.signature import demodulate, kurtosis

DAMAGE = {"tooth": 6, "stiffness_loss": 0.3}
SENSOR = "pinion-vertical"


@pytest.fixture(scope="module")
def signals(rig):
    """The averages without and with damage."""
    return [sigdb.simulate(rig, damage).signal(SENSOR) for damage in (None, DAMAGE)]


def seen(response, **fields):
    return Observation(sensor=SENSOR, damage=DAMAGE, below=1.0, **fields).value(response)


def test_numbers_are_those_of_the_simulated_averages(response, signals):
    healthy, damaged = signals
    angle = np.arange(len(healthy)) * 360 / len(healthy)
    window = (angle >= 90) & (angle <= 120)
    envelopes = [np.abs(hilbert(signal - signal.mean()))[window].min() for signal in signals]
    fields = {"indicator": "envelope", "take": "least", "from_deg": 90.0, "to_deg": 120.0, "relative_to_healthy": True}
    assert seen(response, **fields) == pytest.approx(envelopes[1] / envelopes[0])
    assert seen(response, indicator="kurtosis") == pytest.approx(float(kurtosis(damaged)))
    phase = np.rad2deg(demodulate(damaged, teeth=20)[1])
    assert seen(response, indicator="phase_deg", take="greatest") == pytest.approx(phase.max())


def test_a_miss_counts_hundredths_of_the_bound():
    below = Observation(sensor=SENSOR, indicator="rms", below=0.5)
    above = Observation(sensor=SENSOR, indicator="rms", above=0.5)
    assert [below.miss(0.4), below.miss(0.55), above.miss(0.4)] == pytest.approx([0.0, 10.0, 20.0])
    assert [below.holds(number) for number in (0.4, 0.6, np.nan)] == [True, False, False]
    assert np.isinf(above.miss(np.nan))


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"indicator": "rms"}, "give below or above"),
        ({"indicator": "kurtossis", "below": 1.0}, "did you mean 'kurtosis'?"),
        ({"indicator": "rms", "below": 1.0, "to_deg": 90.0}, "is of the whole average; remove from_deg and to_deg"),
        ({"indicator": "envelope", "below": 1.0, "from_deg": 90.0, "to_deg": 9.0}, "from_deg = 90 must be less than"),
        ({"indicator": "rms", "below": 1.0, "damage": {"tooth": 21}}, "tooth 21 does not exist"),
        ({"indicator": "rms", "below": 1.0, "sensor": "casing"}, "sensor = 'casing' is no sensor of rig"),
    ],
)
def test_a_mistake_is_a_sentence(rig, fields, sentence):
    with pytest.raises(InputError, match=r"observations\.[01]") as refused:
        Targets(observations=[{"sensor": SENSOR} | fields]).check(rig)
    assert sentence in str(refused.value)


def test_a_search_ends_with_rigs_in_which_the_observation_holds(rig, tmp_path):
    """One rig in three of the ranges has so little modulation."""
    stated = {"text": "little modulation", "sensor": SENSOR, "damage": DAMAGE, "indicator": "amplitude", "below": 0.22}
    result = identify(rig, Targets(observations=[stated]), members=2, evaluations=40, seed=2, folder=tmp_path)
    assert result.meets_targets == (True, True)
    row = result.observations().loc["little modulation"]
    assert row["holds_in"] == 1.0
    assert row["high"] < 0.22
    assert "| little modulation | 0.22 |" in identification_markdown(result)
    again = identify(rig, Targets(observations=[stated]), members=2, evaluations=40, seed=2, folder=tmp_path)
    assert again.as_json() == result.as_json()
