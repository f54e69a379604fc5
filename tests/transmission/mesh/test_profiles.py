"""Unit: what every kind of stiffness profile offers, and how a rig file chooses and gets it."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import trapezoid

from sigdb.core.errors import InputError
from sigdb.transmission import ToothDamage, Transmission, load_transmission
from sigdb.transmission.mesh.iso_6336 import iso_mesh_stiffness
from sigdb.transmission.mesh.stiffness import pair_stiffness, pairs_in_contact, sliding_sense, tooth_stiffness
from sigdb.transmission.parts.gears import Mesh

FILE = Path(__file__).parents[3] / "data" / "transmissions" / "spur_test_rig.toml"
OWN = re.compile(r"\[meshes\.main\.profile\]\n(.*?)\n\n", re.DOTALL)
HARMONIC = 'kind = "harmonic"\namplitudes = [0.2, 0.1]\nphases_deg = [40.0, -90.0]\n'
TABLE = 'kind = "table"\nplaces = [0, 0.5, 1.2, 1.6]\npair_stiffnesses = [1e8, 1.6e8, 1.8e8, 1.1e8]\nflank = 0.2\n'
PROFILES = {
    "trapezoid": "contact_ratio = 1.6\nflank = 0.3\n",
    "harmonic": HARMONIC,
    "table": TABLE,
    "energy-method": 'kind = "energy-method"\n',
    "iso-6336": 'kind = "iso-6336"\nflank = 0.3\n',
}
DERIVED = ["table", "energy-method", "iso-6336"]


@pytest.fixture(scope="module")
def rig_with(tmp_path_factory):
    """The spur rig with another profile, and with a mean mesh stiffness if one is given."""

    def load(profile, stiffness="", **changes):
        text = OWN.sub(f"[meshes.main.profile]\n{profile}\n\n", FILE.read_text(encoding="utf-8"), count=1)
        text = text.replace("face_width = 0.016\n", f"face_width = 0.016\n{stiffness}\n", 1)
        for old, new in changes.values():
            assert old in text
            text = text.replace(old, new)
        path = tmp_path_factory.mktemp("rig") / "rig.toml"
        path.write_text(text, encoding="utf-8")
        return load_transmission(path)

    return load


@pytest.fixture(scope="module", params=PROFILES)
def mesh(request, rig_with):
    return rig_with(PROFILES[request.param], "stiffness = 3e8").meshes["main"]


def test_the_mesh_has_its_mean_and_begins_and_ends_without_a_jump(mesh):
    x = np.linspace(-1, 4, 50001)
    pair = pair_stiffness(mesh.profile, x)
    assert_allclose(trapezoid(pair, x), 1, rtol=1e-6)
    assert_array_equal(pair[(x <= 0) | (x >= mesh.profile.contact_ratio)], 0)
    assert (pair[(x > 1e-3) & (x < mesh.profile.contact_ratio - 1e-3)] > 0).all()
    # The greatest step shrinks with the grid: there is no jump.
    steps = [np.abs(np.diff(pair[::every])).max() for every in (1, 8)]
    assert steps[0] < 0.2 * steps[1]
    u = np.arange(256) / 256
    whole = pair_stiffness(mesh.profile, pairs_in_contact(mesh.profile, u)).sum(axis=0)
    assert_allclose(whole.mean(), 1, rtol=1e-5)


def test_every_tooth_has_the_same_pair_and_the_rows_sum_to_the_mesh(mesh):
    u = np.arange(19 * 64) / 64
    rows = tooth_stiffness(mesh, 19, u, {})
    assert_allclose(rows.sum(axis=1), rows[0].sum(), rtol=1e-9)
    assert_allclose(rows.sum(axis=0).mean(), 3e8, rtol=1e-4)
    lost = tooth_stiffness(mesh, 19, u, {4: ToothDamage(stiffness_loss=0.3)})
    assert_allclose(lost[3], 0.7 * rows[3], rtol=1e-12)


def test_the_sense_of_sliding_changes_at_the_pitch_point_within_the_contact(mesh):
    assert 0.3 * mesh.profile.contact_ratio < mesh.profile.pitch_point < 0.7 * mesh.profile.contact_ratio
    at = mesh.profile.pitch_point + np.array([-0.1, 0.0, 0.1])
    assert_allclose(sliding_sense(mesh.profile, at), [-1, 0, 1], atol=1e-12)


def test_harmonics_of_the_mesh_are_those_that_are_given(rig_with):
    mesh = rig_with(HARMONIC, "stiffness = 3e8").meshes["main"]
    u = np.arange(19 * 64) / 64
    k = tooth_stiffness(mesh, 19, u, {}).sum(axis=0)
    expected = 1 + 0.2 * np.cos(2 * np.pi * u - np.deg2rad(40)) + 0.1 * np.cos(4 * np.pi * u + np.pi / 2)
    assert_allclose(k, 3e8 * expected, rtol=1e-12)


def test_damage_takes_its_share_of_the_whole_mesh_in_its_tooths_pass_of_harmonics(rig_with):
    """Within the pass, clear of the flanks, half of the mesh's stiffness; elsewhere all of it."""
    mesh = rig_with(HARMONIC + "flank = 0.2\n", "stiffness = 3e8").meshes["main"]
    u = np.arange(19 * 64) / 64
    healthy, damaged = (
        tooth_stiffness(mesh, 19, u, one).sum(axis=0) for one in ({}, {3: ToothDamage(stiffness_loss=0.5)})
    )
    assert_allclose((damaged / healthy)[(u >= 2.2) & (u <= 3.0)], 0.5, rtol=1e-12)
    assert_allclose((damaged / healthy)[(u <= 2.0) | (u >= 3.2)], 1.0, rtol=1e-12)


