"""Verification: what refining appends, and that it leaves what is there; stopped, it goes on to the same."""

import importlib
import shutil

import numpy as np
import pyarrow.parquet as pq
import pytest
from numpy.testing import assert_allclose

import sigdb
from sigdb.core.errors import DatabaseError, InputError
from sigdb.core.streams import specimen_stream
from sigdb.database.store.store import Store
from sigdb.dynamics import Periodic
from sigdb.measurement import index_errors
from sigdb.sweep import coverage, plan_from, refine, run
from sigdb.sweep.work.ownership import ownership_of

SWEEP_RUN = importlib.import_module("sigdb.sweep.work.run")
HEAD = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 3
specimens = 2
healthy = 10
"""
GRID = "[[sweep.grid]]\ntooth = [1, 6]\nstiffness_loss = [0.1, 0.5]\nphase_shift_deg = [-2.0, 2.0]\n"
TAIL = """
[measurement]
averages = 36
snr_db = 120.0
index_error = 1e-6

[signature]
samples_per_tooth = 32
sensors = ["pinion-vertical"]
"""
MATCH, CASES = 0.99, 12
STIFFNESS = {1: 3.0e8, 2: 1.5e8}
"""Mesh stiffness of the members of an ensemble, N/m."""


@pytest.fixture(scope="module", autouse=True)
def _cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIGDB_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def make(recipe_of, tmp_path_factory):
    def made(text):
        folder = tmp_path_factory.mktemp("refine") / "signatures"
        recipe = recipe_of(text)
        run(recipe.plan(), folder, recipe=recipe.text, jobs=1)
        return folder

    return made


@pytest.fixture(scope="module")
def recipe(recipe_of):
    return recipe_of(HEAD + GRID + TAIL)


@pytest.fixture(scope="module")
def base(make):
    return make(HEAD + GRID + TAIL)


@pytest.fixture(scope="module")
def refined(base, tmp_path_factory):
    """A refined database, and what refining told."""
    folder = shutil.copytree(base, tmp_path_factory.mktemp("refined") / "signatures")
    return folder, refine(folder, match=MATCH, cases=CASES, jobs=1)


@pytest.fixture
def copy(base, tmp_path):
    return shutil.copytree(base, tmp_path / "copy")


def content(folder):
    """All that a database says and holds, but for times and hosts."""
    files = [*folder.rglob("*.parquet"), folder / "sigdb.toml", folder / "schema.json", folder / "coverage.json"]
    return {path.relative_to(folder): path.read_bytes() for path in files if path.exists()}


def test_what_was_there_is_unchanged(base, refined):
    folder, _ = refined
    before, after = content(base), content(folder)
    for path in {*before} - {*(path for path in before if path.name == "sigdb.toml")}:
        assert after[path] == before[path]
    for receipt in (base / "receipts").iterdir():
        assert (folder / "receipts" / receipt.name).read_bytes() == receipt.read_bytes()
    one, other = sigdb.open(base).manifest, sigdb.open(folder).manifest
    assert other.plan == one.plan
    assert other.recipe == one.recipe


def test_extensions_begin_with_the_next_parts(refined):
    folder, told = refined
    database = sigdb.open(folder)
    extensions = database.manifest.extensions
    assert told.reached
    assert told.rounds == len(extensions) >= 2
    for number, extension in enumerate(extensions, start=1):
        assert (extension.first_row_part, extension.first_template_part) == (number, number)
        rows = database.cases(f"id >= {2048 * number} and id < {2048 * (number + 1)}")
        assert rows["id"].tolist() == list(range(2048 * number, 2048 * number + extension.rows))
        # Undamaged, and each appended case; each case at both teeth, with both specimens.
        templates = sorted(rows["template"].unique())
        assert templates == list(range(64 * number + 1, 64 * number + extension.templates))
        assert extension.rows == (extension.templates - 1) * 2 * 2
        assert rows.groupby("template")["tooth"].apply(set).tolist() == [{1, 6}] * len(templates)
        assert rows.groupby("template")["specimen"].apply(set).tolist() == [{0, 1}] * len(templates)
    assert told.cases == sum(extension.templates - 1 for extension in extensions)
    assert told.rows == sum(extension.rows for extension in extensions)


def test_its_counts_hold_across_the_gaps(base, refined):
    database = sigdb.open(refined[0])
    assert len(database) == database.manifest.rows == len(sigdb.open(base)) + refined[1].rows
    rows = database.cases()
    assert len(rows) == len(database)
    assert rows["id"].is_monotonic_increasing
    assert rows["id"].is_unique
    assert len(database.templates()) == database.manifest.templates
    ids = rows["id"].to_numpy()[[-1, 0, 60, 33, -2]]
    both = database.signals(ids)
    each = database.sql(f"select id, tsa from signals where id in ({', '.join(map(str, ids))})").set_index("id")["tsa"]
    assert_allclose(both["tsa"], np.stack(each[ids]), rtol=0)
    batched = np.concatenate(
        [batch["id"].to_numpy() for batch in database.batches(table="signals", columns=["id"], rows=7)]
    )
    assert batched.tolist() == rows["id"].tolist()
    for gap in (len(sigdb.open(base)), 2047, 2048 * 9):
        with pytest.raises(InputError, match=f"id {gap} is not in"):
            database.signals([0, gap])


def test_appended_rows_are_direct_simulations_of_their_cases(refined):
    """Noise is 120 dB down: a row is the simulated signal of the same gear pair with damage at its own tooth."""
    database = sigdb.open(refined[0])
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    rows = database.cases("id >= 2048 and status = 'ok'").groupby(["tooth", "specimen"]).first().reset_index()
    assert len(rows) == 4
    for row, tsa in zip(rows.to_dict("records"), database.signals(rows["id"])["tsa"], strict=True):
        damage = sigdb.Damage(
            tooth=row["tooth"], stiffness_loss=row["stiffness_loss"], phase_shift_deg=row["phase_shift_deg"]
        )
        errors = 1e-6 * index_errors(specimen_stream(3, row["specimen"]), 12, 36)
        response = sigdb.simulate(rig, damage, index_errors=errors, solver=Periodic(samples_per_tooth=32))
        y = response.signal("pinion-vertical")
        assert_allclose(tsa, y, atol=1e-5 * np.abs(y).max())


def test_appended_cases_lie_between_and_are_apart(base, refined):
    """Within the grid's ends; no two of a round match as asked, nor does one match what was there before."""
    found = sigdb.open(refined[0]).templates()
    found = found[found["tooth"] > 0]
    assert found["stiffness_loss"].between(0.1, 0.5).all()
    assert found["phase_shift_deg"].between(-2, 2).all()
    z = [unit_residual(y.astype(float)) for y in found["tsa"]]
    for at, part in enumerate(found["template"] // 64):
        if part == 0:
            continue
        for other in range(at):
            turns = np.stack([np.roll(z[other], turn) for turn in range(len(z[at]))])
            assert (turns @ z[at]).max() < MATCH + 1e-6


def unit_residual(y, teeth=12):
    c = np.fft.rfft(y)
    c[[0, 1, 2]] = 0
    c[::teeth] = 0
    z = np.fft.irfft(c, len(y))
    return z / np.linalg.norm(z)


def test_fresh_cases_match_as_asked(base, refined, tmp_path):
    """Where n random cases all match, fewer than 3 in n others do not, at 95 % confidence (the rule of three)."""
    folder, told = refined
    assert told.coverage.cases["match"].min() >= MATCH
    before, after = (
        coverage(shutil.copytree(one, tmp_path / name), cases=50, seed=99, jobs=1).cases["match"]
        for name, one in (("base", base), ("refined", folder))
    )
    assert (after < MATCH).mean() < 3 / CASES < (before < MATCH).mean()
    assert (after >= before - 1e-9).all()


def test_the_seed_moves_on_with_each_extension(refined, copy):
    """Else the study would ask for the very cases that were appended."""
    folder, told = refined
    assert told.coverage.record.details["seed"] == 3 + 1 + told.rounds
    again = coverage(shutil.copytree(folder, copy / "again"), cases=CASES, jobs=1)
    assert again.record == told.coverage.record


def schemas_of(folder):
    """The schemas of the files of a table."""
    return {pq.read_schema(path).to_string() for path in folder.iterdir()}


def test_an_extension_has_the_columns_of_the_database(refined):
    folder, _ = refined
    for kind in ("features", "signals", "templates"):
        assert len(schemas_of(folder / kind)) == 1


def test_the_threshold_is_stale_after_an_extension(refined, copy):
    folder, told = refined
    tsa = sigdb.open(folder).signals([0])["tsa"][0]
    assert sigdb.open(folder).match(tsa).threshold == told.coverage.record.threshold
    coverage(copy, cases=4, jobs=1)
    known = (copy / "coverage.json").read_bytes()
    assert sigdb.open(copy).match(tsa).outside is False
    refine(copy, match=MATCH, cases=CASES, rounds=1, jobs=1)
    (copy / "coverage.json").write_bytes(known)
    assert sigdb.open(copy).match(tsa).outside is None
    coverage(copy, cases=4, jobs=1)
    assert sigdb.open(copy).match(tsa).outside is False


def test_match_finds_appended_templates_and_the_undamaged_one_once(refined):
    database = sigdb.open(refined[0])
    row = database.cases("id >= 2048 and tooth = 6").iloc[0]
    found = database.match(database.signals([row["id"]])["tsa"][0], k=100).table
    assert found["template"][0] == row["template"]
    assert found["tooth"][0] == 6
    assert (found["tooth"] == 0).sum() == 1
    assert len(found) == len(database.templates()) - refined[1].rounds


def test_rounds_limit_what_one_call_appends_and_another_goes_on(refined, copy):
    folder, told = refined
    first = refine(copy, match=MATCH, cases=CASES, rounds=1, jobs=1)
    assert (first.reached, first.rounds) == (False, 1)
    assert len(sigdb.open(copy).manifest.extensions) == 1
    second = refine(copy, match=MATCH, cases=CASES, jobs=1)
    assert second.reached
    assert second.rounds == told.rounds - 1
    assert content(copy) == content(folder)
    third = refine(copy, match=MATCH, cases=CASES, jobs=1)
    assert (third.reached, third.rounds, third.cases, third.rows) == (True, 0, 0, 0)


def test_another_call_may_ask_for_something_else(copy):
    refine(copy, match=0.95, cases=8, rounds=1, jobs=1)
    before = {path: data for path, data in content(copy).items() if path.suffix == ".parquet"}
    told = refine(copy, match=MATCH, cases=10, rounds=1, jobs=1)
    assert told.rounds > 0
    after = content(copy)
    assert {path: after[path] for path in before} == before


@pytest.fixture
def stopped(monkeypatch):
    """Refine a database until one part of an extension is to be made, which fails."""

    def refined_until(folder, kind, part):
        maker = SWEEP_RUN._MAKERS[kind]

        def make(plan, store, number):
            if number == part:
                raise DatabaseError("the disk is full")
            return maker(plan, store, number)

        with monkeypatch.context() as patch:
            patch.setitem(SWEEP_RUN._MAKERS, kind, make)
            with pytest.raises(DatabaseError, match="the disk is full"):
                refine(folder, match=MATCH, cases=CASES, jobs=1)

    return refined_until


@pytest.mark.parametrize(("kind", "part"), [("rows", 1), ("templates", 2)])
def test_stopped_in_an_extension_it_goes_on_to_the_same(refined, copy, stopped, kind, part):
    stopped(copy, kind, part)
    assert len(sigdb.open(copy).manifest.extensions) == part
    assert refine(copy, match=MATCH, cases=CASES, jobs=1).reached
    assert content(copy) == content(refined[0])
    assert not list(copy.rglob("*.tmp"))


@pytest.mark.parametrize("kind", ["templates", "rows"])
def test_the_sweep_finishes_an_extension_that_was_begun(copy, recipe, stopped, kind):
    stopped(copy, kind, 1)
    database = sigdb.open(copy)
    extension = database.manifest.extensions[0]
    assert len(database) == database.manifest.rows - extension.rows
    with pytest.raises(DatabaseError, match="finish the sweep first"):
        coverage(copy, jobs=1)
    summary = run(recipe.plan(), copy, recipe=recipe.text, jobs=1)
    assert summary.new_rows == extension.rows
    assert summary.rows == len(sigdb.open(copy)) == database.manifest.rows


def test_an_unfinished_base_is_finished_first(base, copy):
    for name in ("rows-00000.json", "templates-00000.json"):
        (copy / "receipts" / name).unlink()
    assert refine(copy, match=MATCH, cases=2, rounds=1, jobs=1).rounds == 1
    parts = {path: data for path, data in content(base).items() if path.suffix == ".parquet"}
    found = content(copy)
    assert {path: found[path] for path in parts} == parts


def test_failed_rows_of_an_extension_are_made_again(copy, recipe, monkeypatch):
    """What fails to-day may work with the cause gone: here a simulation that is made to fail."""

    def unable(*args, **options):
        raise InputError("no")

    refine(copy, match=MATCH, cases=CASES, rounds=1, jobs=1)
    whole = content(copy)
    plans = [plan_from(one.resolved) for one in sigdb.open(copy).manifest.plans]
    for path in [*copy.glob("receipts/*-00001.json")]:
        path.unlink()
    with monkeypatch.context() as patch:
        patch.setattr("sigdb.sweep.work.templates._PreparedPoint", unable)
        summary = run(plans[0], copy, recipe=recipe.text, jobs=1)
    assert summary.failed == plans[1].rows
    assert set(sigdb.open(copy).cases("id >= 2048")["status"]) == {"no"}
    assert sigdb.open(copy).cases("id >= 2048")["status_code"].tolist() == ["not_applicable"] * plans[1].rows
    assert run(plans[0], copy, recipe=recipe.text, jobs=1, retry_failed=True).failed == 0
    assert content(copy) == whole


def test_each_case_keeps_the_teeth_and_the_measurements_of_its_grid(make):
    """Two tooth counts with teeth and averages of their own, one grid of them a table."""
    text = HEAD.replace("specimens = 2", "specimens = 1") + TAIL
    text += "[[sweep.grid]]\ntooth = [13, 2]\npinion.teeth = 13\naverages = [36, 72]\n"
    text += "stiffness_loss = [0.1, 0.5]\nphase_shift_deg = [-2.0, 2.0]\n"
    text += "[[sweep.grid]]\n[sweep.grid.table]\ntooth = [1, 12, 1]\nstiffness_loss = [0.1, 0.5, 0.1]\n"
    text += "phase_shift_deg = [-2.0, -2.0, 2.0]\naverages = [3, 6, 9]\nsnr_db = [100.0, 110.0, 120.0]\n"
    folder = make(text)
    told = refine(folder, match=MATCH, cases=20, rounds=1, jobs=1)
    rows = sigdb.open(folder).cases("id >= 2048")
    assert told.rows == len(rows)
    thirteen, twelve = (rows[rows["teeth"] == teeth] for teeth in (13, 12))
    for some, teeth, averages in ((thirteen, {2, 13}, {36, 72}), (twelve, {1, 12}, {3, 6, 9})):
        assert len(some)
        assert set(some["tooth"]) == teeth
        assert set(some["averages"]) <= averages
    assert thirteen.groupby(["template", "tooth"])["averages"].apply(sorted).map(tuple).unique().tolist() == [(36, 72)]
    assert twelve.groupby("template")["averages"].nunique().eq(1).all()
    assert twelve["snr_db"].between(100, 120).all()
    assert set(thirteen["snr_db"]) == {120.0}


def test_swept_parameters_and_geometry(make):
    """Columns that only some grids of the base have are columns of the extension, in the same order."""
    text = HEAD.replace("nasa-spiral-bevel", "spur-test-rig").replace("specimens = 2", "specimens = 1")
    text += "[[sweep.grid]]\ntooth = 1\npit_diameter = 1e-3\npits = 2\nmaterials.steel.density = 7800.0\n"
    text += "[[sweep.grid]]\ntooth = 1\ncrack_depth = [2e-4, 2e-3]\noperating.torque = [20.0, 60.0]\n"
    text += TAIL.replace("averages = 36", "averages = 48").replace('sensors = ["pinion-vertical"]', "")
    folder = make(text)
    told = refine(folder, match=0.999, cases=4, rounds=1, jobs=1)
    assert told.cases > 0
    database = sigdb.open(folder)
    rows = database.cases("id >= 2048")
    assert set(rows["materials.steel.density"]) == {7850.0}
    assert rows["crack_depth"].between(2e-4, 2e-3).all()
    assert rows["torque"].between(20, 60).all()
    assert rows["torque"].nunique() == rows["template"].nunique() == told.cases
    assert set(rows["pit_diameter"]) == {0.0}
    assert len(schemas_of(folder / "features")) == 1


def test_wrong_arguments_are_refused(base, tmp_path):
    for wrong in (0.0, 1.0, -1, float("nan")):
        with pytest.raises(InputError, match=r"match = .* must lie between 0 and 1; 0\.97 is usual"):
            refine(base, match=wrong)
    with pytest.raises(InputError, match="rounds = 0 must be 1 or more"):
        refine(base, rounds=0)
    with pytest.raises(InputError, match="is not a sigdb database"):
        refine(tmp_path / "missing")
    assert not (tmp_path / "missing").exists()


def test_nothing_between_is_refused(make):
    folder = make(HEAD + "[[sweep.grid]]\ntooth = 1\nstiffness_loss = 0.3\n" + TAIL)
    with pytest.raises(InputError, match="nothing lies between the cases"):
        refine(folder, jobs=1)
    assert not sigdb.open(folder).manifest.extensions


def test_a_second_refinement_at_the_same_time_is_refused(copy):
    with ownership_of(Store.at(copy)), pytest.raises(DatabaseError, match="a sweep is already running on it"):
        refine(copy, jobs=1)


def test_a_database_of_another_version_is_refused(copy, monkeypatch):
    monkeypatch.setattr(importlib.import_module("sigdb.sweep.work.describe_database"), "__version__", "99.0")
    with pytest.raises(InputError, match=r"was begun with sigdb .*, this is 99\.0, whose rows may differ"):
        refine(copy, jobs=1)


def test_cases_of_an_ensemble_are_of_its_members(make):
    """Each appended case is of a member, and its signature is that of the member's rig."""
    grid = "[[sweep.grid]]\ntooth = 1\nstiffness_loss = [0.1, 0.5]\n"
    values = ", ".join(f'{{ "meshes.main.stiffness" = {k} }}' for k in STIFFNESS.values())
    folder = make(f"{HEAD}\n[sweep.ensemble]\nmembers = 2\nvalues = [{values}]\n{grid}{TAIL}")
    refine(folder, match=0.999, cases=8, rounds=1, jobs=1)
    found = sigdb.open(folder).templates()
    appended = found[(found["template"] >= 64) & (found["tooth"] == 1)]
    assert set(appended["rig_member"]) == {1, 2}
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    for _, row in appended.drop_duplicates("rig_member").iterrows():
        member = rig.with_assumed({"meshes.main.stiffness": STIFFNESS[row["rig_member"]]})
        damage = sigdb.Damage(tooth=1, stiffness_loss=row["stiffness_loss"])
        y = sigdb.simulate(member, damage, solver=Periodic(samples_per_tooth=32)).signal("pinion-vertical")
        assert_allclose(row["tsa"], y, atol=1e-5 * np.abs(y).max())
