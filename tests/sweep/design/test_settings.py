"""Unit: each count of a recipe is bounded before memory is spent, and the recipe may raise the bound."""

import os
import tracemalloc

import pytest

from sigdb.core.errors import InputError
from sigdb.pipeline import load_recipe

MANY = ", ".join(str(i / 10_000) for i in range(2_000))
GRID = "stiffness_loss = 0.2"


@pytest.fixture
def plan_of(tmp_path):
    """Return the plan of a recipe with keys of [sweep], of a grid, and further sections."""

    def plan(sweep="", grid=GRID, rest=""):
        path = tmp_path / "recipe.toml"
        path.write_text(f'[sweep]\nrig = "nasa-spiral-bevel"\n{sweep}\n[[sweep.grid]]\n{grid}\n{rest}\n')
        return load_recipe(path).plan()

    return plan


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"sweep": f"specimens = {10**18}"}, r"1e\+18 rows by specimens, and the limit is 100000000; .* limits\.rows"),
        ({"sweep": "draws = 200_000_000"}, r"the sweep has 200000000 rows by draws"),
        ({"sweep": "specimens = 1_000_000\ndraws = 1_000_000"}, r"the sweep has 1\.2e\+13 rows"),
        ({"sweep": "healthy = 100_000_000\nspecimens = 3"}, r"the sweep has 300000036 rows"),
        ({"grid": f"{GRID}\nsnr_db = [{MANY}]\nindex_error = [{MANY}]"}, r"grid\.1 has 4000000 measurements"),
        ({"grid": f"stiffness_loss = [{MANY}]\nfriction = [{MANY}]\nphase_shift_deg = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]"},
         r"grid\.1 has 24000000 cases of damage, and the limit is 20000000; .* limits\.templates"),
        ({"grid": "stiffness_loss = { min = 0.1, max = 0.2 }\npoints = 1_000_000_000_000"}, r"1e\+12 joint points"),
        ({"grid": f"{GRID}\noperating.torque = {{ min = 100, max = 200 }}\npoints = 10_000_000"}, r"limits\.points"),
        ({"grid": f"{GRID}\noperating.torque = [{MANY}]\noperating.speed_rpm = [{MANY}]"}, r"4000000 combinations of"),
        ({"grid": f"{GRID}\npinion.teeth = 1_000_000_000"}, r"an average of 1000000000 teeth has 6\.4e\+10 samples"),
        ({"rest": "[signature]\nsamples_per_tooth = 1_000_000"}, r"12000000 samples, .* raise limits\.samples"),
        ({"grid": f"{GRID}\npinion.teeth = [11, 12, 13]", "rest": "[limits]\nrigs = 2"}, r"3 rigs to build"),
        ({"rest": "[limits]\nrows = 11"}, r"the sweep has 12 rows, and the limit is 11"),
    ],
)  # fmt: skip
def test_a_count_beyond_its_limit_is_refused_before_memory_is_spent(plan_of, keys, message):
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=rf"recipe\.toml: .*{message}"):
            plan_of(**keys)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("grid", "message"),
    [
        (f"{GRID}\ntooth = {10**18}", r"tooth = 1e\+18 must be at most 2147483647"),
        (f"{GRID}\ndamaged_teeth = {10**15}", r"damaged_teeth = 1e\+15 must be at most"),
        (f"{GRID}\npoints = 3\naverages = {{ min = 3, max = {10**12} }}", r"averages\.max = 1e\+12 must be at most"),
        ("\n".join(["stiffness_loss = 0.1\n[[sweep.grid]]"] * 1001), r"sweep\.grid has more than 1000 items"),
    ],
)
def test_whole_numbers_and_grids_have_bounds(plan_of, grid, message):
    with pytest.raises(InputError, match=message):
        plan_of(grid=grid)


def test_a_recipe_raises_a_limit_and_its_plan_is_the_same(plan_of):
    plan = plan_of(rest="[limits]\nrows = 1_000_000_000\nsamples = 100_000")
    assert plan.hash == plan_of().hash
    assert plan_of(sweep="specimens = 20_000_000", rest="[limits]\nrows = 1_000_000_000").rows == 240_000_000


def test_a_table_that_is_no_regular_file_is_refused(plan_of, tmp_path):
    os.mkfifo(tmp_path / "cases.csv")
    with pytest.raises(InputError, match=r"cases\.csv: not a regular file but a pipe or a device"):
        plan_of(grid='table = "cases.csv"')


def test_a_rig_without_a_finite_motion_is_refused_with_a_reason():
    import sigdb

    rig = sigdb.load_transmission("nasa-spiral-bevel").replace({"operating.speed_rpm": 1e-300})
    with pytest.raises(sigdb.SigdbError, match=r"not finite: .* check their units"):
        sigdb.simulate(rig, sigdb.Damage(tooth=1, stiffness_loss=0.1))
