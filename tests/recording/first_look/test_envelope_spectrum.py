"""The envelope spectrum: a bearing's knocks behind a gear, in a band that is found; shafts; bands that cannot be."""

import numpy as np
import pytest

from sigdb.core import InputError
from sigdb.recording.first_look.envelope_spectrum import envelope_spectrum
from sigdb.recording.orders import NamedOrder
from sigdb.transmission import RollingBearing

N, REVOLUTIONS = 512, 300
TURNS = np.arange(N * REVOLUTIONS) / N
BPFO = NamedOrder(name="bearing left BPFO", kind="bearing", order=3.585)


def knocks(order, resonance=180.0, seed=1):
    """Decaying bursts at a resonance, ``order`` a revolution, each a little out of place as slip makes them."""
    rng = np.random.default_rng(seed)
    x = np.zeros(TURNS.size)
    times = np.arange(0.1, REVOLUTIONS - 1, 1 / order)
    for at in times + rng.normal(0, 0.005 / order, times.size):
        i = int(np.ceil(at * N))
        t = TURNS[i : i + 60] - at
        x[i : i + 60] += np.exp(-60 * t) * np.sin(2 * np.pi * resonance * t)
    return x


def record(order):
    gear = 2 * np.cos(2 * np.pi * 20 * TURNS) + np.cos(2 * np.pi * 40 * TURNS)
    noise = np.random.default_rng(2).normal(0, 0.05, TURNS.size)
    return gear + noise + (knocks(order) if order else 0)


def test_a_bearing_that_slips_is_found_in_the_most_impulsive_band():
    found = envelope_spectrum(record(3.585 * 0.99), samples_per_rev=N, highest=256.0, orders=[BPFO])
    assert found.chosen == "kurtosis"
    assert found.band[0] <= 180 <= found.band[1]
    assert found.kurtosis > 1
    line, *others = found.lines.to_dict("records")
    assert line["stands_out"]
    assert line["order"] == pytest.approx(3.585 * 0.99, abs=0.01)
    assert line["nominal"] == 3.585
    # Its harmonics have no name.
    strong = [other["order"] / line["order"] for other in others if other["over_level"] > line["over_level"] / 4]
    assert strong[0] == pytest.approx(2, abs=0.02)
    assert strong == pytest.approx(np.round(strong), abs=0.02)


def test_lines_of_an_unknown_bearing_stand_out_without_a_name():
    found = envelope_spectrum(record(4.41), samples_per_rev=N, highest=256.0, orders=[BPFO])
    unnamed = found.lines[found.lines["kind"] == "unnamed"]
    assert unnamed["order"][unnamed["over_level"].idxmax()] == pytest.approx(4.41, abs=0.01)
    assert unnamed["stands_out"].all()
    # Orders above the band do not fold back: 14 x 4.41 is 61.74, and the band has 64 orders.
    assert not unnamed["order"].between(2, 2.4).any()


def test_noise_has_no_lines_at_the_ends_of_the_spectrum():
    """By construction one in 10 000 spectra has a line, be it next to order 0 or at the top."""
    for seed in range(20):
        x = np.random.default_rng(seed).standard_normal(100 * N)
        assert found_lines(x) == 0


def found_lines(x):
    return len(envelope_spectrum(x, samples_per_rev=N, highest=256.0).lines)


def test_without_knocks_nothing_stands_out():
    found = envelope_spectrum(record(None), samples_per_rev=N, highest=256.0, orders=[BPFO])
    assert not found.lines["stands_out"].any()
    assert abs(found.kurtosis) < 1


def test_the_amplitude_is_that_of_the_modulation():
    """(1 + 0.5 cos 2.37 a) cos 100.3 a has an envelope with a peak of 0.5 at order 2.37."""
    x = (1 + 0.5 * np.cos(2 * np.pi * 2.37 * TURNS)) * np.cos(2 * np.pi * 100.3 * TURNS)
    table = envelope_spectrum(x, samples_per_rev=N, highest=256.0, band=(80.0, 120.0)).spectrum
    peak = table.loc[table["amplitude"].idxmax()]
    assert peak["amplitude"] == pytest.approx(0.5, rel=0.02)
    assert peak["order"] == pytest.approx(2.37, abs=1 / REVOLUTIONS)


@pytest.mark.parametrize("band", [(120.0, 80.0), (10.0, 400.0), (-1.0, 50.0)])
def test_a_band_outside_the_record_is_refused(band):
    with pytest.raises(InputError, match=r"envelope_band = .* must rise within 0 to 256"):
        envelope_spectrum(record(None), samples_per_rev=N, highest=256.0, band=band)


def test_a_single_revolution_has_no_envelope_to_speak_of():
    found = envelope_spectrum(record(None)[:N], samples_per_rev=N, highest=256.0, orders=[BPFO])
    assert found.kurtosis == 0
    assert not found.lines["stands_out"].any()


def test_the_orders_of_a_bearing_are_those_of_its_published_table():
    """SKF 6205-2RS JEM of the Case Western Reserve University's bearing data centre; its ball spin is twice the BSF."""
    bearing = RollingBearing(rolling_elements=9, rolling_diameter=0.3126 * 0.0254, pitch_diameter=1.537 * 0.0254)
    published = {"FTF": 0.39828, "BPFO": 3.5848, "BPFI": 5.4152, "BSF": 4.7135 / 2}
    assert bearing.orders == pytest.approx(published, abs=3e-4)


def test_elements_that_do_not_fit_are_refused():
    with pytest.raises(InputError, match="leaves no room for 20 elements"):
        RollingBearing(rolling_elements=20, rolling_diameter=8e-3, pitch_diameter=39e-3)


def test_without_orders_there_are_no_lines():
    """A record of a few revolutions may have no order below its highest."""
    found = envelope_spectrum(record(None), samples_per_rev=N, highest=256.0, orders=[])
    assert len(found.lines[found.lines["stands_out"]]["order"]) == 0