def test_a_table_goes_through_its_values(rig_with):
    mesh = rig_with(TABLE).meshes["main"]
    x = np.array([0.5, 1.2]) + 0.1  # half a flank before the curve begins
    assert_allclose(mesh.stiffness * pair_stiffness(mesh.profile, x), [1.6e8, 1.8e8], rtol=1e-12)
    between = mesh.stiffness * pair_stiffness(mesh.profile, np.linspace(0.6, 1.3, 100))
    assert (np.diff(between) > 0).all()
    ends = mesh.stiffness * pair_stiffness(mesh.profile, np.array([0.1, 1.7]))
    assert_allclose(ends, [0.5e8, 0.55e8], rtol=1e-12)


def test_only_the_shape_of_a_table_counts_beside_a_mean(rig_with):
    own = rig_with(TABLE).meshes["main"]
    other = rig_with(TABLE.replace("e8", "e7"), f"stiffness = {own.stiffness!r}").meshes["main"]
    x = np.linspace(0, 1.8, 100)
    assert_allclose(pair_stiffness(own.profile, x), pair_stiffness(other.profile, x), rtol=1e-12)


@pytest.mark.parametrize("name", DERIVED)
def test_a_mean_that_is_left_out_follows_from_the_profile(rig_with, name):
    derived, given = rig_with(PROFILES[name]), rig_with(PROFILES[name], "stiffness = 3e8")
    assert derived.meshes["main"].stiffness == derived.meshes["main"].profile.mean_stiffness
    assert "stiffness" not in derived.meshes["main"].model_dump()
    assert given.meshes["main"].stiffness == given.meshes["main"].model_dump()["stiffness"] == 3e8
    assert derived.value("main.stiffness") == derived.meshes["main"].stiffness
    assert Transmission.model_validate(derived.model_dump()) == derived != given
    assert derived.replace({"main.stiffness": 3e8}) == given
    again = derived.replace({"operating.speed_rpm": 900.0}).meshes["main"]
    assert again.stiffness == derived.meshes["main"].stiffness


