"""Unit: pairs of cylindrical gears and the outline of their teeth, against the rack that generates them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from sigdb.core.errors import InputError
from sigdb.transmission.mesh.cylindrical_pair import CylindricalPair, Rack
from sigdb.transmission.mesh.tooth_form import ToothForm

ALPHA = np.deg2rad(20)
MODULE = 3.175e-3


def tooth(teeth, shift=0.0, rack=Rack()):  # noqa: B008
    return ToothForm(
        teeth=teeth,
        module=MODULE,
        pressure_angle=ALPHA,
        profile_shift=shift,
        tip_radius=MODULE * (teeth / 2 + 1 + shift),
        rack=rack,
    )


FORMS = [tooth(18), tooth(19), tooth(48), tooth(200), tooth(14, 0.3), tooth(30, -0.2, Rack(fillet_radius=0.25))]


@pytest.mark.parametrize("form", FORMS, ids=lambda form: f"{form.teeth}")
def test_the_fillet_joins_involute_and_root_circle_smoothly(form):
    gamma = np.linspace(ALPHA, np.pi / 2, 4001)
    y, x = form.fillet(gamma)
    (y_start, x_start) = form.involute(np.array(form.involute_start))
    assert_allclose([y[0], x[0]], [y_start, x_start], atol=1e-12)
    assert_allclose(np.hypot(y[-1], x[-1]), form.root_radius, rtol=1e-12)
    assert_allclose(np.arctan2(x[-1], y[-1]), form.half_root_angle, rtol=1e-12)
    inclination = np.arctan2(np.diff(x), -np.diff(y))
    assert_allclose(inclination, form.fillet_inclination((gamma[1:] + gamma[:-1]) / 2), atol=1e-6)
    assert_allclose(form.fillet_slope(gamma), np.gradient(y, gamma, edge_order=2), rtol=1e-4, atol=1e-7)
    assert_allclose(inclination[0], form.normal_angle(np.array(form.involute_start)), atol=1e-3)


@pytest.mark.parametrize("form", FORMS, ids=lambda form: f"{form.teeth}")
def test_the_involute_has_the_tooths_thickness_and_its_own_geometry(form):
    """On the pitch circle (pi / 2 + 2 x tan(alpha)) m; everywhere its normal touches the base circle, rho away."""
    y, x = form.involute(np.array(form.pitch_radius * np.sin(ALPHA)))
    assert_allclose(np.hypot(y, x), form.pitch_radius, rtol=1e-12)
    thickness = (np.pi / 2 + 2 * form.profile_shift * np.tan(ALPHA)) * MODULE
    assert_allclose(2 * np.arctan2(x, y) * form.pitch_radius, thickness, rtol=1e-12)
    rho = np.linspace(form.involute_start, form.tip_curvature, 50)
    (y, x), beta = form.involute(rho), form.normal_angle(rho)
    foot = np.array([y - rho * np.sin(beta), x - rho * np.cos(beta)])
    assert_allclose(np.hypot(*foot), form.base_radius, rtol=1e-12)


@pytest.mark.parametrize("form", FORMS, ids=lambda form: f"{form.teeth}")
def test_the_racks_tip_rolls_off_the_fillet(form):
    """Rolled along the pitch circle, the round tip touches each point of the fillet and cuts none of them."""
    rack, r = form.rack, form.pitch_radius
    straight = rack.dedendum - rack.fillet_radius
    across = (np.pi / 4 + straight * np.tan(ALPHA) + rack.fillet_radius / np.cos(ALPHA)) * MODULE
    depth = (straight - form.profile_shift) * MODULE
    turn = np.linspace(-0.5, 1.0, 300001)
    # The rack's tip in the gear's frame: the rack moves r * turn while the gear turns.
    along = across - r * turn
    centre = np.array(
        [(r - depth) * np.cos(turn) - along * np.sin(turn), (r - depth) * np.sin(turn) + along * np.cos(turn)]
    )
    for gamma in np.linspace(ALPHA, np.pi / 2, 7):
        distance = np.hypot(*(centre - np.array(form.fillet(np.array(gamma)))[:, None]))
        assert_allclose(distance.min(), rack.fillet_radius * MODULE, rtol=1e-6)


def test_undercut_teeth_are_refused_with_the_least_tooth_count():
    """2 (h - x) / sin(alpha)^2, h the depth of the rack's straight flank: 17.1 for a depth of one module."""
    assert tooth(18).involute_start > 0
    for shift, least in ((0.0, 18), (0.2, 14)):
        with pytest.raises(InputError, match=f"a gear of 12 teeth is undercut .* give it at least {least} teeth"):
            _ = tooth(12, shift).involute_start
        assert tooth(least, shift).involute_start >= 0


@given(z1=st.integers(18, 60), z2=st.integers(18, 120), shift=st.floats(-0.3, 0.3))
@settings(deadline=None, max_examples=40)
def test_the_path_of_contact_runs_from_tip_to_tip(z1, z2, shift):
    pair = CylindricalPair(
        teeth=(z1, z2), normal_module=MODULE, face_width=0.01, pressure_angle_deg=20.0, profile_shifts=(shift, -shift)
    )
    assert_allclose(pair.line_of_action, sum(pair.pitch_radii) * np.sin(ALPHA), rtol=1e-12)
    ends = pair.line_of_action - pair.first_contact, pair.first_contact + pair.contact_ratio * pair.base_pitch
    for rho, base, tip in zip(ends, reversed(pair.base_radii), reversed(pair.tip_radii), strict=True):
        assert_allclose(np.hypot(rho, base), tip, rtol=1e-12)
    # At the pitch point the radii of curvature are as the tooth counts.
    pitch = pair.first_contact + pair.pitch_point * pair.base_pitch
    assert_allclose(pitch / (pair.line_of_action - pitch), z1 / z2, rtol=1e-9)


def test_a_contact_ratio_below_one_is_refused():
    pair = CylindricalPair(
        teeth=(20, 20), normal_module=1e-3, face_width=0.01, pressure_angle_deg=20.0, rack=Rack(addendum=0.5)
    )
    with pytest.raises(InputError, match=r"contact ratio of 20 and 20 teeth is 0\.\d+, less than 1; raise"):
        _ = pair.contact_ratio
