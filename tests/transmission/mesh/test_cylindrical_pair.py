"""Pairs of cylindrical gears: published pairs with profile shift, and the gap at the corner of a tip against the exact
rolling of that corner over the other flank."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core.errors import InputError
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


FZG_C = {
    "teeth": (16, 24),
    "normal_module": 4.5e-3,
    "face_width": 0.014,
    "pressure_angle_deg": 20.0,
    "profile_shifts": (0.1817, 0.1715),
}


def test_the_pair_of_the_fzg_pitting_test_has_its_published_sizes():
    """Gears of type C: centre distance 91.5 mm, working pressure angle 22.44 deg, tip diameters 82.46 and 118.36 mm,
    pitch diameters 73.2 and 109.8 mm, transverse contact ratio 1.44 (FVA information sheet 2/IV)."""
    pair = CylindricalPair(**FZG_C)
    assert_allclose(pair.distance, 0.0915, atol=5e-7)
    assert_allclose(np.rad2deg(pair.working_angles[0]), 22.44, atol=5e-3)
    assert_allclose(2e3 * np.array(pair.tip_radii), [82.46, 118.36], atol=5e-3)
    assert_allclose(2e3 * np.array(pair.working_radii), [73.2, 109.8], atol=5e-3)
    assert_allclose(pair.contact_ratio, 1.44, atol=5e-3)


def test_a_helical_pair_without_backlash_is_as_far_apart_as_published():
    """24/95 teeth, module 14 mm, 10 deg, shifts of 0.48 and 0.6691: 861 mm (the report by KISSsoft of the mesh
    stiffness)."""
    pair = CylindricalPair(
        teeth=(24, 95), normal_module=0.014, face_width=0.36, pressure_angle_deg=20.0, helix_angle_deg=10.0,
        profile_shifts=(0.48, 0.6691),
    )  # fmt: skip
    assert_allclose(pair.distance, 0.861, atol=5e-7)


@pytest.mark.parametrize("shifts", [(0.0, 0.0), (0.3, -0.3)])
def test_shifts_that_add_up_to_nothing_keep_the_reference_distance(shifts):
    pair = CylindricalPair(**FZG_C | {"profile_shifts": shifts})
    assert pair.distance == sum(pair.pitch_radii)
    assert_allclose(np.rad2deg(pair.working_angles[0]), 20.0, rtol=1e-12)


def test_teeth_that_would_jam_are_refused():
    with pytest.raises(InputError, match=r"centre_distance = 0.0914 is less than 0.09150008, at which both flanks"):
        _ = CylindricalPair(**FZG_C, centre_distance=0.0914).distance
    with pytest.raises(InputError, match="leave no pressure angle to 16 and 24 teeth; raise them"):
        _ = CylindricalPair(**FZG_C | {"profile_shifts": (-0.5, -0.5)}).distance
