"""Verification: match, residual distance and threshold are those of brute force over simulated cases; and storage."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

import sigdb
from sigdb.core.errors import DatabaseError, InputError, UnstableRigError
from sigdb.dynamics import Periodic
from sigdb.sweep import coverage, refine, run
from sigdb.sweep.density.coverage import coarseness
from sigdb.transmission import Transmission

HEAD = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 3
specimens = 3
healthy = 20
"""
TAIL = """
[measurement]
averages = 102
snr_db = 0.0
index_error = 1e-6

[signature]
samples_per_tooth = 32
sensors = ["pinion-housing-vertical", "pinion-vertical"]
"""
LOSSES = (0.1, 0.4)
RECIPE = HEAD + "[[sweep.grid]]\ntooth = [1, 6]\nstiffness_loss = [0.1, 0.4]\nphase_shift_deg = [0.0, 2.0]\n" + TAIL
CASES = [(0.1, 0.0), (0.4, 0.0), (0.1, 2.0), (0.4, 2.0)]


@pytest.fixture(scope="module")
def make(recipe_of, tmp_path_factory):
    def made(text):
        folder = tmp_path_factory.mktemp("coverage") / "signatures"
        recipe = recipe_of(text)
        run(recipe.plan(), folder, recipe=recipe.text, jobs=1)
        return folder

    return made


@pytest.fixture(scope="module", autouse=True)
def _cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIGDB_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def bare(make):
    return make(RECIPE)


@pytest.fixture(scope="module")
def studied(bare, tmp_path_factory):
    """A database with its coverage, and the study."""
    folder = shutil.copytree(bare, tmp_path_factory.mktemp("studied") / "signatures")
    return folder, coverage(folder, cases=60, jobs=1)


@pytest.fixture
def copy(studied, tmp_path):
    return shutil.copytree(studied[0], tmp_path / "copy")


def unit_residual(y, teeth=12):
    """Of unit deviation over the revolution, without mean, shaft orders 1 and 2 and mesh harmonics."""
    c = np.fft.rfft(y / y.std())
    c[[0, 1, 2]] = 0
    c[::teeth] = 0
    return np.fft.irfft(c, len(y))


def residuals(cases, sensor="pinion-housing-vertical", **rig_values):
    rig = sigdb.load_transmission("nasa-spiral-bevel").replace(rig_values)
    for loss, shift in cases:
        damage = sigdb.Damage(tooth=1, stiffness_loss=loss, phase_shift_deg=shift)
        response = sigdb.simulate(rig, damage, solver=Periodic(samples_per_tooth=32))
        yield unit_residual(response.signal(sensor), rig.gears["pinion"].teeth)


def turned(z):
    return np.stack([np.roll(z, turn) for turn in range(len(z))])


def test_match_and_residual_distance_are_those_of_brute_force(studied):
    """Against the grid's four cases and the undamaged one, simulated anew, at every turn."""
    found = studied[1].cases
    templates = [turned(z) for z in residuals(CASES)]
    some = found.iloc[[0, 7, 23, 41, 59, int(found["match"].argmin())]]
    for case, z in zip(
        some.to_dict("records"), residuals(some[["stiffness_loss", "phase_shift_deg"]].to_numpy()), strict=True
    ):
        match = max((one @ z).max() / (np.linalg.norm(one[0]) * np.linalg.norm(z)) for one in templates)
        distance = [np.sqrt(((one - z) ** 2).mean(axis=1)).min() for one in templates]
        least = min([*distance, np.sqrt((z**2).mean())])
        assert_allclose(case["match"], match, rtol=1e-5)
        assert_allclose(case["residual_distance"], least, rtol=1e-4)
        assert case["template"] == 1 + int(np.argmin(distance))


def test_separation_counts_deviations_of_the_noise(studied):
    """``residual_distance std(y) sqrt(n) / sigma``; sigma^2 is the undamaged variance over 10^(snr/10) averages."""
    case = studied[1].cases.iloc[5]
    rig = sigdb.load_transmission("nasa-spiral-bevel")

    def deviation(damage):
        return (
            sigdb.simulate(rig, damage, solver=Periodic(samples_per_tooth=32)).signal("pinion-housing-vertical").std()
        )

    y = deviation(sigdb.Damage(tooth=1, stiffness_loss=case["stiffness_loss"], phase_shift_deg=case["phase_shift_deg"]))
    sigma = deviation(None) / np.sqrt(10**0 * 102)
    assert_allclose(case["separation"], case["residual_distance"] * y * np.sqrt(12 * 32) / sigma, rtol=1e-4)


