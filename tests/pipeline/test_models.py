"""Unit: a run trains the models that its recipe asks for and reports on them; what is unchanged is kept."""

import json
import re
import shutil
from dataclasses import replace

import pytest
from click.testing import CliRunner
from matplotlib.figure import Figure

import sigdb
from sigdb.cli.main import cli
from sigdb.core.errors import InputError
from sigdb.pipeline import load_recipe, recipe_models, run_recipe
from sigdb.recognition import load_model
from sigdb.recognition.estimators import registry

RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 1
specimens = 3
healthy = 10

[[sweep.grid]]
tooth = "all"
stiffness_loss = [0.2, 0.4]

[measurement]
averages = 102
index_error = 2e-6

[signature]
samples_per_tooth = 32
sensors = ["pinion-vertical"]

[recognition]
learner = "lda"
folds = 3
targets = ["location", "severity"]
evaluate_on = ["damped.toml"]
"""
RECOGNITION = RECIPE[RECIPE.index("[recognition]") :]


@pytest.fixture(scope="module", autouse=True)
def _without_boosting():
    """It takes most of the time, and stages are the same with or without."""
    with pytest.MonkeyPatch.context() as patch:
        kept = tuple(entry for entry in registry.REGISTRY if entry.name != "boosting")
        patch.setattr(registry, "REGISTRY", kept)
        yield


@pytest.fixture(scope="module", autouse=True)
def _empty_pictures():
    """Pictures are drawn, but not written: stages are the same, and tests/report looks at pictures."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", lambda figure, content, **options: content.write(b"<svg/>"))
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the recipe, and a recipe of the same cases on a rig with more damping."""
    folder = tmp_path_factory.mktemp("models")
    rig = sigdb.transmission.library._built_in_files()["nasa-spiral-bevel"].read_text(encoding="utf-8")
    (folder / "rig.toml").write_text(rig.replace("damping_ratio = 0.054", "damping_ratio = 0.06"), encoding="utf-8")
    other = RECIPE.replace('"nasa-spiral-bevel"', '"rig.toml"').replace("seed = 1", "seed = 2")
    (folder / "damped.toml").write_text(other.replace(RECOGNITION, ""), encoding="utf-8")
    (folder / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def run(folder):
    """Run the recipe with another text; what was made, and the ends of what it said of models and reports."""

    def run(text=RECIPE):
        (folder / "recipe.toml").write_text(text, encoding="utf-8")
        said, out = [], folder / "out"
        made = run_recipe(load_recipe(folder / "recipe.toml"), out, jobs=1, on_stage=said.append)
        ends = ("trained", "written", "unchanged")
        told = (line.removeprefix(f"{out}/").split(": ") for line in said)
        return made, [(what, did) for what, did in told if did in ends]

    return run


@pytest.fixture(scope="module")
def first(run):
    return run()


STAGES = [
    ("models/location", "trained"),
    ("reports/location", "written"),
    ("reports/location-on-damped", "written"),
    ("models/severity", "trained"),
    ("reports/severity", "written"),
    ("reports/severity-on-damped", "written"),
]
KEPT = [(what, "unchanged") for what, _ in STAGES]


def contents(folder):
    """Files with their times and bytes; some versions of filelock touch the file of a lock."""
    files = [path for path in folder.rglob("*") if path.is_file() and path.name != ".lock"]
    return {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in files}


def test_every_stage_is_made(first, folder):
    made, told = first
    assert told == STAGES
    assert made.others == (folder / "out" / "others" / "damped" / "signatures",)
    assert [(one.target, one.split, one.metric) for one in made.results] == [
        ("location", "S1", "accuracy"),
        ("location", "S5", "accuracy"),
        ("severity", "S1", "mae_stiffness_loss"),
        ("severity", "S5", "mae_stiffness_loss"),
    ]
    for one in made.results:
        assert load_model(one.model).target == one.target
        assert one.page.name == "index.html"
        numbers = json.loads((one.page.parent / "evaluation.json").read_text(encoding="utf-8"))
        assert one.value.value == numbers["metrics"]["lda"][one.metric]["value"]
        assert one.bound.value == numbers["bound"][one.metric]["value"]


def test_the_card_names_the_command_that_makes_the_model_again(first, folder):
    card = (folder / "out" / "models" / "location" / "README.md").read_text(encoding="utf-8")
    assert f"sigdb run {folder / 'recipe.toml'} --out {folder / 'out'}" in card


def test_a_second_run_changes_no_file(first, run, folder):
    before = contents(folder / "out")
    made, told = run()
    assert told == KEPT
    assert contents(folder / "out") == before
    assert made.results == first[0].results


def test_a_damaged_model_is_trained_again(first, run, folder):
    model = folder / "out" / "models" / "severity"
    (model / "model.skops").write_bytes(b"half")
    _, told = run()
    assert told[:4] == [*KEPT[:3], STAGES[3]]
    assert load_model(model).target == "severity"


def test_a_report_that_is_gone_is_written_again_from_the_model_that_is_there(first, run, folder):
    page = folder / "out" / "reports" / "location" / "index.html"
    before = page.read_text(encoding="utf-8")
    page.unlink()
    _, told = run()
    assert told == [KEPT[0], STAGES[1], *KEPT[2:]]
    assert page.read_text(encoding="utf-8") == before


def test_other_settings_remake_models_and_reports_and_no_row(first, run, folder):
    kept = folder / "kept"
    shutil.copytree(folder / "out", kept)
    before = {path: path.stat().st_mtime_ns for path in folder.glob("out/**/*.parquet")}
    try:
        severity = RECIPE.replace('["location", "severity"]', '["severity"]')
        _, told = run(severity.replace("folds = 3", "folds = 3\nseed = 5"))
        assert told == STAGES[3:]
        assert {path: path.stat().st_mtime_ns for path in folder.glob("out/**/*.parquet")} == before
    finally:
        shutil.rmtree(folder / "out")
        kept.rename(folder / "out")
    assert run()[1] == KEPT


def test_other_models_and_figures_leave_what_is_there(first, run, folder):
    fewer = RECIPE.replace('["location", "severity"]', '["location"]')
    made, told = run(f"{fewer}splits = ['S1']\n\n[report]\ndots_per_inch = 60\n")
    assert told == KEPT[:3]
    assert len(made.results) == 2
    assert run()[1] == KEPT


def test_a_model_better_than_the_bound_fails_the_run_after_its_report(first, folder, monkeypatch):
    (folder / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    out, page = folder / "out", folder / "out" / "reports" / "location" / "index.html"
    honest = recipe_models.evaluate
    monkeypatch.setattr(
        recipe_models, "evaluate", lambda *args, **options: replace(honest(*args, **options), above=("accuracy",))
    )
    words = ["run", str(folder / "recipe.toml"), "--out", str(out), "--jobs", "1"]
    page.unlink()
    for _ in range(2):  # also when nothing is left to do
        result = CliRunner().invoke(cli, words, standalone_mode=False)
        assert result.return_value == 1
        assert f"{page}: the model {out / 'models' / 'location'} is better than" in result.stderr
        assert "better than" in page.read_text(encoding="utf-8")
    monkeypatch.undo()
    page.unlink()
    result = CliRunner().invoke(cli, words, standalone_mode=False)
    assert result.return_value == 0
    table = [re.split(r"  +", line.strip()) for line in result.stdout.split("\n\n")[-1].splitlines()]
    assert table[0] == ["target", "split", "metric", "model", "bound", "report"]
    assert [(row[0], row[1], row[-1]) for row in table[1:]] == [
        (target, split, str(out / "reports" / f"{target}{on}" / "index.html"))
        for target in ("location", "severity")
        for split, on in (("S1", ""), ("S5", "-on-damped"))
    ]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('"location", ', '"location", "location", ', "recognition.targets: 'location' is given twice; give it once"),
        ('"location", ', '"place", ', "recognition.targets.1 = 'place' must be 'location', 'severity'"),
        ("folds = 3", "folds = 3\nsplits = ['S5']", "recognition.splits.1 = 'S5' must be 'S0', 'S1'"),
        ("folds = 3", "folds = 3\nsplits = []", "recognition.splits is empty; give at least 1"),
        ("folds = 3", "folds = 3\nfalse_alarm_rate = 0.0", "recognition.false_alarm_rate = 0.0 must be greater than 0"),
        ("folds = 3", "folds = 3\ntarget = 'location'", "unknown key recognition.target; did you mean 'targets'?"),
        ("folds = 3", "folds = 4", "sweep.specimens = 3 cannot be split into recognition.folds = 4"),
        (
            "stiffness_loss = [0.2, 0.4]",
            "stiffness_loss = [0.4]",
            "severity cannot be learnt, since no size of the damages of [sweep] varies",
        ),
        ("healthy = 10", "healthy = 0", "recognition.targets needs healthy rows; set healthy in [sweep]"),
        ('["damped.toml"]', '["damped"]', "'damped' is not the path of a recipe, which ends in .toml"),
        ('["damped.toml"]', '["none.toml"]', "none.toml: no such file"),
        ('["damped.toml"]', '["damped.toml", "../models/damped.toml"]', "two recipes are called damped"),
        ('["location", "severity"]', "[]", "recognition: evaluate_on is given without targets"),
        (
            'sensors = ["pinion-vertical"]',
            'sensors = ["pinion-housing-vertical"]',
            "the models read 'pinion-housing-vertical', damped stores 'pinion-vertical' first",
        ),
    ],
)
def test_what_no_model_can_be_made_from_is_told_before_anything_is_made(folder, tmp_path, old, new, says):
    assert RECIPE.count(old) == 1
    recipe = folder / "wrong.toml"
    recipe.write_text(RECIPE.replace(old, new).replace("../models", f"../{folder.name}"), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        run_recipe(load_recipe(recipe), tmp_path / "out", jobs=1)
    assert says in str(caught.value)
    assert str(caught.value).startswith(f"{recipe}: ")
    assert not (tmp_path / "out").exists()
