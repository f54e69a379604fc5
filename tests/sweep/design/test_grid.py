"""Unit: a design that does not fit is refused in a sentence that names the file, the key, the value and the remedy."""

import re

import pytest

from sigdb.core.errors import InputError
from sigdb.pipeline import load_recipe
from sigdb.sweep import Grid

GRID = "[[sweep.grid]]\nstiffness_loss = 0.2\n"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "[[sweep.grid]]\nstifness_loss = 0.4\n",
            r"unknown key sweep\.grid\.1\.stifness_loss; did you mean 'stiffness",
        ),
        ("helthy = 3\n" + GRID, r"unknown key sweep\.helthy; did you mean 'healthy'\?"),
        (GRID + "[measurment]\nsnr_db = 1.0\n", r"unknown key measurment; did you mean 'measurement'\?"),
        (GRID + "[measurement]\nsnr = 1.0\n", r"unknown key measurement\.snr; did you mean 'snr_db'\?"),
        ("", r"sweep\.grid is missing; add it"),
        ("grid = []\n", r"sweep\.grid is empty; give at least 1"),
        ("seed = -1\n" + GRID, r"sweep\.seed = -1 must be greater than or equal to 0"),
        ("specimens = 0\n" + GRID, r"sweep\.specimens = 0 must be greater than or equal to 1"),
        ('seed = "one"\n' + GRID, r"sweep\.seed = 'one' must be a valid integer"),
        (GRID + "tooth = 13\n", r"tooth = 13 is not on a gear of 12 teeth; name teeth from 1 to 12, or 'all'"),
        (GRID + "tooth = [6, 0]\n", r"tooth = 0 is not on a gear of 12 teeth"),
        (GRID + "tooth = 13\naverages = 108\npinion.teeth = [13, 12]\n", r"tooth = 13 is not on a gear of 12 teeth"),
        (GRID + 'tooth = "six"\n', r"tooth.* = 'six' must be"),
        (GRID + "damaged_teeth = 13\n", r"damaged_teeth = 13, but the gear has 12 teeth"),
        (GRID + "damaged_teeth = 0\n", r"damaged_teeth = 0 must be 1 or more; undamaged rows come from healthy"),
        ("[[sweep.grid]]\nstiffness_loss = []\n", r"sweep\.grid\.1\.stiffness_loss is empty; give at least 1"),
        ("[[sweep.grid]]\nstiffness_loss = 1.5\n", r"stiffness_loss = 1\.5 must be less than or equal to 1"),
        ("[[sweep.grid]]\nstiffness_loss = nan\n", r"stiffness_loss\.1 = nan must be a finite number"),
        ('[[sweep.grid]]\nstiffness_loss = "half"\n', r"stiffness_loss\.1 = 'half' must be a valid number"),
        (GRID + "averages = 0\n", r"averages = 0 must be greater than or equal to 1"),
        (GRID + "index_error = -1.0\n", r"index_error = -1\.0 must be greater than or equal to 0"),
        (GRID + "averages = 4\n", r"averages = 4 is not a whole number .* every 3 revolutions; use for example 3"),
        (GRID + "pinion.teeth = 13\n", r"averages = 102 is not a whole number .* every 36 revolutions; use .* 108"),
        ('[[sweep.grid]]\npattern = "x"\n', r"pattern 'x' is not defined; define it under \[sweep\.patterns\]"),
        (
            '[[sweep.grid]]\npattern = "x"\nstiffness_loss = 0.2\n[sweep.patterns]\nx = [{ stiffness_loss = 0.2 }]\n',
            r"sweep\.grid\.1: pattern and stiffness_loss are given together",
        ),
        (GRID + "[sweep.patterns]\nx = [{}]\n", r"patterns\.x damages no tooth; give at least one tooth a loss"),
        (
            '[[sweep.grid]]\npattern = "x"\n[sweep.patterns]\nx = [{ stiffness_loss = 2.0 }]\n',
            r"sweep\.patterns\.x\.1\.stiffness_loss = 2\.0 must be less than or equal to 1",
        ),
        (GRID + '[signature]\nsensors = ["pinion"]\n', r"has no 'pinion'; known: pinion-vertical, pinion-housing"),
        (GRID + "[signature]\nsamples_per_tooth = 16\n", r"samples_per_tooth = 16 must be greater than or equal to 32"),
        ('gear = "ring"\n' + GRID, r"gear = 'ring' does not exist; known: pinion, gear"),
        (GRID + "pinon.teeth = 12\n", r"has no part 'pinon' \(in 'pinon\.teeth'\); did you mean 'pinion'\?"),
        (GRID + "pinion.tooth = 12\n", r"has no parameter 'pinion\.tooth'; did you mean 'teeth'\?"),
        (GRID + "pinion.shaft = 12\n", r"'pinion\.shaft' of rig 'nasa-spiral-bevel' is not a number"),
        (GRID + "pinion.teeth = 12.5\n", r"gears\.pinion\.teeth = 12\.5 must be a valid integer"),
        (GRID + "operating.torque = -1.0\n", r"operating\.torque = -1\.0 must be greater than or equal to 0"),
        ("[[sweep.grid]]\ntooth = 1\n", r"no rows: no grid damages anything and healthy = 0; give a loss, a shift or"),
        ("[[sweep.grid]]\nstiffness_loss = 0.0\nloss_extent = 0.5\n", r"the sweep has no rows"),
    ],
)
def test_a_recipe_is_refused_by_name(recipe_of, text, says):
    with pytest.raises(InputError, match=r"recipe\.toml: .*" + says):
        recipe_of('[sweep]\nrig = "nasa-spiral-bevel"\n' + text).plan()