def test_cases_on_the_grid_match_wholly(make, bare, tmp_path):
    """The same seed and sample, once as the database and once as the cases off the grid."""
    ranges = "stiffness_loss = { min = 0.1, max = 0.4 }\nphase_shift_deg = { min = 0.0, max = 2.0 }\n"
    folder = make(HEAD + f"[[sweep.grid]]\ntooth = 1\n{ranges}points = 12\nmethod = 'random'\n" + TAIL)
    # The sample's ends are the grid's, its coordinates those of seed 3.
    found = coverage(folder, cases=12, seed=3, jobs=1).cases
    assert_allclose(found["match"], 1, atol=1e-6)
    assert found["template"].tolist() == list(range(1, 13))
    assert coverage(folder, cases=12, jobs=1).cases["match"].max() < 1 - 1e-6


def test_the_threshold_is_the_stated_quantile(studied, make):
    """Of damaged rows or of undamaged ones: the greater. The rows are those of the off-grid design, made again here."""
    folder, found = studied
    assert len(found.measured) == 60 * 4 + 60  # four specimens, and as many undamaged rows as cases
    database = sigdb.open(folder)
    ranges = "stiffness_loss = { min = 0.1, max = 0.4 }\nphase_shift_deg = { min = 0.0, max = 2.0 }\n"
    head = HEAD.replace("seed = 3", "seed = 4").replace("specimens = 3", "specimens = 4").replace("= 20", "= 15")
    again = sigdb.open(make(head + f"[[sweep.grid]]\ntooth = 1\n{ranges}points = 60\nmethod = 'random'\n" + TAIL))
    rows = again.cases()
    distance = pd.Series(
        [database.match(y, k=1).table["residual_distance"][0] for y in again.signals(rows["id"])["tsa"]]
    )
    # The noise is of another plan: the same law, other numbers.
    quantiles = [np.quantile(distance[some], 0.99) for some in (rows["tooth"] > 0, rows["tooth"] == 0)]
    assert_allclose(found.record.threshold, max(quantiles), rtol=0.1)
    assert np.mean(found.measured > found.record.threshold) <= 0.01


def test_rows_of_another_seed_are_inside(studied, make):
    database = sigdb.open(studied[0])
    other = sigdb.open(make(RECIPE.replace("seed = 3", "seed = 1003")))
    for where in ("tooth > 0", "tooth = 0"):
        tsa = other.signals(other.cases(where)["id"])["tsa"]
        outside = [database.match(one, k=1).outside for one in tsa]
        assert np.mean(outside) <= 0.05


def test_foreign_signals_are_outside(studied):
    database = sigdb.open(studied[0])
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    theta = 2 * np.pi * np.arange(12 * 32) / (12 * 32)
    healthy = sigdb.simulate(rig, None, solver=Periodic(samples_per_tooth=32)).signal("pinion-housing-vertical")
    assert database.match(healthy).outside is False
    assert database.match(healthy).table["tooth"][0] == 0
    # A tone of half the signal's deviation at order 17, beside the mesh's 12 and 24.
    assert database.match(healthy + 0.5 * healthy.std() * np.sqrt(2) * np.cos(17 * theta)).outside is True
    far = sigdb.simulate(
        rig, sigdb.Damage(tooth=3, stiffness_loss=0.6, damaged_teeth=4), solver=Periodic(samples_per_tooth=32)
    )
    assert database.match(far.signal("pinion-housing-vertical")).outside is True


def test_what_is_stored_is_found_again(studied):
    folder, found = studied
    stored = json.loads((folder / "coverage.json").read_text())
    assert stored["threshold"] == found.record.threshold
    assert stored["sensor"] == "pinion-housing-vertical"
    assert stored["plans"] == [sigdb.open(folder).manifest.hash]
    assert stored["details"]["match_least"] == found.cases["match"].min()
    assert stored["details"]["seed"] == 4
    tsa = sigdb.open(folder).signals([70])["tsa"][0]
    assert sigdb.open(folder).match(tsa).threshold == found.record.threshold


