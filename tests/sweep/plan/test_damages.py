"""Unit: damage by the geometry of a spur tooth as axes of a sweep, and its columns."""

import numpy as np
import pytest

import sigdb
from sigdb.core.errors import InputError
from sigdb.sweep import run
from sigdb.sweep.plan.schema import plan_schema
from sigdb.transmission.damage import OPTIONAL_FIELDS

HEAD = '[sweep]\nrig = "spur-test-rig"\nhealthy = 1\n'
BEVEL = HEAD.replace("spur-test-rig", "nasa-spiral-bevel")
AVERAGES = "\n[measurement]\naverages = 48\n\n[signature]\nsamples_per_tooth = 32\n"
LOSS = "[[sweep.grid]]\ntooth = 1\nstiffness_loss = 0.2\n"
CRACKS = "[[sweep.grid]]\ntooth = [3, 4]\ncrack_depth = [0.0, 1e-3, 2e-3]\ncrack_angle_deg = [45.0, 70.0]\n"


def cases(plan):
    return [plan.case_columns(i) for i in range(plan.n_templates)]


def test_every_combination_of_sizes_and_none_that_means_nothing(plan_of):
    """Without a crack its angle means nothing: 2 depths x 2 angles, and the undamaged case once."""
    found = [(one["crack_depth"], one["crack_angle_deg"]) for one in cases(plan_of(HEAD + CRACKS + AVERAGES))]
    assert found == [(0.0, 70.0), (1e-3, 45.0), (1e-3, 70.0), (2e-3, 45.0), (2e-3, 70.0)]
    lossy = cases(plan_of(HEAD + CRACKS.replace(", 2e-3", "") + "stiffness_loss = 0.2\n" + AVERAGES))[1:]
    assert [(one["crack_depth"], one["crack_angle_deg"]) for one in lossy] == [(0.0, 70.0), (1e-3, 45.0), (1e-3, 70.0)]


def test_only_damage_that_is_swept_has_columns(plan_of):
    both = "[[sweep.grid]]\ntooth = 1\nwear_depth = 1e-5\nstiffness_loss = 0.1\n" + CRACKS
    for grid, expected in ((LOSS, set()), (both, {"wear_depth", "crack_depth", "crack_angle_deg"})):
        plan = plan_of(HEAD + grid + AVERAGES)
        for columns in (plan_schema(plan).arrow("features").names, cases(plan)[0]):
            assert set(columns) & set(OPTIONAL_FIELDS) == expected
            assert {"phase_shift_deg", "stiffness_loss", "loss_extent"} <= set(columns)


def test_columns_say_units_and_counts_are_whole(plan_of):
    grid = "[[sweep.grid]]\ntooth = 1\npit_diameter = 1e-3\npits = [1, 3]\n"
    schema = plan_schema(plan_of(HEAD + grid + AVERAGES)).arrow("templates")
    assert str(schema.field("pits").type) == "int32"
    assert schema.field("pit_diameter").metadata[b"unit"] == b"m"


def test_naming_a_size_of_zero_keeps_the_hash(plan_of):
    plain = plan_of(HEAD + LOSS + AVERAGES)
    named = plan_of(HEAD + LOSS + "crack_depth = 0.0\npits = 1\n" + AVERAGES)
    assert named.hash == plain.hash
    assert not set(plain.resolved["sweep"]["grid"][0]) & set(OPTIONAL_FIELDS)
    assert plan_of(HEAD + LOSS + "crack_depth = 1e-4\n" + AVERAGES).hash != plain.hash


def test_rows_carry_the_sizes_and_the_damage_changes_the_signal(plan_of, tmp_path):
    text = HEAD + CRACKS.replace(", 2e-3", "").replace("45.0, ", "") + AVERAGES
    run(plan_of(text), tmp_path / "db", recipe=text, jobs=1)
    database = sigdb.open(tmp_path / "db")
    rows = database.cases()
    assert rows["status"].tolist() == ["ok"] * 3
    assert rows["crack_depth"].tolist() == [0.0, 1e-3, 1e-3]
    assert rows["tooth"].tolist() == [0, 3, 4]
    tsa = np.array(database.sql("select tsa from templates order by template")["tsa"].tolist())
    assert np.ptp(tsa[1] - tsa[0]) > 0.01 * np.ptp(tsa[0])


@pytest.mark.parametrize(
    ("head", "axis", "message"),
    [
        (BEVEL, "crack_depth = 1e-3", r"crack_depth = 0\.001 needs the geometry of the teeth"),
        (HEAD, "pit_diameter = 1e-2\npits = 2", r"pits = 2 of pit_diameter = 0\.01 do not fit in a row"),
        (HEAD, "crack_angle_deg = 100.0\ncrack_depth = 1e-3", r"crack_angle_deg = 100\.0 must be less than or equal"),
        (BEVEL, "flank_deviation = [1e-5, 0.02]", r"flank_deviation = 0\.02 must be less than or equal to 0\.01"),
        (BEVEL, "flank_deviation = 1e-5\ndeviation_extent = 1.5", r"deviation_extent = 1\.5 must be less"),
        (HEAD, "pattern = 'p'\nwear_depth = 1e-5", "pattern and wear_depth are given together"),
    ],
)
def test_damage_that_does_not_fit_is_refused_before_anything_is_simulated(plan_of, head, axis, message):
    patterns = "[sweep.patterns]\np = [{ wear_depth = 1e-5 }]\n"
    with pytest.raises(InputError, match=message):
        plan_of(f"{head}[[sweep.grid]]\ntooth = 1\n{axis}\n{patterns}{AVERAGES}")


def test_a_deviation_of_the_flank_is_an_axis_of_any_rig_and_a_column_in_metres(plan_of):
    """Its extent and place mean nothing without it."""
    grid = "[[sweep.grid]]\ntooth = 1\nflank_deviation = [0.0, 5e-5, -1e-5]\ndeviation_extent = [0.2, 1.0]\n"
    plan = plan_of(BEVEL + grid + AVERAGES)
    found = [(one["flank_deviation"], one["deviation_extent"]) for one in cases(plan)]
    assert found == [(0.0, 1.0), (5e-5, 0.2), (5e-5, 1.0), (-1e-5, 0.2), (-1e-5, 1.0)]
    assert plan_schema(plan).arrow("features").field("flank_deviation").metadata[b"unit"] == b"m"


def test_teeth_of_a_pattern_may_be_damaged_by_geometry(plan_of):
    pattern = "[sweep.patterns]\np = [{ chip_height = 1e-3 }, { crack_depth = 1e-3 }]\n"
    grid = "[[sweep.grid]]\ntooth = 1\npattern = 'p'\n" + pattern
    plan = plan_of(HEAD + grid + AVERAGES)
    (case,) = (one for one in cases(plan) if one["pattern"])
    assert case["stiffness_loss"] is None
    assert not set(case) & set(OPTIONAL_FIELDS)