@pytest.mark.parametrize("name", ["energy-method", "iso-6336"])
def test_the_pitch_point_by_geometry(rig_with, name):
    """Contact begins at the wheel's tip, as far before the pitch point as its radius of curvature is greater there."""
    profile = rig_with(PROFILES[name]).meshes["main"].profile
    base, tip = 48 / 2 * np.cos(np.deg2rad(20)), 48 / 2 + 1
    before = np.sqrt(tip**2 - base**2) - 48 / 2 * np.sin(np.deg2rad(20))
    expected = before / (np.pi * np.cos(np.deg2rad(20))) + profile.flank / 2
    assert_allclose(profile.pitch_point, expected, rtol=1e-12)


@pytest.mark.parametrize("name", ["energy-method", "iso-6336"])
def test_profile_shift_of_the_driving_gear_comes_with_its_opposite(rig_with, name):
    """Tips move with the shifts, by 0.2 modules out and in; the centre distance stays."""
    pair = rig_with(PROFILES[name] + "profile_shift = 0.2\n").meshes["main"].profile.pair
    assert_allclose(np.array(pair.tip_radii) / 3.175e-3, [19 / 2 + 1.2, 48 / 2 + 0.8], rtol=1e-12)


@pytest.mark.parametrize("name", ["energy-method", "iso-6336"])
def test_each_gear_may_have_a_profile_shift_of_its_own(rig_with, name):
    """The pair runs further apart, on larger pitch circles."""
    rig = rig_with(PROFILES[name] + "profile_shift = [0.3, 0.1]\n")
    mesh, pair = rig.meshes["main"], rig.meshes["main"].profile.pair
    assert pair.profile_shifts == (0.3, 0.1)
    assert pair.distance > sum(pair.pitch_radii)
    assert rig.geometries["main"].radii == pair.working_radii
    assert Transmission.model_validate(rig.model_dump()) == rig
    profile = PROFILES[name] + "profile_shift = [0.3, 0.1]\n"
    apart = rig_with(profile, f"centre_distance = {pair.distance + 1e-3}").meshes["main"]
    assert apart.profile.contact_ratio < mesh.profile.contact_ratio
    with pytest.raises(InputError, match=r"meshes.main: .*centre_distance = 0.1 is less than"):
        rig_with(profile, "centre_distance = 0.1")


def test_a_helical_pair_may_have_many_teeth_in_contact(rig_with):
    """An overlap of 7 passes and more: the mesh still has its mean, and hardly varies."""
    mesh = rig_with(PROFILES["iso-6336"], "helix_angle_deg = 30.0", width=("face_width = 0.016", "face_width = 0.16"))
    profile = mesh.meshes["main"].profile
    u = np.arange(256) / 256
    whole = pair_stiffness(profile, pairs_in_contact(profile, u)).sum(axis=0)
    assert profile.contact_ratio > 8
    assert_allclose(whole.mean(), 1, rtol=1e-9)
    assert np.ptp(whole) < 0.02
    rows = tooth_stiffness(mesh.meshes["main"], 19, np.arange(19 * 64) / 64, {}).sum(axis=0)
    assert_allclose(rows / mesh.meshes["main"].stiffness, np.tile(whole[::4], 19), rtol=1e-9)


def test_a_contact_longer_than_a_revolution_is_refused(rig_with):
    changes = {"width": ("face_width = 0.016", "face_width = 0.22"), "teeth": ("teeth = 19", "teeth = 15")}
    with pytest.raises(InputError, match=r"a contact of 14.\d+ passes .* gear 'pinion' with 15 teeth has room for; it"):
        rig_with(PROFILES["iso-6336"], "helix_angle_deg = 30.0", **changes)


