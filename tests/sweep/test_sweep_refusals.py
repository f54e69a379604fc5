"""Unit: a design that does not fit is refused in a sentence that names the file, the key, the value and the remedy."""

import pytest

from sigdb.core.errors import InputError

GRID = "[[sweep.grid]]\nstiffness_loss = 0.2\n"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "[[sweep.grid]]\nstifness_loss = 0.4\n",
            r"unknown key sweep\.grid\.0\.stifness_loss; did you mean 'stiffness",
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
        (GRID + "damaged_teeth = 13\n", r"of 13 teeth does not fit a gear of 12 teeth"),
        (GRID + "damaged_teeth = 0\n", r"damaged_teeth = 0 must be 1 or more; undamaged rows come from healthy"),
        ("[[sweep.grid]]\nstiffness_loss = []\n", r"sweep\.grid\.0\.stiffness_loss is empty; give at least 1"),
        ("[[sweep.grid]]\nstiffness_loss = 1.5\n", r"stiffness_loss = 1\.5 must be less than or equal to 1"),
        ("[[sweep.grid]]\nstiffness_loss = nan\n", r"stiffness_loss\.0 = nan must be a finite number"),
        ('[[sweep.grid]]\nstiffness_loss = "half"\n', r"stiffness_loss\.0 = 'half' must be a valid number"),
        (GRID + "averages = 0\n", r"averages = 0 must be greater than or equal to 1"),
        (GRID + "index_error = -1.0\n", r"index_error = -1\.0 must be greater than or equal to 0"),
        (GRID + "averages = 4\n", r"averages = 4 is not a whole number .* every 3 revolutions; use for example 3"),
        (GRID + "pinion.teeth = 13\n", r"averages = 102 is not a whole number .* every 36 revolutions; use .* 108"),
        ('[[sweep.grid]]\npattern = "x"\n', r"pattern 'x' is not defined; define it under \[sweep\.patterns\]"),
        (
            '[[sweep.grid]]\npattern = "x"\nstiffness_loss = 0.2\n[sweep.patterns]\nx = [{ stiffness_loss = 0.2 }]\n',
            r"sweep\.grid\.0: pattern and stiffness_loss are given together",
        ),
        (GRID + "[sweep.patterns]\nx = [{}]\n", r"patterns\.x damages no tooth; give at least one tooth a loss"),
        (
            '[[sweep.grid]]\npattern = "x"\n[sweep.patterns]\nx = [{ stiffness_loss = 2.0 }]\n',
            r"sweep\.patterns\.x\.0\.stiffness_loss = 2\.0 must be less than or equal to 1",
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
        ("nasa-spiral-bevell", r"no built-in rig 'nasa-spiral-bevell'; did you mean 'nasa-spiral-bevel'"),
        ("rigs/none.toml", r"none\.toml: no such file"),
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
    from sigdb.pipeline import load_recipe

    (tmp_path / "recipe.toml").write_bytes(content)
    with pytest.raises(InputError, match=says):
        load_recipe(tmp_path / "recipe.toml")


def test_a_recipe_that_does_not_exist(tmp_path):
    from sigdb.pipeline import load_recipe

    with pytest.raises(InputError, match=r"none\.toml: no such file"):
        load_recipe(tmp_path / "none.toml")
    with pytest.raises(InputError, match=r"cannot be read \(Is a directory\)"):
        load_recipe(tmp_path)