def test_a_threshold_is_of_one_sensor(copy):
    second = coverage(copy, cases=8, sensor="pinion-vertical", jobs=1)
    database = sigdb.open(copy)
    for sensor, expected in (("pinion-vertical", second.record.threshold), ("pinion-housing-vertical", None)):
        found = database.match(database.signals([70], sensor=sensor)["tsa"][0], sensor=sensor)
        assert found.threshold == expected
        assert (found.outside is None) == (expected is None)
    y = next(residuals(second.cases[["stiffness_loss", "phase_shift_deg"]].to_numpy()[:1], "pinion-vertical"))
    templates = [turned(z) for z in residuals(CASES, "pinion-vertical")]
    match = max((one @ y).max() / (np.linalg.norm(one[0]) * np.linalg.norm(y)) for one in templates)
    assert_allclose(second.cases["match"][0], match, rtol=1e-5)


@pytest.mark.parametrize("change", ["flip", "cut", "nonsense"])
def test_a_damaged_record_is_told(copy, change):
    path = copy / "coverage.json"
    content = path.read_bytes()
    at = content.index(b"threshold") + 15
    changed = {
        "flip": content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :],
        "cut": content[:-20],
        "nonsense": b"?",
    }
    path.write_bytes(changed[change])
    tsa = sigdb.open(copy).signals([70])["tsa"][0]
    with pytest.raises(DatabaseError, match=r"coverage\.json.*run sigdb coverage again"):
        sigdb.open(copy).match(tsa)
    coverage(copy, cases=4, jobs=1)
    assert sigdb.open(copy).match(tsa).threshold is not None


def test_two_tooth_counts(make):
    """Each count's cases are compared with templates of their own length."""
    grid = "[[sweep.grid]]\ntooth = 2\nstiffness_loss = [0.1, 0.4]\npinion.teeth = [11, 12]\naverages = 108\n"
    folder = make(HEAD + grid + TAIL)
    found = coverage(folder, cases=20, jobs=1)
    assert found.cases["teeth"].value_counts().to_dict() == {11: 10, 12: 10}
    case = found.cases[found.cases["teeth"] == 11].iloc[3]
    (z,) = residuals([(case["stiffness_loss"], 0.0)], **{"pinion.teeth": 11})
    templates = [turned(one) for one in residuals([(loss, 0.0) for loss in LOSSES], **{"pinion.teeth": 11})]
    match = max((one @ z).max() / (np.linalg.norm(one[0]) * np.linalg.norm(z)) for one in templates)
    assert_allclose(case["match"], match, rtol=1e-5)
    told = found.coarse[found.coarse["axis"] == "teeth"]
    assert told[["from", "to", "cases"]].to_numpy().tolist() == [[11, 11, 10], [12, 12, 10]]


def test_damage_that_leaves_no_residual_matches(make):
    """All teeth alike: only mesh harmonics change, as of an undamaged gear, whose residual is none either."""
    folder = make(HEAD + "[[sweep.grid]]\ntooth = 1\ndamaged_teeth = 12\nstiffness_loss = [0.1, 0.3]\n" + TAIL)
    found = coverage(folder, cases=6, jobs=1)
    assert found.cases["match"].tolist() == [1.0] * 6
    assert found.cases["residual_distance"].tolist() == [0.0] * 6


def test_grids_with_columns_of_their_own(make):
    """A parameter and a kind of damage that only a single case names have columns, but nothing between."""
    grids = "[[sweep.grid]]\ntooth = 1\nstiffness_loss = [0.1, 0.3]\n"
    grids += "[[sweep.grid]]\ntooth = 1\ncrack_depth = 1e-3\noperating.speed_rpm = 2000.0\n"
    grids += "materials.steel.density = 7800.0\n"
    tail = "[measurement]\naverages = 48\n[signature]\nsamples_per_tooth = 32\n"
    folder = make(HEAD.replace("nasa-spiral-bevel", "spur-test-rig") + grids + tail)
    found = coverage(folder, cases=6, jobs=1)
    assert set(found.cases["materials.steel.density"]) == {7850.0}
    assert set(found.cases["crack_depth"]) == {0.0}
    assert list(found.grid) == ["stiffness_loss"]