@pytest.mark.parametrize("name", ["energy-method", "iso-6336"])
def test_a_profile_by_geometry_follows_the_gears(rig_with, name):
    """Contact ratio of 25/48 teeth by the radii of curvature at both tips, written out here."""
    rig = rig_with(PROFILES[name])
    other = rig.replace({"pinion.teeth": 25}).meshes["main"]
    alpha, z = np.deg2rad(20), np.array([25, 48])
    tips = np.sqrt((z / 2 + 1) ** 2 - (z / 2 * np.cos(alpha)) ** 2)
    ratio = (tips.sum() - z.sum() / 2 * np.sin(alpha)) / (np.pi * np.cos(alpha))
    assert_allclose(other.profile.contact_ratio - other.profile.flank, ratio, rtol=1e-12)
    assert other.stiffness > rig.meshes["main"].stiffness
    wider = rig.replace({"main.face_width": 0.02}).meshes["main"]
    assert_allclose(wider.stiffness, 20 / 16 * rig.meshes["main"].stiffness, rtol=1e-9)


def test_the_mean_by_the_energy_method_hardly_depends_on_the_flank(rig_with):
    """Smoothing is centred at the ends of contact: second order, 1e-3 for flanks twice as long."""
    means = [
        rig_with(PROFILES["energy-method"] + f"flank = {flank}").meshes["main"].stiffness for flank in (0.01, 0.1, 0.2)
    ]
    assert_allclose(means, means[0], rtol=2e-3)


def test_a_helical_pair_by_iso_takes_up_its_load_over_its_overlap(rig_with):
    """c_gamma in the transverse plane; along the normal it is larger by 1 / cos(beta_b)^2."""
    helical = rig_with(PROFILES["iso-6336"], "helix_angle_deg = 10.0").meshes["main"]
    overlap = 0.016 * np.sin(np.deg2rad(10)) / (np.pi * 3.175e-3 * np.cos(np.deg2rad(10)))
    pair = helical.profile.pair
    assert_allclose(pair.overlap_ratio, overlap, rtol=1e-12)
    assert_allclose(helical.profile.contact_ratio, pair.contact_ratio + overlap + 0.3, rtol=1e-12)
    top = pair_stiffness(helical.profile, np.linspace(0, helical.profile.contact_ratio, 1000)).max()
    assert_allclose(top, 1 / pair.contact_ratio, rtol=1e-4)
    base = np.arcsin(np.sin(np.deg2rad(10)) * np.cos(np.deg2rad(20)))
    transverse = iso_mesh_stiffness(pair, young_moduli=(2.068e11, 2.068e11)).mean * 0.016
    assert_allclose(helical.stiffness, transverse / np.cos(base) ** 2, rtol=1e-12)


@pytest.mark.parametrize(
    ("profile", "message"),
    [
        ("contact_ratio = 1.6\nflank = 0.3", "meshes.main: stiffness is missing; add it, or a profile that gives it"),
        (HARMONIC, "meshes.main: stiffness is missing; add it"),
        ('kind = "square"', "meshes.main.profile.kind = 'square' must be one of 'trapezoid', 'harmonic', 'table'"),
        ("kind = 3", "meshes.main.profile.kind = '3' must be one of"),
        ('kind = "energy-method"\nflanks = 0.1', "unknown key meshes.main.profile.flanks; did you mean 'flank'?"),
        ('kind = "energy-method"\nflank = 0', "meshes.main.profile.flank = 0 must be greater than 0"),
        (
            'kind = "energy-method"\nflank = 1.7',
            "meshes.main.profile: flank = 1.7 must be at most the contact, 1.646 passes",
        ),
        ('kind = "energy-method"\naddendum = 1.5', "the gear of 19 teeth would touch below their involute; lower the"),
        ('kind = "energy-method"\nprofile_shift = -0.3', "a gear of 19 teeth is undercut by its rack"),
        ('kind = "energy-method"\nmaterial = "stel"', "the material of gear 'pinion' is not known; give profile.mater"),
        ('kind = "iso-6336"\naddendum = 0.6', "ISO 6336-1 gives a mean mesh stiffness from 1.2 on"),
        ('kind = "iso-6336"\nblank_factor = 2.0', "profile.blank_factor = 2.0 must be less than or equal to 1"),
        (HARMONIC.replace("0.2", "0.99"), "amplitudes = [0.99, 0.1] take the mesh stiffness down to"),
        (HARMONIC.replace("40.0, ", ""), "phases_deg has 1 values and amplitudes 2"),
        (TABLE.replace("0, 0.5", "0.1, 0.5"), "places = [0.1, 0.5, 1.2, 1.6] must begin with 0 and ascend"),
        (TABLE.replace("0.5, 1.2", "1.2, 1.2"), "must begin with 0 and ascend"),
        (TABLE.replace("1e8, ", ""), "places has 4 values and pair_stiffnesses 3; give as many"),
        (TABLE.replace("1e8, ", "0.0, "), "pair_stiffnesses = [0.0, 160000000.0, 180000000.0, 110000000.0] must be gr"),
        (TABLE.replace("1.6]", "16.0]"), "the contact is 16 passes long; it must be 1 to 15.8"),
        ('kind = "iso-6336"\nprofile_shift = [0.1]', "meshes.main.profile.profile_shift: [0.1] has 1 values; give one"),
    ],
)
def test_a_profile_that_cannot_be_is_refused(rig_with, profile, message):
    with pytest.raises(InputError, match=re.escape(message)):
        rig_with(profile)


