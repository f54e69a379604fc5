"""Recipes: each file of pipelines/ loads, plans, and has the cases that it says."""

from pathlib import Path

import pytest

import sigdb
from sigdb.core.errors import InputError
from sigdb.database import changed_parts, make_split, model_form
from sigdb.pipeline import load_recipe

PIPELINES = Path(__file__).parents[2] / "pipelines"
RECIPES = sorted(PIPELINES.glob("*.toml"))
SPLITS = ("S1", "S2", "S3", "S4")


@pytest.fixture(scope="module")
def plans():
    return {path.stem: load_recipe(path).plan() for path in RECIPES}


@pytest.fixture(scope="module")
def tables(plans):
    return {name: plan.table(0, plan.rows) for name, plan in plans.items()}


def test_these_are_the_recipes():
    assert {path.stem for path in RECIPES} >= {"quick", "paper", "teeth", "reference", "generalisation", "other-form"}


@pytest.mark.parametrize("path", RECIPES, ids=lambda path: path.stem)
def test_a_recipe_loads_and_plans(path, plans, tables):
    recipe, plan = load_recipe(path), plans[path.stem]
    assert recipe.path == path
    assert recipe.text == path.read_text(encoding="utf-8")
    assert recipe.rig.name == ("nasa-spiral-bevel-soft" if path.stem == "other-form" else "nasa-spiral-bevel")
    assert plan.rows == len(tables[path.stem]) > 0
    assert (tables[path.stem]["tooth"] == 0).any(), "healthy rows to compare with"
    # A sweep learns from folds of specimens; each recipe says which it has.
    assert tables[path.stem]["specimen"].max() + 1 == recipe.sections.sweep.specimens


def test_pipelines_hold_recipes_only():
    assert {path.suffix for path in PIPELINES.iterdir()} == {".toml"}


def test_quick_has_about_ten_thousand_rows(tables):
    """Every tooth, 1 to 3 neighbours, shift and loss alone and together: 12 x 3 x (3 x 3 - 1) cases of 25 specimens."""
    quick = tables["quick"]
    assert len(quick) == 12 * 3 * 8 * 25 + 25 * 100
    assert 9_000 <= len(quick) <= 11_000
    damaged = quick[quick["tooth"] > 0]
    assert set(damaged["tooth"]) == set(range(1, 13))
    assert set(damaged["damaged_teeth"]) == {1, 2, 3}
    alone = set(zip(damaged["phase_shift_deg"] > 0, damaged["stiffness_loss"] > 0, strict=True))
    assert alone == {(True, False), (False, True), (True, True)}


def test_reference_is_a_million_signatures_at_stratified_operating_points(tables):
    """25 points within 6 % of speed, 18 % of load and from -30 to -10 dB, one in each 25th of all; 125 specimens."""
    reference = tables["reference"]
    assert len(reference) == 25 * 125 * (56 + 12 * 2 * 11) == 1_000_000
    assert (reference["tooth"] == 0).sum() == 175_000
    points = reference[["speed_rpm", "torque", "snr_db"]].drop_duplicates()
    assert len(points) == 25
    assert sorted(((points["snr_db"] + 30) / 20 * 25).astype(int)) == list(range(25))
    for name, nominal, part in (("speed_rpm", 14400.0, 0.06), ("torque", 356.05, 0.18)):
        stratum = (points[name] / nominal - 1 + part) / (2 * part) * 25
        assert sorted(stratum.astype(int)) == list(range(25))


def test_quick_keeps_contact_on_all_templates(plans):
    """The built-in rig keeps min(delta)/static above 0.1 on the quick grid."""
    plan = plans["quick"]
    assert plan.n_templates == 1 + 3 * 8
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    least = {case.damage: sigdb.simulate(rig, case.damage).min_compression for case in plan.cases()}
    assert min(least.values()) > 0.1, min(least, key=least.get)