RANGE = "stiffness_loss = { min = 0.1, max = 0.4 }\n"


@pytest.mark.parametrize(
    ("grid", "says"),
    [
        (RANGE, r"points is missing; say how many joint points the range of stiffness_loss has"),
        (RANGE + "points = 0\n", r"points = 0 must be greater than or equal to 1"),
        (RANGE + "points = 2.5\n", r"points = 2\.5 must be a valid integer"),
        (RANGE + 'points = 2\nmethod = "lhs"\n', r"method = 'lhs' must be 'random', 'latin-hypercube' or 'sobol'"),
        ("points = 3\n", r"points = 3 but no axis is a range; give one as \{ min = \.\.\., max = \.\.\. \}"),
        ('method = "sobol"\n', r"method = 'sobol' but no axis is a range"),
        (
            RANGE.replace("0.4", "0.0"),
            r"stiffness_loss\.min = 0\.1 is more than stiffness_loss\.max = 0; exchange",
        ),
        (RANGE.replace("0.4", "1.4"), r"stiffness_loss\.max = 1\.4 must be less than or equal to 1"),
        (RANGE.replace("0.4", "nan"), r"stiffness_loss\.max = nan must be a finite number"),
        (RANGE.replace("0.4", "'much'"), r"stiffness_loss\.max = 'much' must be a number"),
        (RANGE.replace(", max = 0.4", ""), r"stiffness_loss\.max is missing; a range has both ends"),
        (RANGE.replace("max", "most"), r"stiffness_loss = \{'min': 0\.1, 'most': 0\.4\} is no range; give a list, or"),
        (RANGE.replace("stiffness", "stifness"), r"unknown key .*stifness_loss; did you mean 'stiffness_loss'\?"),
        ("pattern = { min = 0, max = 1 }\npoints = 2\n", r"pattern is a name and has no range; list names"),
        ("pattern = 'worn'\npoints = 2\n" + RANGE, r"pattern and stiffness_loss are given together"),
        ("tooth = { min = 1.5, max = 3 }\npoints = 2\n", r"tooth\.min = 1\.5 must be a whole number"),
        ("tooth = { min = 0, max = 3 }\npoints = 2\n", r"tooth\.min = 0 must be 1 or more; teeth are numbered from 1"),
        (RANGE + "tooth = { min = 1, max = 13 }\npoints = 50\n", r"tooth = 13 is not on a gear of 12 teeth"),
        (
            RANGE + "damaged_teeth = { min = 1, max = 13 }\npoints = 50\n",
            r"damaged_teeth = 13, but the gear has 12 teeth",
        ),
        ("phase_shift_deg = { min = 15, max = 30 }\npoints = 2\n", r"is more than half a tooth pass of a gear of 12"),
        (
            RANGE + "averages = { min = 100, max = 101 }\npoints = 2\n",
            r"averages from 100 to 101 hold no whole tooth cycles, .* multiples of 3 .* \{ min = 3, max = 102 \}",
        ),
        (
            RANGE + "pinion.teeth = { min = 11.5, max = 13 }\npoints = 2\n",
            r"pinion\.teeth\.min = 11\.5 must be",
        ),
        (
            RANGE + "operating.torque = { min = -9, max = -1 }\npoints = 2\n",
            r"torque = -.* must be greater than",
        ),
        (
            RANGE + "pinion.teeth = { min = 11, max = 13 }\ngears.pinion.teeth = 12\npoints = 2\n",
            r"gears\.pinion\.teeth and pinion\.teeth are the same parameter of the rig; name it once",
        ),
        ("pinion.teeth = []\n", r"pinion\.teeth is empty; give at least 1"),
        ("tooth = 1.5\n", r"tooth = 1\.5 must be a whole number, a list of them, or 'all'"),
        (RANGE + "points = 2\ntable = { tooth = [1] }\n", r"table and the range of stiffness_loss are given together"),
        ("table = { tooth = [1] }\npoints = 2\n", r"table and points are given together"),
        ("table = { tooth = [1] }\ntooth = 2\n", r"tooth is listed and also in the table; give it once"),
        ("table = 3\n", r"table = 3 must be the path of a CSV or Parquet file, or columns"),
        ("table = {}\n", r"table has no columns; give one for each axis"),
        ("table = { tooth = [] }\n", r"table has no rows; give at least one"),
        ("table = { tooth = 1 }\n", r"column tooth = 1 must be a list of values, one for each row"),
        (
            "table = { tooth = [1, 2], snr_db = [0.0] }\n",
            r"column snr_db has 1 rows and column tooth has 2; give",
        ),
        ("table = { tooth = [1, 'two'] }\n", r"table: row 2: tooth = 'two' must be a number"),
        ("table = { tooth = [1, true] }\n", r"table: row 2: tooth = True must be a number"),
        ("table = { pinion.teeth = [11, 12.5] }\n", r"table row 2: pinion\.teeth = 12\.5 must be a whole number"),
        ("table = { pattern = ['worn', 'wrn'] }\n", r"pattern 'wrn' is not defined"),
        ("table = 'none.csv'\n", r"none\.csv: no such file; a table is a CSV or Parquet file in the recipe's folder"),
    ],
)
def test_a_sample_or_a_table_is_refused_by_name(recipe_of, grid, says):
    with pytest.raises(InputError) as error:
        recipe_of(f'[sweep]\nrig = "nasa-spiral-bevel"\n[[sweep.grid]]\n{grid}').plan()
    for line in str(error.value).splitlines():
        assert re.search(r"recipe\.toml: .*" + says, line)
    assert "validator" not in str(error.value)
    assert "literal[" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("tooth,stiffness_loss\n1,0.2\n2,half\n", r"row 2: stiffness_loss = 'half' must be a number"),
        ("tooth,stiffness_loss\n1,0.2\n2,\n", r"row 2: stiffness_loss is empty; fill it in"),
        ("tooth,stiffness_loss\n1,nan\n2,0.1\n", r"row 1: stiffness_loss = nan must be a finite number"),
        ("tooth,stiffness_loss\n1,0.2\n2,1.4\n", r"row 2: stiffness_loss = 1\.4 must be less than or equal to 1"),
        ("tooth,stiffness_loss\n1,0.2\n2.5,0.1\n", r"row 2: tooth = 2\.5 must be a whole number"),
        ("tooth,stifness_loss\n1,0.2\n", r"column stifness_loss: no axis .*; did you mean 'stiffness_loss'\?"),
        ("tooth,tooth\n1,2\n", r"column tooth is there twice; remove one"),
        ("tooth,stiffness_loss\n1,0.2\n2\n", r"not a readable table \(.*Expected 2 columns, got 1"),
        ("tooth,stiffness_loss\n", r" has no rows; give at least one"),
        ("", r"not a readable table"),
    ],
)
def test_a_file_of_cases_is_refused_by_file_row_and_column(tmp_path, content, says):
    (tmp_path / "cases.csv").write_text(content, encoding="utf-8")
    recipe = tmp_path / "recipe.toml"
    recipe.write_text('[sweep]\nrig = "nasa-spiral-bevel"\n[[sweep.grid]]\ntable = "cases.csv"\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"recipe\.toml: sweep\.grid\.1: .*cases\.csv.*" + says):
        load_recipe(recipe)


def test_a_file_that_is_no_parquet_is_refused(tmp_path):
    (tmp_path / "cases.parquet").write_text("tooth\n1\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"cases\.parquet: not a readable table"):
        Grid(table=str(tmp_path / "cases.parquet"))


def test_a_list_without_teeth_is_refused(plan_of):
    """It would be a sweep without rows."""
    with pytest.raises(InputError, match=r"tooth"):
        plan_of(GRID + "tooth = []\n")


def test_a_sensor_named_twice_is_refused(plan_of):
    with pytest.raises(InputError, match=r"pinion-vertical"):
        plan_of(GRID + '[signature]\nsensors = ["pinion-vertical", "pinion-vertical"]\n')


def test_the_remedy_for_broken_tooth_cycles_works(plan_of):
    assert plan_of(GRID + "averages = 3\n").rows == 12
    assert plan_of(GRID + "pinion.teeth = 13\naverages = 108\n").rows == 13


@pytest.mark.parametrize(
    ("rig", "says"),
    [
        (
            "nasa-spiral-bevell",
            r"recipe\.toml: sweep\.rig: no built-in rig 'nasa-spiral-bevell'; did you mean 'nasa-spiral-bevel'",
        ),
        ("rigs/none.toml", r"recipe\.toml: sweep\.rig: .*none\.toml: no such file"),
    ],
)
def test_a_rig_that_does_not_exist(recipe_of, rig, says):
    with pytest.raises(InputError, match=says):
        recipe_of(f'[sweep]\nrig = "{rig}"\n' + GRID)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"[sweep\n", r"recipe\.toml: not valid TOML"),
        (b"\xff\xfe", r"recipe\.toml: not UTF-8 text"),
        (b"", r"recipe\.toml: sweep is missing; add it"),
        (b"sweep = 3\n", r"recipe\.toml: sweep = 3 must be"),
    ],
)
def test_a_file_that_is_no_recipe(tmp_path, content, says):
    (tmp_path / "recipe.toml").write_bytes(content)
    with pytest.raises(InputError, match=says):
        load_recipe(tmp_path / "recipe.toml")


