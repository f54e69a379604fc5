"""Levels behind an unknown path: any smooth path and any gain leave the comparison as it is."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import sigdb
from sigdb.core import InputError
from sigdb.identification import Targets
from sigdb.signature import order_spectrum

SENSOR, TEETH = "pinion-vertical", 20
SPEEDS = (1300.0, 1500.0)


@pytest.fixture(scope="module")
def signals(rig):
    return [sigdb.simulate(rig.replace({"operating.speed_rpm": speed})).signal(SENSOR) for speed in SPEEDS]


def harmonics(signals, path):
    """Targets that a rig meets, seen through a path: a function of the frequency."""
    h = np.arange(1, 4)
    return [
        {
            "sensor": SENSOR,
            "speed_rpm": speed,
            "relative_error": 0.05,
            "amplitudes": np.abs(order_spectrum(signal)[1][h * TEETH]) * path(h * TEETH * speed / 60),
        }
        for speed, signal in zip(SPEEDS, signals, strict=True)
    ]


def misses(targets, response):
    stated = targets.quantities
    difference = targets.predicted(response) - [number.value for number in stated]
    return difference / [number.error for number in stated]


def test_a_smooth_path_does_not_count(response, signals):
    tables = harmonics(signals, lambda f: 7e3 * (f / 900) ** 1.3 * np.exp(-0.4 * np.log(f / 500) ** 2))
    assert_allclose(misses(Targets(harmonics=tables), response), 0.0, atol=1e-6)


def test_what_is_not_smooth_counts(response, signals):
    """An amplitude twice as great is 6.02 dB off, less what a path of three coefficients takes up; 5 % are 0.43 dB."""
    tables = harmonics(signals, np.ones_like)
    tables[0]["amplitudes"][1] *= 2
    frequency = np.concatenate([np.arange(1, 4) * TEETH * speed / 60 for speed in SPEEDS])
    basis = np.vander(np.log(frequency), 3)
    off = np.eye(6)[1] * 20 * np.log10(2)
    left = off - basis @ np.linalg.lstsq(basis, off, rcond=None)[0]
    expected = left / (20 / np.log(10) * 0.05)
    assert_allclose(misses(Targets(harmonics=tables), response), -expected, atol=1e-6)


def test_what_is_held_out_takes_no_part_in_its_path(response, signals):
    tables = harmonics(signals, np.ones_like)
    tables[1] = tables[1] | {"amplitudes": 10 * tables[1]["amplitudes"], "held_out": True}
    found = misses(Targets(harmonics=tables, path_degree=0), response)
    assert_allclose(found, [0, 0, 0, *[-np.log(10) / 0.05] * 3], atol=1e-6)


def test_a_run_up_counts_but_for_its_gain(response, signals):
    levels = 40 * np.std(signals, axis=1) * [1.0, np.e**0.2]
    stated = {"sensor": SENSOR, "speeds_rpm": SPEEDS, "levels": levels, "relative_error": 0.1}
    assert_allclose(misses(Targets(run_ups=[stated]), response), [1.0, -1.0], atol=1e-6)


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        (
            {"harmonics": [{"amplitudes": [1.0, 2.0, 3.0]}]},
            "3 fitted amplitudes are all taken up by a path of degree 2",
        ),
        ({"harmonics": [{"amplitudes": [1.0, 0.0]}]}, "amplitudes.1 = 0.0 must be greater than 0"),
        ({"run_ups": [{"speeds_rpm": [1e3, 2e3], "levels": [1.0, 2.0, 3.0]}]}, "3 levels for 2 speeds_rpm"),
        ({"run_ups": [{"speeds_rpm": [1e3, 2e3], "levels": [1.0, 2.0], "gear": "wheeel"}]}, "did you mean 'wheel'?"),
    ],
)
def test_a_mistake_is_a_sentence(rig, fields, sentence):
    usual = {"sensor": SENSOR, "relative_error": 0.1}
    tables = {kind: [usual | table for table in tables] for kind, tables in fields.items()}
    with pytest.raises(InputError) as refused:
        Targets(**tables).check(rig)
    assert sentence in str(refused.value)


def test_noise_counts_where_a_harmonic_is_weak():
    """5 % of an amplitude and noise of a tenth of it add up to 11.2 %; a hundredth of it adds a fiftieth."""
    table = {"sensor": SENSOR, "amplitudes": [1.0, 10.0, 10.0], "relative_error": 0.05, "error": 0.1}
    errors = [number.error for number in Targets(harmonics=[table], path_degree=1).quantities]
    assert_allclose(errors, 20 / np.log(10) * np.array([np.sqrt(0.0125), 0.05099, 0.05099]), rtol=1e-4)
