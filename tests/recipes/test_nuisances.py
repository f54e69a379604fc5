"""Recipe: `pipelines/nuisances.toml` in a small form, from the sweep to a model that is no better than the bound.

The bound knows that two teeth of twelve may be damaged, so that it gains in much noise; the colour leaves the noise as
it is here.
"""

import json
from pathlib import Path

import sigdb
from sigdb.pipeline import load_recipe, run_recipe

RECIPE = Path(__file__).parents[2] / "pipelines" / "nuisances.toml"
SMALLER = {
    "specimens = 25": "specimens = 10",
    "healthy = 200": "healthy = 20",
    'tooth = "all"': "tooth = [1, 5]",
    "damaged_teeth = [1, 2]": "damaged_teeth = 1",
    "phase_shift_deg = [0.0, 1.5]": "phase_shift_deg = 0.0",
    "stiffness_loss = [0.0, 0.2, 0.4]": "stiffness_loss = [0.2, 0.4]",
    "rows = 1000": "rows = 0",
    "colours = 8": "colours = 2",
    "colour_db = 8.0": "colour_db = 2.0",
}


def test_a_small_run_makes_a_model_with_nuisances(tmp_path):
    text = RECIPE.read_text(encoding="utf-8")
    for old, new in SMALLER.items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    (tmp_path / "small.toml").write_text(text, encoding="utf-8")
    made = run_recipe(load_recipe(tmp_path / "small.toml"), tmp_path / "out", jobs=1)
    database = sigdb.open(made.database)
    assert len(database) == 10 * (20 + 2 * 2)
    assert len(database.templates().iloc[0]["nuisance_counts"]) > 5
    (result,) = made.results
    assert result.above == ()
    report = json.loads((tmp_path / "out" / "reports" / "location" / "evaluation.json").read_text(encoding="utf-8"))
    assert (
        abs(report["metrics"]["templates"]["accuracy"]["value"] - report["bound"]["accuracy"]["value"])
        <= 1 / report["rows"]
    )
    assert sigdb.load_model(tmp_path / "out" / "models" / "location").learner == "templates"