def test_paper_has_the_cases_of_figures_5_6_8_and_9(plans, tables):
    paper = tables["paper"]
    damaged = paper[paper["tooth"] > 0]
    plain = damaged[damaged["pattern"] == ""]
    assert set(plain["tooth"]) == {6}
    assert set(plain["damaged_teeth"]) == {1}
    cases = list(zip(plain["phase_shift_deg"], plain["stiffness_loss"], strict=True))
    # Figure 5: shifts of 1.5, 3.0, 4.5 deg; Figure 6: losses of 25 and 50 %.
    assert sorted(cases) == [(0.0, 0.25), (0.0, 0.5), (1.5, 0.0), (3.0, 0.0), (4.5, 0.0)]
    # Figures 8 and 9: a pitted tooth (50 % over the first 20 % of the contact), and a broken one between two pitted.
    patterns = {case.damage.pattern: case.damage for case in plans["paper"].cases() if case.damage.pattern}
    each = {
        name: [(one.stiffness_loss, one.loss_extent, one.phase_shift_deg) for one in damage.each]
        for name, damage in patterns.items()
    }
    pitted, broken = (0.5, 0.2, 0.0), (0.5, 1.0, 0.0)
    assert sorted(each.values(), key=len) == [[pitted], [pitted, broken, pitted]]
    patterned = damaged[damaged["pattern"] != ""]
    located = dict(zip(patterned["damaged_teeth"], patterned["tooth"], strict=True))
    # The broken tooth, the second of three, is number 6.
    assert located == {1: 6, 3: 5}
    # Almost free of noise, and of index errors.
    assert (paper["snr_db"] >= 40).all()
    assert (paper["index_error"] == 0).all()
    assert paper["speed_rpm"].unique().tolist() == [14400.0]


