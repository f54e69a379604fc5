"""Validation: tolerances of ISO 1328-1:2013 by hand; verification: errors follow their law and fill their class."""

import numpy as np
import pytest

from sigdb.core import InputError
from sigdb.measurement import pitch_errors, pitch_tolerances


@pytest.mark.parametrize(
    ("teeth", "module", "tolerance_class", "single", "cumulative"),
    [
        (32, 2e-3, 5, 0.064 + 0.8 + 5, 0.128 + 0.55 * 8 + 1.4 + 12),
        (25, 4e-3, 5, 0.1 + 1.6 + 5, 0.2 + 5.5 + 2.8 + 12),
        (25, 4e-3, 7, 2 * 6.7, 2 * 20.5),
        (25, 4e-3, 3, 6.7 / 2, 20.5 / 2),
    ],
)
def test_tolerances_are_those_of_the_standard(teeth, module, tolerance_class, single, cumulative):
    """Computed by hand from the two formulas, in micrometres; two classes are a factor of 2."""
    found = pitch_tolerances(teeth, module=module, tolerance_class=tolerance_class)
    assert 1e6 * found.single_pitch == pytest.approx(single)
    assert 1e6 * found.cumulative_pitch == pytest.approx(cumulative)
    assert found.runout == pytest.approx(0.9 * found.cumulative_pitch)


def test_a_helical_gear_has_a_larger_diameter():
    """60 deg would double it; at 45 deg the diameter of 25 teeth of 4 mm is 100 sqrt(2) mm."""
    found = pitch_tolerances(25, module=4e-3, tolerance_class=5, helix_angle=45.0)
    assert 1e6 * found.single_pitch == pytest.approx(6.6 + 0.1 * np.sqrt(2))


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"teeth": 4}, "teeth"),
        ({"module": 0.4e-3}, "module"),
        ({"module": 2.0}, "module"),
        ({"tolerance_class": 12}, "tolerance_class"),
        ({"teeth": 8, "module": 0.5e-3}, "diameter"),
    ],
)
def test_the_standard_is_not_extrapolated(change, name):
    values = {"teeth": 20, "module": 2e-3, "tolerance_class": 6} | change
    with pytest.raises(InputError, match=name):
        pitch_tolerances(values.pop("teeth"), **values)


@pytest.mark.parametrize("teeth", [12, 32, 80])
def test_drawn_errors_follow_their_law(teeth):
    """Orders 1 and 2 have an rms amplitude of 0.25 F_p, with the white part; the others have the white part alone."""
    stream, options = np.random.default_rng(3), {"module": 2e-3, "tolerance_class": 6}
    limits = pitch_tolerances(teeth, **options)
    errors = np.array([pitch_errors(stream, teeth, **options) for _ in range(1500)])
    np.testing.assert_allclose(errors.mean(axis=1), 0, atol=1e-18)
    power = np.mean(np.abs(np.fft.rfft(errors, axis=1)[:, 1 : (teeth + 1) // 2]) ** 2, axis=0)
    white = teeth * (0.2 * limits.single_pitch) ** 2
    slow = white + (0.25 * limits.cumulative_pitch * teeth / 2) ** 2
    np.testing.assert_allclose(power[:2], slow, rtol=0.1)
    assert power[2:].mean() == pytest.approx(white, rel=0.05)


@pytest.mark.parametrize("teeth", [12, 32, 100])
def test_a_gear_fills_its_class(teeth):
    stream, options = np.random.default_rng(4), {"module": 2e-3, "tolerance_class": 6}
    limits = pitch_tolerances(teeth, **options)
    errors = np.array([pitch_errors(stream, teeth, **options) for _ in range(800)])
    cumulative = np.ptp(errors, axis=1) / limits.cumulative_pitch
    single = np.abs(errors - np.roll(errors, 1, axis=1)).max(axis=1) / limits.single_pitch
    assert 0.75 < cumulative.mean() < 0.95
    assert 0.75 < single.mean() < 1.15
    assert 0.15 < np.mean(cumulative > 1) < 0.4