def test_all_problems_of_a_recipe_are_named_at_once(recipe_of):
    text = """
[sweep]
rig = "none.toml"
specimens = 0
[[sweep.grid]]
stiffness_loss = [0.5, 1.5]
averages = 0
[[sweep.grid]]
stifness_loss = 0.5
[measurement]
averages = { min = 100, max = 200 }
snr_db = [1.0, 2.0]
"""
    with pytest.raises(InputError) as caught:
        recipe_of(text)
    lines = [line.split("recipe.toml: ", 1)[1] for line in str(caught.value).splitlines()]
    assert lines[:6] == [
        "measurement.averages is a range, and must be one number; a range of averages goes into [[sweep.grid]]",
        "measurement.snr_db is a list, and must be one number; a list of snr_db goes into [[sweep.grid]]",
        "sweep.specimens = 0 must be greater than or equal to 1",
        "sweep.grid.1: stiffness_loss = 1.5 must be less than or equal to 1",
        "sweep.grid.1: averages = 0 must be greater than or equal to 1",
        "unknown key sweep.grid.2.stifness_loss; did you mean 'stiffness_loss'?",
    ]
    assert lines[6].startswith("sweep.rig: ")
    assert len(lines) == 7


def test_all_problems_of_a_plan_are_named_at_once(recipe_of):
    text = """
[sweep]
rig = "nasa-spiral-bevel"
[[sweep.grid]]
stiffness_loss = 0.2
[[sweep.grid]]
damaged_teeth = [13, 14]
stiffness_loss = 0.2
[[sweep.grid]]
crack_depth = [0.001, 0.002]
[signature]
sensors = ["left", "right"]
[measurement]
averages = 7
"""
    with pytest.raises(InputError) as caught:
        recipe_of(text).plan()
    found = [line.split("recipe.toml: ", 1)[1] for line in str(caught.value).splitlines()]
    begins = [
        "signature.sensors: rig 'nasa-spiral-bevel' has no 'left'",
        "signature.sensors: rig 'nasa-spiral-bevel' has no 'right'",
        "sweep.grid.2: damaged_teeth = 13, but the gear has 12 teeth",
        "sweep.grid.3: crack_depth = 0.001 needs the geometry",
        "measurement.averages = 7 is not a whole number of tooth cycles",
    ]
    assert [line.startswith(begin) for line, begin in zip(found, begins, strict=True)] == [True] * 5


def test_a_recipe_that_does_not_exist(tmp_path):
    with pytest.raises(InputError, match=r"none\.toml: no such file"):
        load_recipe(tmp_path / "none.toml")
    with pytest.raises(InputError, match=r"cannot be read \(Is a directory\)"):
        load_recipe(tmp_path)
