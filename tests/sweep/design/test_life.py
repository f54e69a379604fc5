"""Lives: growth by the laws, what is drawn, the rows with their times, and what is refused."""

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import solve_ivp

import sigdb
from sigdb.core import InputError
from sigdb.database.store.roles import Role, role_of
from sigdb.pipeline import load_recipe
from sigdb.sweep import Grid, Life, life_rows, run

LIFE = {"law": "paris", "start": 0.05, "limit": 0.5, "rate": {"min": 0.02, "max": 0.2}, "lives": 3, "looks": 40}


def test_a_crack_grows_by_the_differential_equation():
    looks = Life(**LIFE, exponent={"min": 2.5, "max": 3.5}).trajectories()
    for _, life in looks.groupby("life"):
        rate, m = life["rate"].iloc[0], life["exponent"].iloc[0]
        exact = solve_ivp(
            lambda t, a, rate=rate, m=m: rate * (a / 0.5) ** (m / 2),
            (0, life["time"].max()), [0.05], t_eval=life["time"], rtol=1e-9, atol=1e-12,
        )  # fmt: skip
        np.testing.assert_allclose(life["stiffness_loss"], exact.y[0], rtol=1e-6)
        assert 0.02 <= rate <= 0.2
        assert 2.5 <= m <= 3.5
    assert looks["life"].nunique() == 3


def test_pits_come_one_by_one_at_their_rate():
    life = Life(law="pits", size="pits", start=1, limit=10_000, rate={"min": 0.5, "max": 0.5}, looks=4000)
    counts = life.trajectories()["pits"]
    assert counts.iloc[-1] == pytest.approx(1 + 0.5 * 4000, abs=4 * np.sqrt(2000))  # four standard deviations
    assert (np.diff(counts) >= 0).all()


def test_wear_grows_at_a_constant_speed_until_the_limit():
    life = Life(law="archard", size="wear_depth", start=1e-6, limit=5e-6, rate={"min": 1e-6, "max": 1e-6})
    np.testing.assert_allclose(life.trajectories()["wear_depth"], [1e-6, 2e-6, 3e-6, 4e-6, 5e-6])


RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 1
specimens = 2
healthy = 1

[[sweep.grid]]
tooth = [3]
life = { law = "paris", start = 0.1, limit = 0.4, rate.min = 0.1, rate.max = 0.3, lives = 2, looks = 5 }

[[sweep.grid]]
tooth = [3]
life = { law = "archard", start = 0.1, limit = 0.3, rate.min = 0.1, rate.max = 0.1, looks = 2 }

[signature]
sensors = ["pinion-vertical"]
samples_per_tooth = 32
"""


def test_rows_have_their_lives_and_times(tmp_path):
    (tmp_path / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    recipe = load_recipe(tmp_path / "recipe.toml")
    run(recipe.plan(), tmp_path / "db", recipe=recipe.text, jobs=1)
    database = sigdb.open(tmp_path / "db")
    lives = life_rows(database)
    rows = lives[lives["grid"] == 0]
    assert lives.loc[lives["grid"] == 1, "severity"].tolist() == [0.1, 0.2] * 2  # a life of each specimen
    assert set(database.cases("life_number = 3")["id"]) == set(lives.loc[lives["grid"] == 1, "id"])
    life = Life.model_validate(database.manifest.resolved["sweep"]["grid"][0]["life"])
    looks = life.trajectories()
    assert len(rows) == 2 * len(looks) == rows["id"].nunique()  # each specimen has both lives, and each look is a row
    first = rows[(rows["life"] == 1) & (rows["specimen"] == 0)]
    np.testing.assert_allclose(first["severity"], looks.loc[looks["life"] == 1, "stiffness_loss"])
    assert (first["tooth"] == 3).all()
    np.testing.assert_allclose(first["time"], looks.loc[looks["life"] == 1, "time"])
    np.testing.assert_allclose(first["rate"], looks.loc[looks["life"] == 1, "rate"])
    stored = database.cases("life_number = 2 and specimen = 0").sort_values("life_time")
    assert stored["id"].tolist() == first["id"].tolist()
    healthy = database.cases("tooth = 0")
    assert len(healthy) == 2  # one of each specimen, however many looks there are
    assert (healthy[["life_number", "life_time"]] == 0).all(axis=None)
    assert {role_of("life_number"), role_of("life_time")} == {Role.ID}
    assert Grid(**database.manifest.resolved["sweep"]["grid"][0]).life == life


@pytest.mark.parametrize(
    ("columns", "text"),
    [
        ({"life_number": [1.5], "life_time": [0.0]}, "life_number = 1.5 must be a whole number"),
        ({"life_number": [-1], "life_time": [0.0]}, "life_number = -1 must be a whole number, 0 or more"),
        ({"life_number": [1]}, "give life_number and life_time together"),
        ({"life_time": [1.0]}, "give life_number and life_time together"),
    ],
)
def test_lives_in_a_table_are_whole_numbers_with_times(columns, text):
    with pytest.raises((InputError, ValidationError), match=text):
        Grid(table={"stiffness_loss": [0.1]} | columns)
    assert Grid(table={"stiffness_loss": [0.1], "life_number": [1], "life_time": [0.0]}).joint_points == 1


def test_a_database_without_lives_is_refused(explored):
    with pytest.raises(InputError, match="has no lives"):
        life_rows(sigdb.open(explored))


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"law": "pits"}, "pits is for numbers"),
        ({"size": "pits"}, "pits is for numbers"),
        ({"size": "size"}, "no axis of damage"),
        ({"start": 0.5}, "must be less than life.limit"),
        ({"rate": {"min": 0.0, "max": 1.0}}, "must be greater than 0"),
        ({"exponent": {"min": -1.0, "max": 1.0}}, "must be 0 or more"),
        ({"limit": 1.5}, "less than or equal to 1"),
        ({"lives": 10_000}, "the limit is 100000"),
    ],
)
def test_a_life_that_contradicts_itself_is_refused(change, text):
    with pytest.raises((InputError, ValidationError), match=text):
        Grid(life=LIFE | change)


def test_a_life_and_a_table_are_refused_together():
    with pytest.raises(InputError, match="a life is a table by itself"):
        Grid(life=LIFE, table={"stiffness_loss": [0.1]})
