"""Unit: the energy method against its integrals written out here, and what a tooth's damaged geometry does to it."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import trapezoid

from sigdb.core.errors import InputError
from sigdb.transmission import Damage, ToothDamage, load_transmission
from sigdb.transmission.mesh.energy_method import SOUND, pair_curve, tooth_compliance
from sigdb.transmission.mesh.stiffness import damaged_pair_stiffness, tooth_stiffness
from sigdb.transmission.mesh.tooth_sections import chipped, crack_start, sections

MESH = load_transmission("spur-test-rig").meshes["main"]
PAIR = MESH.profile.elastic
WIDTH, MODULE = 0.016, 3.175e-3
X = np.linspace(0, PAIR.geometry.contact_ratio, 1025)
MEMBERS = pytest.mark.parametrize("member", [0, 1], ids=["driving", "driven"])
# A crack of 70 deg is through the pinion's root at 6.5 mm and through the wheel's at 7.2 mm.
SIZES = {
    "crack_depth": 7.5e-3,
    "wear_depth": 5e-4,
    "chip_height": 8e-3,
    "pit_diameter": 3.2e-3,
}
BESIDE = {"pit_diameter": {"pits": 5, "pit_depth": 2e-4}}


def damaged(name, size, **others):
    return ToothDamage(**{name: float(size)} | BESIDE.get(name, {}) | others)


def outline(form):
    """Half-thickness over height, from points of fillet and involute."""
    gamma = np.linspace(np.pi / 2, form.pressure_angle, 40001)
    rho = np.linspace(form.involute_start, form.tip_curvature, 40001)
    y, x = np.hstack([form.fillet(gamma), form.involute(rho)])
    return y, x


@MEMBERS
def test_a_tooth_is_the_cantilever_of_its_outline(member):
    """Bending, shear and compression summed over 200 000 slices between root circle and contact."""
    form, steel = PAIR.forms[member], PAIR.materials[member]
    rho = PAIR.curvatures(X)[member]
    rho = rho[:: 1 - 2 * member]
    y, half = outline(form)
    height = np.linspace(y[0], y[-1], 200001)
    half = np.interp(height, y, half)
    root, radius, body = form.half_root_angle, form.root_radius, PAIR.bores[member] / 2
    h = radius / body
    found = tooth_compliance(form, steel, WIDTH, PAIR.bores[member], rho)
    for at in (0, 512, 1024):
        beta = rho[at] / form.base_radius - form.half_base_angle
        (yc, xc), below = form.involute(rho[at]), height <= form.involute(rho[at])[0]
        moment = np.cos(beta) * (yc - height[below]) - np.sin(beta) * xc
        inertia, area = 2 / 3 * half[below] ** 3 * WIDTH, 2 * half[below] * WIDTH
        slices = moment**2 / (steel.young_modulus * inertia)
        slices += 1.2 * np.cos(beta) ** 2 / (steel.shear_modulus * area)
        slices += np.sin(beta) ** 2 / (steel.young_modulus * area)
        coefficients = {  # Sainsot et al. 2004, table 1
            "L": -5.574e-5 / root**2 - 1.9986e-3 * h**2 - 2.3015e-4 * h / root + 4.7702e-3 / root + 0.0271 * h + 6.8045,
            "M": 60.111e-5 / root**2 + 28.1e-3 * h**2 - 83.431e-4 * h / root - 9.9256e-3 / root + 0.1624 * h + 0.9086,
            "P": -50.952e-5 / root**2 + 185.5e-3 * h**2 + 0.0538e-4 * h / root + 53.3e-3 / root + 0.2895 * h + 0.9236,
            "Q": -6.2042e-5 / root**2
            + 9.0889e-3 * h**2
            - 4.0964e-4 * h / root
            + 7.8297e-3 / root
            - 0.1472 * h
            + 0.6904,
        }
        u = (yc - xc * np.tan(beta) - radius) / (2 * radius * root)  # where the force crosses the centre line
        shape = coefficients["L"] * u**2 + coefficients["M"] * u
        shape += coefficients["P"] * (1 + coefficients["Q"] * np.tan(beta) ** 2)
        foundation = np.cos(beta) ** 2 / (steel.young_modulus * WIDTH) * shape
        assert_allclose(found[at], trapezoid(slices, height[below]) + foundation, rtol=2e-5)


def test_the_points_of_the_curve_are_enough():
    """Straight lines between every second point are within 1.6e-6; those between all points within a quarter of it."""
    curve = pair_curve(PAIR)
    assert_allclose(np.interp(X[1::2], X[::2], curve[::2]), curve[1::2], rtol=2e-6)


@MEMBERS
@pytest.mark.parametrize("name", SIZES)
def test_no_size_is_healthy_and_a_small_one_nearly(name, member):
    assert_array_equal(pair_curve(PAIR, damaged(name, 0), member), pair_curve(PAIR))
    assert_allclose(pair_curve(PAIR, damaged(name, 1e-9), member), pair_curve(PAIR), rtol=1e-5)


@MEMBERS
@pytest.mark.parametrize("name", SIZES)
@given(one=st.floats(0, 1), other=st.floats(0, 1))
@settings(deadline=None, max_examples=15)
def test_loss_grows_with_size_everywhere_along_the_contact(name, member, one, other):
    less, more = (pair_curve(PAIR, damaged(name, size * SIZES[name]), member) for size in sorted((one, other)))
    tiny = 1e-9 * pair_curve(PAIR)
    assert (more <= less + tiny).all()
    assert (less <= pair_curve(PAIR) + tiny).all()
    assert (more >= 0).all()


@MEMBERS
@pytest.mark.parametrize(
    ("name", "values", "others"),
    [
        ("pits", [1, 2, 4, 8], {"pit_diameter": 2e-3, "pit_depth": 1e-4}),
        ("pit_depth", [0.0, 1e-4, 3e-4, 9e-4], {"pit_diameter": 2e-3, "pits": 6}),
        ("chip_extent", [0.0, 0.2, 0.6, 1.0], {"chip_height": 2e-3}),
    ],
)
def test_what_stands_beside_a_size_makes_it_worse(name, values, others, member):
    curves = [pair_curve(PAIR, ToothDamage(**{name: value}, **others), member) for value in values]
    for less, more in itertools.pairwise(curves):
        assert (more <= less * (1 + 1e-9)).all()
        assert more.sum() < less.sum()


@MEMBERS
@pytest.mark.parametrize("angle", [45.0, 70.0, 90.0])
def test_a_crack_through_the_root_is_a_missing_tooth(member, angle):
    """It is through where its depth across the tooth is the thickness of the section where it begins."""
    form = PAIR.forms[member]
    y, half = outline(form)
    start = crack_start(form)
    assert_allclose(np.interp(start[0], y, half), start[1], rtol=1e-6)
    through = 2 * start[1] / np.sin(np.deg2rad(angle))
    depths = np.array([0.5, 0.9, 0.99, 0.9999, 1.0001]) * through
    left = [
        pair_curve(PAIR, ToothDamage(crack_depth=depth, crack_angle_deg=angle), member).sum() / pair_curve(PAIR).sum()
        for depth in depths
    ]
    assert left[-1] == 0
    assert left[-2] < 1e-4
    assert left[2] < 0.02 < left[1] < left[0]
    gone = pair_curve(PAIR, ToothDamage(chip_height=form.tip_radius - form.root_radius), member)
    assert (gone < 1e-7 * pair_curve(PAIR)).all()


@MEMBERS
def test_a_crack_begins_where_the_fillet_stands_at_30_degrees(member):
    form = PAIR.forms[member]
    y, x = outline(form)
    at = np.argmin(np.abs(y - crack_start(form)[0]))
    assert_allclose(-(x[at + 5] - x[at - 5]) / (y[at + 5] - y[at - 5]), np.tan(np.deg2rad(30)), rtol=2e-3)


@MEMBERS
def test_a_level_crack_takes_its_depth_from_the_sections_above_it(member):
    """At 90 deg: from the start up to where the tooth is as thin, the loaded side is cut to what the crack leaves."""
    form = PAIR.forms[member]
    rho = PAIR.curvatures(X)[member][:: 1 - 2 * member]
    sound, cut = (
        sections(form, WIDTH, rho, 0.0, one) for one in (SOUND, ToothDamage(crack_depth=1e-3, crack_angle_deg=90.0))
    )
    start, half = crack_start(form)[0], sound.thickness / 2
    above = sound.height >= start
    assert_array_equal(cut.thickness[~above], sound.thickness[~above])
    assert_allclose(cut.thickness[above], (half + np.minimum(half, crack_start(form)[1] - 1e-3))[above], rtol=1e-12)


@MEMBERS
def test_below_its_beginning_a_crack_leaves_what_is_left_there(member):
    """At 45 deg and 1 mm: down to 0.71 mm below the beginning, the section there without 0.71 mm of its thickness."""
    form = PAIR.forms[member]
    rho = PAIR.curvatures(X)[member][:: 1 - 2 * member]
    sound, cut = (
        sections(form, WIDTH, rho, 0.0, one) for one in (SOUND, ToothDamage(crack_depth=1e-3, crack_angle_deg=45.0))
    )
    (y, x), drop = crack_start(form), 1e-3 / np.sqrt(2)
    beside = (sound.height < y) & (sound.height > y - drop)
    assert beside.any()
    assert_allclose(cut.thickness[beside], 2 * x - drop, rtol=1e-12)
    assert_array_equal(cut.thickness[sound.height < y - drop], sound.thickness[sound.height < y - drop])


@MEMBERS
def test_a_chip_of_the_tooths_height_takes_all_of_it_down_to_the_root(member):
    form = PAIR.forms[member]
    height, y = form.tip_radius - form.root_radius, np.linspace(form.root_radius, form.tip_radius, 50)
    assert_array_equal(chipped(form, y, ToothDamage(chip_height=height)), 1)
    assert_array_equal(chipped(form, y, ToothDamage(chip_height=1e-12 * height, chip_extent=0.4))[:-1], 0)


def test_pits_act_where_they_are():
    """Contact before a pit feels nothing of it. In it width is lost, and above it the tooth is a little softer."""
    pitted = ToothDamage(pit_diameter=1e-3, pit_depth=1e-4, pits=4, pit_place=0.5)
    ratio = pair_curve(PAIR, pitted, 0) / pair_curve(PAIR)
    form, rho = PAIR.forms[0], PAIR.curvatures(X)[0]
    along = (rho**2 - rho[512] ** 2) / (2 * form.base_radius)  # length of the involute
    assert_array_equal(ratio[along < -0.5e-3], 1)
    assert (ratio[np.abs(along) < 0.5e-3] < 1).all()
    assert (ratio[along > 0.5e-3] < 1).all()
    assert (ratio[along > 0.5e-3] > 0.999).all()
    assert abs(np.argmin(ratio) - 512) <= 2
    # At the centre the width of contact is less by the diameters: 4 of 16 mm.
    healthy, contact = 1 / pair_curve(PAIR)[512], 4 * PAIR.materials[0].contact_compliance / (np.pi * WIDTH)
    flat = pair_curve(PAIR, ToothDamage(pit_diameter=1e-3, pits=4), 0)[512]
    assert_allclose(1 / flat, healthy + contact * (16 / 12 - 1), rtol=1e-12)


@MEMBERS
@pytest.mark.parametrize("place", [-0.6, 1.6])
def test_a_pit_off_the_contact_changes_nothing(member, place):
    pitted = ToothDamage(pit_diameter=1e-3, pit_depth=1e-4, pits=4, pit_place=place)
    assert_array_equal(pair_curve(PAIR, pitted, member), pair_curve(PAIR))


def test_a_pit_is_where_its_fraction_of_the_contact_says_on_either_gear():
    for member in (0, 1):
        for place in (0.25, 0.75):
            pitted = ToothDamage(pit_diameter=4e-4, pits=10, pit_place=place)
            ratio = pair_curve(PAIR, pitted, member) / pair_curve(PAIR)
            assert X[np.argmin(ratio)] / X[-1] == pytest.approx(place, abs=3e-3)


@MEMBERS
def test_pits_side_by_side_over_the_whole_width_leave_a_thinner_section(member):
    """W (t - d)^3 / 12 and W (t - d): a slot over the whole width is as if the tooth were so much thinner."""
    form = PAIR.forms[member]
    rho = PAIR.curvatures(X)[member][:: 1 - 2 * member]
    damage = ToothDamage(pit_diameter=WIDTH / 4, pits=4, pit_depth=3e-4)
    sound, cut = (sections(form, WIDTH, rho, rho[512], one) for one in (SOUND, damage))
    at = np.argmin(np.abs(sound.height - form.involute(rho[512])[0]).min(axis=1))
    thin = sound.thickness[at] - 3e-4
    assert_allclose(cut.area[at], WIDTH * thin, rtol=1e-5)
    assert_allclose(cut.inertia[at], WIDTH * thin**3 / 12, rtol=1e-5)


@MEMBERS
def test_even_wear_thins_the_flank_by_its_depth_along_the_normal(member):
    form = PAIR.forms[member]
    rho = PAIR.curvatures(X)[member][:: 1 - 2 * member]
    sound, cut = (sections(form, WIDTH, rho, 0.0, one) for one in (SOUND, ToothDamage(wear_depth=1e-5)))
    flank = sound.height > form.involute(rho[0])[0]
    y, x = (np.array(one) for one in form.involute(rho))
    lost = np.interp(sound.height[flank], y, 1e-5 * np.sqrt(1 + np.gradient(x, y) ** 2))
    assert_allclose((sound.thickness - cut.thickness)[flank], lost, rtol=1e-3)
    assert_array_equal(sound.thickness[~flank], cut.thickness[~flank])


def test_a_chip_takes_the_contact_from_the_tip_down():
    """The pinion drives, so its tip is in contact last: all of the face is gone there, none of it at first contact."""
    form = PAIR.forms[0]
    chipped = ToothDamage(chip_height=2e-3)
    ratio = pair_curve(PAIR, chipped, 0) / pair_curve(PAIR)
    y = form.involute(PAIR.curvatures(X)[0])[0]
    assert (ratio[y > form.tip_radius - 2e-3 + 0.2 * MODULE] < 1e-6).all()
    assert_array_equal(ratio[y < form.tip_radius - 2e-3 - 0.2 * MODULE], 1)
    steps = np.abs(np.diff(ratio))
    assert steps.max() < 0.1
    half = pair_curve(PAIR, ToothDamage(chip_height=2e-3, chip_extent=0.5), 0) / pair_curve(PAIR)
    assert ratio[-1] < 1e-6 < 0.5 < half[-1] < 1


def test_a_damaged_tooth_is_its_row_alone_and_joins_other_damage():
    u = np.arange(19 * 64) / 64
    crack = {"crack_depth": 2e-3}
    healthy, cracked, both, shifted = (
        tooth_stiffness(MESH, 19, u, one)
        for one in (
            {},
            {7: ToothDamage(**crack)},
            {7: ToothDamage(**crack, stiffness_loss=0.4)},
            {7: ToothDamage(**crack, phase_shift_deg=1.0)},
        )
    )
    others = np.arange(19) != 6
    assert_array_equal(cracked[others], healthy[others])
    assert (cracked[6] <= healthy[6]).all()
    assert_allclose(both[6], 0.6 * cracked[6], rtol=1e-12)
    assert_allclose(shifted[6].sum(), cracked[6].sum(), rtol=0.02)
    assert np.argmax(shifted[6]) > np.argmax(cracked[6])
    # Between the flanks the row is the pair's own curve.
    x = u - 6 - MESH.profile.flank / 2
    inside = (x > 0.1) & (x < 1.5)
    expected = np.interp(x[inside], X, pair_curve(PAIR, ToothDamage(**crack), 0))
    assert_allclose(cracked[6][inside], expected, rtol=1e-9)


def test_a_mean_stiffness_beside_the_method_scales_the_damaged_tooth_too():
    scaled = load_transmission("spur-test-rig").replace({"main.stiffness": 2 * MESH.stiffness}).meshes["main"]
    u, damage = np.arange(19 * 64) / 64, {2: ToothDamage(crack_depth=3e-3)}
    assert_allclose(tooth_stiffness(scaled, 19, u, damage), 2 * tooth_stiffness(MESH, 19, u, damage), rtol=1e-12)


def test_the_gear_is_told_by_its_teeth_or_by_name():
    """On the wheel a crack acts most at first contact, which is at its tip; on the pinion at last contact."""
    damage = {2: ToothDamage(crack_depth=3e-3)}
    for teeth, early in ((19, False), (48, True)):
        u = np.arange(teeth * 64) / 64
        ratio = (tooth_stiffness(MESH, teeth, u, damage) / tooth_stiffness(MESH, teeth, u, {}).clip(1))[1]
        assert (ratio[64 + 20] < ratio[64 + 100]) == early
    alike = load_transmission("spur-test-rig").replace({"wheel.teeth": 19, "wheel.bore": 0.03}).meshes["main"]
    u = np.arange(19 * 64) / 64
    with pytest.raises(InputError, match="both gears have 19 teeth; say with driving which of them is damaged"):
        tooth_stiffness(alike, 19, u, damage)
    # Gears alike: what one feels before the pitch point the other feels after it.
    x = np.linspace(0, alike.profile.contact_ratio, 200)
    one = damaged_pair_stiffness(alike.profile, x, damage[2], 19, driving=True)
    other = damaged_pair_stiffness(alike.profile, x[::-1], damage[2], 19, driving=False)
    assert_allclose(one, other, rtol=1e-6, atol=1e-9)
    assert one[50] > one[-51]  # the driving tooth is touched last at its tip


def test_geometry_needs_a_profile_that_knows_it():
    nasa = load_transmission("nasa-spiral-bevel").meshes["main"]
    with pytest.raises(InputError, match=r"crack_depth = 0\.001 needs the geometry of the teeth; give the mesh a pro"):
        tooth_stiffness(nasa, 12, np.arange(12.0), {1: ToothDamage(crack_depth=1e-3)})


def test_pits_must_fit_on_the_face_width():
    with pytest.raises(InputError, match=r"pits = 9 of pit_diameter = 0\.002 do not fit in a row on the face width"):
        tooth_stiffness(MESH, 19, np.arange(19.0), {1: ToothDamage(pit_diameter=2e-3, pits=9)})


@pytest.mark.parametrize(
    ("damage", "flaws"),
    [
        (ToothDamage(), ()),
        (ToothDamage(crack_angle_deg=45.0, pits=3, pit_depth=1e-4, chip_extent=0.5), ()),
        (ToothDamage(chip_height=1e-3, chip_extent=0.0), ()),
        (ToothDamage(chip_height=1e-3, wear_depth=1e-6), ("wear_depth", "chip_height")),
        (ToothDamage(pit_diameter=1e-3, stiffness_loss=0.1), ("pit_diameter",)),
    ],
)
def test_what_counts_as_damage_of_the_geometry(damage, flaws):
    assert damage.flaws == flaws
    assert damage.is_damage == bool(flaws)


def test_a_pattern_may_hold_damage_of_the_geometry():
    cracked, pitted = ToothDamage(crack_depth=1e-3), ToothDamage(pit_diameter=1e-3)
    assert Damage(tooth=19, each=[cracked, pitted]).on_teeth(19) == {19: cracked, 1: pitted}
    with pytest.raises(InputError, match=r"leave out .*crack_depth"):
        Damage(tooth=1, each=[cracked], crack_depth=1e-3)
    assert cracked.model_dump() == ToothDamage().model_dump() | {"crack_depth": 1e-3}