@pytest.mark.parametrize("kind", ["energy-method", "iso-6336"])
def test_profiles_by_geometry_are_for_parallel_shafts(kind):
    data = load_transmission("nasa-spiral-bevel").model_dump()
    data["meshes"]["main"]["profile"] = {"kind": kind}
    with pytest.raises(InputError, match=f"meshes.main.profile.kind = '{kind}' is for gears on parallel shafts"):
        Transmission(**data)


def test_the_energy_method_is_for_spur_teeth_with_a_bore(rig_with):
    with pytest.raises(InputError, match=r"helix_angle_deg = 10\.0: the energy method is for spur teeth"):
        rig_with(PROFILES["energy-method"], "helix_angle_deg = 10.0")
    for bore in ("0.0", "0.005", "0.04"):
        with pytest.raises(InputError, match=rf"bore = {bore}: the root diameter .* 0\.05239, must be 1\.4 to 7 times"):
            rig_with(PROFILES["energy-method"], bore=("bore = 0.03\n", f"bore = {bore}\n"))


def test_gears_given_by_their_mass_name_the_material_in_the_profile(rig_with):
    body = ("body_length = 0.016\n", "mass = 0.4\npolar_inertia = 3e-4\ndiametral_inertia = 2e-4\n")
    bare = ('material = "steel"\nsources.node', "sources.node")
    loose = ('sources.body_length = "derived: the face width"\n', "")
    with pytest.raises(InputError, match=r"give profile\.material, one of steel"):
        rig_with(PROFILES["energy-method"], body=body, bare=bare, loose=loose)
    named = rig_with(PROFILES["energy-method"] + 'material = "steel"\n', body=body, bare=bare, loose=loose)
    assert_allclose(named.meshes["main"].stiffness, rig_with(PROFILES["energy-method"]).meshes["main"].stiffness)


def test_a_profile_by_geometry_waits_for_its_rig():
    mesh = Mesh(
        driving="a", driven="b", module=1e-3, face_width=0.01, pressure_angle_deg=20.0, profile={"kind": "iso-6336"}
    )
    with pytest.raises(InputError, match="make the mesh part of a rig first"):
        pair_stiffness(mesh.profile, np.zeros(1))


def test_existing_files_need_no_kind_and_store_none():
    mesh = load_transmission("nasa-spiral-bevel").meshes["main"]
    assert mesh.profile.kind == "trapezoid"
    assert mesh.model_dump()["profile"].keys() - {"sources", "assumed"} == {"contact_ratio", "flank"}
