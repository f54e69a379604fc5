"""What is damaged: kinds and sizes of templates, and their posterior against Bayes' rule written out."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy.special import softmax

import sigdb
from sigdb.core.errors import InputError
from sigdb.database import damage_kinds
from sigdb.pipeline import load_recipe
from sigdb.recognition import Hypotheses, fuse, gear_probabilities
from sigdb.recognition.fusion.kind_posterior import stored_sizes
from sigdb.sweep import run

RECIPE = """
[sweep]
rig = "spur-test-rig"
gear = "pinion"
seed = 3
specimens = 3
healthy = 4

[[sweep.grid]]
tooth = [1, 7]
crack_depth = [1e-3, 2e-3]

[[sweep.grid]]
tooth = [1, 7]
pit_diameter = 2e-3
pits = 4

[measurement]
averages = 48
snr_db = -12.0
index_error = 2e-7

[signature]
samples_per_tooth = 32
"""


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kinds")
    (folder / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    recipe = load_recipe(folder / "recipe.toml")
    run(recipe.plan(), folder / "signatures", recipe=recipe.text, jobs=1)
    return sigdb.open(folder / "signatures")


@pytest.mark.parametrize(
    ("case", "kind"),
    [
        ({"tooth": 0}, "none"),
        ({"tooth": 2, "stiffness_loss": 0.3, "loss_extent": 1.0}, "loss"),
        ({"tooth": 2, "phase_shift_deg": -1.0, "friction": 0.1}, "shift + friction"),
        ({"tooth": 2, "stiffness_loss": 0.3, "loss_extent": 0.0, "crack_depth": 1e-3}, "crack"),
        ({"tooth": 2, "flank_deviation": -1e-5, "deviation_extent": 0.2}, "deviation"),
        ({"tooth": 2, "pattern": "broken", "stiffness_loss": None}, "pattern"),
    ],
)
def test_the_kind_of_a_case_is_what_changes_the_tooth(case, kind):
    assert damage_kinds(pd.DataFrame([case])) == [kind]


def test_kinds_and_sizes_follow_from_the_posterior_of_the_templates(database):
    """Prior times density of every template at every tooth, summed over the templates of a kind."""
    rows = database.cases().set_index("id")
    fusion = fuse(database, over=[])
    machines = fusion.machines
    point = {name: rows[name].iloc[0].item() for name in ("speed_rpm", "torque", "teeth")}
    laws = Hypotheses.of(database, **point)
    x = database.signals(rows.index.to_numpy())["tsa"]
    noise = np.sqrt(laws.reference_variance[0] / 10 ** (rows["snr_db"] / 10) / rows["averages"]).to_numpy()
    likelihood = laws.log_likelihood(x, noise=noise, index_error=rows["index_error"].to_numpy())
    prior = np.full(likelihood.shape[1:], 0.0)
    np.add.at(prior, (rows["template"].to_numpy(), np.maximum(rows["tooth"], 1) - 1), 1 / len(rows))
    prior[laws.healthy] = prior[laws.healthy].sum() / prior.shape[1]
    with np.errstate(divide="ignore"):
        after = softmax(likelihood + np.log(prior), axis=(1, 2)).sum(axis=2)
    cases = laws.cases
    of_kinds = {
        "none": after[:, laws.healthy].sum(axis=1),
        "crack": after[:, (cases["crack_depth"] > 0).to_numpy()].sum(axis=1),
        "pit": after[:, (cases["pit_diameter"] > 0).to_numpy()].sum(axis=1),
    }
    of_row = fusion.rows.loc[rows.index].to_numpy()
    expected = pd.DataFrame(of_kinds)
    found = machines.loc[of_row]
    assert_allclose(found["kind_probability"].to_numpy(), expected.max(axis=1), rtol=1e-6)
    assert found["predicted_kind"].tolist() == expected.idxmax(axis=1).tolist()
    assert stored_sizes(cases) == ["crack_depth", "pit_diameter"]
    cracked = machines[machines["kind"] == "crack"]
    assert cracked["median_crack_depth"].isin([1e-3, 2e-3]).all()
    assert (cracked["low_crack_depth"] <= cracked["median_crack_depth"]).all()
    assert (machines["kind"] == machines["predicted_kind"]).mean() > 0.6


def test_the_damaged_gear_is_that_whose_averages_ask_for_it():
    """Bayes' rule: weights 1 / 2 for none, 1 / 4 for each of two gears, times the odds."""
    found = gear_probabilities({"pinion": np.log(6.0), "wheel": np.log(0.5)})
    assert_allclose(list(found.values()), np.array([2.0, 6.0, 0.5]) / 8.5)
    assert list(found) == ["none", "pinion", "wheel"]
    for odds, says in (({}, "has no gear"), ({"pinion": np.nan}, "gear 'pinion' is nan")):
        with pytest.raises(InputError, match=says):
            gear_probabilities(odds)
