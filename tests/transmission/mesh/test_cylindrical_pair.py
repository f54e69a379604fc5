"""Verification: the gap at the corner of a tip against the exact rolling of that corner over the other flank."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.transmission.mesh.cylindrical_pair import CylindricalPair, corner_separation


def gap(pair, way):
    """Exact gap along the line of action after last contact, where the driving tip's corner is nearest, m.

    The corner turns with the driving gear. The driven flank through it has turned by the corner's polar angle about
    the driven gear's centre and the involute's angle there; it lags behind what the ratio of the gears asks for.
    """
    (b1, b2), tip, alpha = pair.base_radii, pair.tip_radii[0], pair.pressure_angle
    last = np.array([b1 * np.cos(alpha), b1 * np.sin(alpha)])
    last = last + np.sqrt(tip**2 - b1**2) * np.array([np.sin(alpha), -np.cos(alpha)])
    turn = -np.concatenate([[0.0], way]) / b1
    x = np.cos(turn) * last[0] - np.sin(turn) * last[1] - sum(pair.pitch_radii)
    y = np.sin(turn) * last[0] + np.cos(turn) * last[1]
    pressure = np.arccos(b2 / np.hypot(x, y))
    flank = np.unwrap(np.arctan2(y, x)) - np.tan(pressure) + pressure
    return b2 * (flank - flank[0])[1:] - way


@pytest.mark.parametrize("teeth", [(19, 48), (48, 19), (30, 30)])
def test_the_gap_at_a_corner_is_that_of_the_exact_rolling(teeth):
    pair = CylindricalPair(teeth=teeth, normal_module=3.175e-3, face_width=0.016, pressure_angle_deg=20.0)
    other = CylindricalPair(teeth=teeth[::-1], normal_module=3.175e-3, face_width=0.016, pressure_angle_deg=20.0)
    way = np.array([1e-3, 4e-3]) * pair.base_pitch
    after_last, before_first = corner_separation(pair)
    assert_allclose(np.abs(gap(pair, way)), after_last * way**2, rtol=2e-2)
    # Before first contact the driven gear's corner rolls on the driving flank: the same with the gears exchanged.
    assert_allclose(before_first, corner_separation(other)[0], rtol=1e-12)
