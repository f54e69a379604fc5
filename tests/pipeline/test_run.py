"""Unit: a run makes the database, then the figures; what does not select one case is told."""

import numpy as np
import pytest

import sigdb
from sigdb.core.errors import InputError
from sigdb.pipeline import load_recipe, run_recipe
from sigdb.pipeline.recipe_figures import draw_figure, select_row
from sigdb.transmission import Damage
from sigdb.transmission.mesh.stiffness import tooth_stiffness

RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
healthy = 2
specimens = 2

[[sweep.grid]]
tooth = [3, 12]
damaged_teeth = 2
stiffness_loss = [0.2, 0.4]

[[sweep.grid]]
tooth = 5
pattern = "pitted"
operating.torque = 300.0

[[sweep.grid]]
tooth = 5
stiffness_loss = 0.5
index_error = 2e-4

[signature]
samples_per_tooth = 32

[report]
dots_per_inch = 50

[[report.figures]]
name = "both"
title = "Two losses"
rows = ["tooth = 12 and stiffness_loss = 0.2", "tooth = 12 and stiffness_loss = 0.4"]

[[report.figures]]
name = "pitted"
sensor = "pinion-housing-vertical"
caption = "With its stiffness."
rows = ["pattern = 'pitted'"]
panels = ["stiffness", "distribution"]
"""


@pytest.fixture(scope="module")
def load(tmp_path_factory):
    def of(text):
        path = tmp_path_factory.mktemp("run") / "recipe.toml"
        path.write_text(text, encoding="utf-8")
        return load_recipe(path)

    return of


@pytest.fixture(scope="module")
def recipe(load):
    return load(RECIPE)


@pytest.fixture(scope="module")
def out(recipe, tmp_path_factory):
    """What a run made: the folder, and what it said."""
    folder, said = tmp_path_factory.mktemp("out"), []
    made = run_recipe(recipe, folder, jobs=1, on_stage=said.append)
    return folder, made, said


def test_every_stage_says_what_it_made(out):
    folder, made, said = out
    assert made.database == folder / "signatures"
    assert made.summary.new_rows == len(sigdb.open(made.database)) > 0
    assert made.figures == (folder / "figures" / "both.png", folder / "figures" / "pitted.png")
    assert made.claims is None
    assert not (folder / "claims.md").exists()
    assert said[0].startswith(f"{folder / 'signatures'}: {made.summary.rows} rows from ")
    assert "made " in said[1]
    assert [line.split(":")[0] for line in said[2:]] == [str(path) for path in made.figures]


def test_figures_that_are_gone_are_drawn_again_and_nothing_else(recipe, out):
    folder, made, _ = out
    parts = {path: path.stat().st_mtime_ns for path in made.database.rglob("*.parquet")}
    for path in made.figures:
        path.unlink()
    said = []
    again = run_recipe(recipe, folder, jobs=1, on_stage=said.append)
    assert again.summary.new_rows == 0
    assert f"unchanged, all {made.summary.rows} rows are there" in said[1]
    assert said[2:] == [f"{path}: drawn" for path in made.figures]
    assert {path: path.stat().st_mtime_ns for path in made.database.rglob("*.parquet")} == parts
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in again.figures)


def test_only_a_figure_that_is_described_otherwise_is_drawn_again(recipe, load, out):
    folder, said = out[0], []
    other = load(RECIPE.replace("Two losses", "Losses"))
    run_recipe(other, folder, jobs=1, on_stage=said.append)
    both, pitted = out[1].figures
    assert said[-2:] == [f"{both}: drawn", f"{pitted}: unchanged"]
    run_recipe(load(RECIPE.replace("dots_per_inch = 50", "dots_per_inch = 60")), folder, jobs=1, on_stage=said.append)
    assert said[-2:] == [f"{both}: drawn", f"{pitted}: drawn"]


def shown(recipe, out, name, monkeypatch):
    """The cases and options with which a figure was asked for."""
    import sigdb.report

    seen = []
    original = sigdb.report.comparison_figure
    monkeypatch.setattr(
        sigdb.report,
        "comparison_figure",
        lambda cases, **options: seen.append((cases, options)) or original(cases, **options),
    )
    database = sigdb.open(out[1].database)
    (picture,) = (one for one in recipe.sections.report.figures if one.name == name)
    draw_figure(recipe, recipe.plan(), database, picture, out[0] / "again" / f"{name}.png")
    (found,) = seen
    return database, *found


def test_a_figure_shows_the_rows_that_its_conditions_select(recipe, out, monkeypatch):
    database, cases, options = shown(recipe, out, "both", monkeypatch)
    assert (options["title"], options["sensor"], options["unit"]) == ("Two losses", "pinion-vertical", "m/s")
    assert [case.title for case in cases] == [f"2 teeth from 12: stiffness loss {loss}" for loss in (0.2, 0.4)]
    for case, loss in zip(cases, (0.2, 0.4), strict=True):
        (first, *_) = database.cases(f"tooth = 12 and stiffness_loss = {loss}")["id"]
        np.testing.assert_array_equal(case.tsa, database.signals([first])["tsa"][0])
        assert case.damaged == (12, 1)
        assert case.stiffness is None
    healthy = sigdb.simulate(recipe.rig, Damage(), solver=sigdb.Periodic(samples_per_tooth=32))
    np.testing.assert_allclose(cases[0].healthy, healthy.signal("pinion-vertical"), rtol=1e-5, atol=1e-6)


def test_a_figure_shows_mesh_stiffness_and_another_sensor(recipe, out, monkeypatch):
    database, (case,), options = shown(recipe, out, "pitted", monkeypatch)
    assert (options["sensor"], options["unit"]) == ("pinion-housing-vertical", "m/s^2")
    assert (options["panels"], options["caption"]) == (("stiffness", "distribution"), "With its stiffness.")
    (row,) = database.cases("pattern = 'pitted'")["id"].head(1)
    np.testing.assert_array_equal(case.tsa, database.signals([row], sensor="pinion-housing-vertical")["tsa"][0])
    mesh, u = recipe.rig.meshes["main"], np.arange(384) / 32
    pitted = Damage.preset("pitted", teeth=12, tooth=5).on_teeth(12)
    np.testing.assert_allclose(case.stiffness, tooth_stiffness(mesh, 12, u, pitted).sum(axis=0), rtol=1e-12)
    np.testing.assert_allclose(case.healthy_stiffness, tooth_stiffness(mesh, 12, u, {}).sum(axis=0), rtol=1e-12)
    assert case.title == "tooth 5: pitted"


@pytest.mark.parametrize(
    ("condition", "says"),
    [
        ("tooth = 7", r"row 'tooth = 7' selects nothing of"),
        ("tooth = 12", r"selects 2 different cases, which differ in damage or rig \(rows \d+, \d+\); narrow it to one"),
        ("stiffness_loss = 0.2", r"selects 2 different cases, which differ in tooth"),
        ("tooth = 0", r"selects 3 different cases, which differ in index_error"),
        ("tooths = 1", r'row \'tooths = 1\': query: .*"tooths" not found'),
        ("tooth = 1; drop", r"row 'tooth = 1; drop': query"),
        ("index_error > 1e-4 and tooth = 5", r"selects row \d+, which has no result: .*contact"),
    ],
)
def test_a_condition_that_does_not_select_one_case_is_told(out, condition, says):
    with pytest.raises(InputError, match=says) as caught:
        select_row(sigdb.open(out[1].database), condition, "recipe.toml: report.figures: x")
    assert str(caught.value).startswith("recipe.toml: report.figures: x: ")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            'sensor = "pinion-housing-vertical"',
            'sensor = "wheel"',
            "report.figures: pitted: sensor 'wheel' is not stored",
        ),
        ("dots_per_inch = 50", 'paper = true\ngear = "x"', "unknown key report.gear"),
        ('name = "pitted"', 'name = "both"', "the name 'both' occurs twice"),
        ('name = "pitted"', 'name = "../pitted"', "name '../pitted' in report.figures.2.name"),
        (
            '["stiffness", "distribution"]',
            '["scalogram"]',
            "must be 'stiffness', 'signal', 'spectrum' or 'distribution'",
        ),
        ("rows = [\"pattern = 'pitted'\"]", "rows = []", "report.figures.2.rows is empty; give at least 1"),
    ],
)
def test_a_wrong_report_is_told_before_anything_is_made(load, tmp_path, old, new, says):
    assert RECIPE.count(old) == 1
    with pytest.raises(InputError) as caught:
        run_recipe(load(RECIPE.replace(old, new)), tmp_path / "out", jobs=1)
    assert says in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_the_paper_is_about_twelve_teeth(load, tmp_path):
    wheel = RECIPE.replace("[report]\n", "[report]\npaper = true\n").replace(
        "healthy = 2", 'healthy = 2\ngear = "gear"'
    )
    with pytest.raises(InputError, match=r"about the 12 teeth of a pinion, and gear 'gear' of rig .* is no gear of 12"):
        run_recipe(load(wheel.replace("tooth = 12", "tooth = 13")), tmp_path / "out", jobs=1)
    assert not (tmp_path / "out").exists()