def test_where_no_turn_is_exact(make, monkeypatch):
    """Each tooth has templates of its own, and cases; a bevel pair is told that it does not turn exactly."""
    monkeypatch.setattr(Transmission, "turns_exactly", lambda rig, gear: False)
    folder = make(HEAD + "[[sweep.grid]]\ntooth = [3, 4]\nstiffness_loss = [0.1, 0.5]\n" + TAIL)
    assert sigdb.open(folder).templates()["tooth"].tolist() == [0, 3, 4, 3, 4]
    found = coverage(folder, cases=6, jobs=1).cases
    assert found["stiffness_loss"].value_counts().tolist() == [2, 2, 2]
    templates = [turned(z) for z in residuals([(0.1, 0.0), (0.5, 0.0)])]
    for case, z in zip(
        found.to_dict("records"), residuals(found[["stiffness_loss", "phase_shift_deg"]].to_numpy()), strict=True
    ):
        match = max((one @ z).max() / (np.linalg.norm(one[0]) * np.linalg.norm(z)) for one in templates)
        assert_allclose(case["match"], match, rtol=1e-5)
    told = refine(folder, match=0.999, cases=6, rounds=1, jobs=1)
    appended = sigdb.open(folder).templates().query("template >= 64")
    assert appended["tooth"].tolist() == [0] + [3, 4] * (told.cases // 2)
    assert set(sigdb.open(folder).cases("id >= 2048")["tooth"]) == {3, 4}


def test_intervals_of_the_grid():
    cases = pd.DataFrame(
        {
            "loss": [0.1, 0.15, 0.35],
            "teeth": [11, 12, 12],
            "match": [0.9, 0.8, 0.7],
            "separation": [3.0, 2.0, 1.0],
        }
    )
    values = {"loss": np.array([0.1, 0.2, 0.3, 0.4]), "teeth": np.array([11.0, 12.0])}
    found = coarseness(cases, values, {"teeth"})
    assert found.to_numpy().tolist() == [
        ["loss", 0.1, 0.2, 2, 0.8, pytest.approx(0.85), 3.0],
        ["loss", 0.3, 0.4, 1, 0.7, 0.7, 1.0],
        ["teeth", 11, 11, 1, 0.9, 0.9, 3.0],
        ["teeth", 12, 12, 2, 0.7, 0.75, 2.0],
    ]


def test_an_axis_of_many_values_is_told_in_ten_intervals():
    x = np.linspace(0.005, 0.995, 100)
    cases = pd.DataFrame({"loss": x, "match": 1 - x, "separation": x})
    found = coarseness(cases, {"loss": np.linspace(0, 1, 73)}, set())
    assert found["cases"].tolist() == [10] * 10
    assert_allclose(found["to"], np.arange(1, 11) / 10)
    assert_allclose(found["least_match"], 1 - x[9::10])


def test_an_unfinished_database_is_refused(copy):
    (copy / "receipts" / "rows-00000.json").unlink()
    with pytest.raises(DatabaseError, match=r"has 0 of 84 rows; finish the sweep first"):
        coverage(copy, jobs=1)


def test_wrong_arguments_are_refused(bare):
    with pytest.raises(
        InputError, match=r"sensor 'casing' is not stored in .*; stored: pinion-housing-vertical, pinion-vertical"
    ):
        coverage(bare, sensor="casing", jobs=1)
    with pytest.raises(InputError, match="cases = 0 must be 1 or more"):
        coverage(bare, cases=0, jobs=1)
    assert not (bare / "coverage.json").exists()


def test_a_database_without_any_result_is_refused(make, monkeypatch):
    def unstable(*args, **options):
        raise UnstableRigError("the rig is unstable")

    monkeypatch.setattr("sigdb.sweep.work.templates._PreparedPoint", unstable)
    folder = make(RECIPE)
    with pytest.raises(DatabaseError, match=r"no template has a result, .* the first one says: the rig is unstable"):
        coverage(folder, jobs=1)


def test_cases_of_which_none_can_be_measured_are_told(make):
    """Index errors of 0.1 mm take the mesh out of contact."""
    folder = make(RECIPE.replace("1e-6", "1e-4"))
    with pytest.raises(
        DatabaseError, match=r"no case between .* the first one says: with this specimen the mesh loses"
    ):
        coverage(folder, cases=4, jobs=1)