def test_teeth_sweeps_the_tooth_count(plans, tables):
    teeth = tables["teeth"]
    assert set(teeth["teeth"]) == {11, 12, 13}
    for count, rows in teeth[teeth["tooth"] > 0].groupby("teeth"):
        assert set(rows["tooth"]) == set(range(1, count + 1))
    # Pitch radius and mesh frequency follow; module and speed stay.
    points = {point.teeth: point.rig for point in plans["teeth"].rig_points}
    for count, rig in points.items():
        assert rig.mesh_frequency("main") == pytest.approx(14400 / 60 * count)
        # The pitch radius at the middle of the face: m z / 2 - (b / 2) sin(cone angle), tan(cone angle) = z / 36.
        sine = count / (count**2 + 36**2) ** 0.5
        mesh = rig.meshes["main"]
        assert rig.geometries["main"].radii[0] == pytest.approx(mesh.module * count / 2 - mesh.face_width / 2 * sine)
        assert set(teeth["averages"][teeth["teeth"] == count]) == {108}
        assert 108 % (36 // {11: 1, 12: 12, 13: 1}[count]) == 0


def test_which_models_a_run_makes():
    asked = {path.stem: load_recipe(path).sections.recognition for path in RECIPES}
    found = {name: (one.targets, one.splits) for name, one in asked.items() if one.targets}
    both = ("location", "severity")
    assert found == {
        "quick": (both, ("S1",)),
        "reference": ((*both, "detection"), ("S1",)),
        "generalisation": (both, ("S1", "S2", "S3", "S4")),
        "nuisances": (("location",), ("S1",)),
    }
    assert {name for name, one in asked.items() if one.robustness.rows} == {"nuisances", "reference"}
    others = load_recipe(PIPELINES / "generalisation.toml").evaluated_on()
    assert [other.path for other in others] == [PIPELINES / "other-form.toml", PIPELINES / "other-points.toml"]


def test_nuisances_are_stated_with_their_sources(plans):
    stated = {name for name, plan in plans.items() if plan.nuisance.exist}
    nuisance = plans["nuisances"].nuisance
    assert stated == {"nuisances"}
    assert nuisance.of_machine
    numbers = {name for name, value in nuisance if name not in ("sources", "rigs")}
    assert set(nuisance.sources) == numbers


def test_generalisation_holds_out_what_each_split_is_about(tables):
    rows, asked = tables["generalisation"], load_recipe(PIPELINES / "generalisation.toml").sections
    assert 20_000 <= len(rows) <= 50_000
    assert rows["snr_db"].between(-30, -15).all()
    splits = {name: make_split(name, rows, seed=asked.sweep.seed, folds=asked.recognition.folds) for name in SPLITS}
    held_out = {name: rows[(split.folds(rows) == "test") & (rows["tooth"] > 0)] for name, split in splits.items()}
    trained = {name: rows[(split.folds(rows) == "training") & (rows["tooth"] > 0)] for name, split in splits.items()}
    # On a line of losses 0, 0.1, 0.2, 0.3, 0.4 and one of shifts 0, 1.5, 3: every second of both.
    cells = held_out["S2"][["stiffness_loss", "phase_shift_deg"]].drop_duplicates()
    assert sorted(map(tuple, cells.to_numpy())) == [(0.1, 1.5), (0.3, 1.5)]
    assert ((held_out["S3"]["stiffness_loss"] == 0.4) | (held_out["S3"]["phase_shift_deg"] == 3)).all()
    assert trained["S3"]["stiffness_loss"].max() == 0.3
    assert trained["S3"]["phase_shift_deg"].max() == 1.5
    assert set(held_out["S4"]["teeth"]) == {12}
    assert set(trained["S4"]["teeth"]) == {11, 13}
    # Sets and intervals by specimen need nine pairs of gears in training, and an interval more than one in the test.
    assert trained["S1"]["specimen"].nunique() == 9
    assert held_out["S1"]["specimen"].nunique() == 3


def test_the_other_model_form_differs_in_rig_not_in_gears_nor_operating_point(plans, tables):
    one, other = plans["generalisation"], plans["other-form"]
    changed = changed_parts(model_form(one.resolved), other.resolved)
    assert changed == ["rig.bearings", "rig.casing", "rig.damping_ratio", "rig.sensors"]
    assert one.rig.operating.model_dump() == other.rig.operating.model_dump()
    assert one.design.seed != other.design.seed
    assert set(tables["other-form"]["snr_db"]) == set(tables["generalisation"]["snr_db"])
    least = min(sigdb.simulate(other.rig, case.damage).min_compression for case in other.cases())
    assert least > 0.1


def test_the_other_points_are_not_in_generalisation(plans, tables):
    one, other = tables["generalisation"], tables["other-points"]
    assert plans["generalisation"].design.seed != plans["other-points"].design.seed
    points = [set(map(tuple, rows[["speed_rpm", "torque"]].drop_duplicates().to_numpy())) for rows in (one, other)]
    assert len(points[1]) == 3
    assert not points[0] & points[1]


def test_a_recipe_names_its_rig_from_its_own_folder(tmp_path, monkeypatch):
    built_in = Path(__file__).parents[2] / "data" / "transmissions" / "nasa_spiral_bevel.toml"
    (tmp_path / "rigs").mkdir()
    text = built_in.read_text(encoding="utf-8").replace("teeth = 36", "teeth = 24")
    (tmp_path / "rigs" / "mine.toml").write_text(text, encoding="utf-8")
    recipe = tmp_path / "recipe.toml"
    recipe.write_text('[sweep]\nrig = "rigs/mine.toml"\n[[sweep.grid]]\nstiffness_loss = 0.2\n', encoding="utf-8")
    monkeypatch.chdir(tmp_path.parent)
    assert load_recipe(recipe).rig.gears["gear"].teeth == 24
    recipe.write_text('[sweep]\nrig = "mine.toml"\n[[sweep.grid]]\nstiffness_loss = 0.2\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"mine\.toml: no such file"):
        load_recipe(recipe)


def test_every_line_of_a_message_about_a_design_names_the_file(tmp_path):
    recipe = tmp_path / "recipe.toml"
    recipe.write_text(
        '[sweep]\nrig = "nasa-spiral-bevel"\n[[sweep.grid]]\nstiffness_loss = 0.2\n'
        "pinion.teeth = 2\noperating.torque = -1.0\n",
        encoding="utf-8",
    )
    with pytest.raises(InputError) as error:
        load_recipe(recipe).plan()
    lines = str(error.value).splitlines()
    assert len(lines) == 2
    assert all(line.startswith(f"{recipe}: ") for line in lines)
