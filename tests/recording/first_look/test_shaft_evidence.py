"""Verification: the envelope of noise that one shaft modulates is evidence of that shaft, and of no other."""

import numpy as np
import pytest

from sigdb.recording import shaft_evidence
from sigdb.recording.first_look.envelope_spectrum import envelope_spectrum
from sigdb.recording.orders import NamedOrder

TURNS = np.arange(150 * 128) / 128
SHAFTS = [NamedOrder(name=name, kind="shaft", order=order) for name, order in (("wheel", 0.4), ("output", 0.27))]


def table(x):
    spectrum = envelope_spectrum(x, samples_per_rev=128, highest=60.0, band=(5.0, 55.0))
    return shaft_evidence(spectrum, SHAFTS).set_index("shaft")


@pytest.mark.parametrize(("name", "order"), [("wheel", 0.4), ("output", 0.27)])
def test_a_knock_once_a_turn_of_a_shaft_is_evidence_of_it(name, order):
    knock = np.exp(-((((order * TURNS + 0.5) % 1 - 0.5) / 0.03) ** 2))
    found = table((1 + 2 * knock) * np.random.default_rng(0).standard_normal(TURNS.size))
    assert found["p_value"].idxmin() == name
    assert found.loc[name, "p_value"] < 1e-6


def test_probabilities_of_noise_are_uniform():
    """About a tenth of 200 probabilities is below 0.1, within four standard deviations of that count."""
    p = np.concatenate(
        [table(np.random.default_rng(seed).standard_normal(TURNS.size))["p_value"] for seed in range(100)]
    )
    assert abs(np.sum(p < 0.1) - 20) <= 4 * np.sqrt(200 * 0.1 * 0.9)
    assert p.min() > 1e-5


def test_whole_orders_are_no_evidence():
    """The average, which holds them, is not in the envelope."""
    spectrum = envelope_spectrum(
        np.random.default_rng(0).standard_normal(TURNS.size), samples_per_rev=128, highest=60.0, band=(5.0, 55.0)
    )
    (row,) = shaft_evidence(spectrum, [NamedOrder(name="own", kind="shaft", order=1.0)]).to_dict("records")
    assert row["lines"] == 0
    assert np.isnan(row["p_value"])
