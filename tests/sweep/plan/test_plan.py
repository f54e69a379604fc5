"""Unit: a plan is a pure function of the recipe, and a row's id is arithmetic."""

import itertools
import tomllib
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sigdb.core.streams import NOISE_BLOCK
from sigdb.sweep.plan.plan import rows_of_a_part

BUILT_IN = Path(__file__).parents[3] / "data" / "transmissions" / "nasa_spiral_bevel.toml"


def rows_of(plan):
    return plan.table(0, plan.rows)


def test_the_same_recipe_gives_the_same_plan(plan_of, small_plan, small_run):
    from_file = plan_of(tomllib.loads((small_run[0] / "sigdb.toml").read_text(encoding="utf-8"))["recipe"])
    assert from_file.hash == small_plan.hash
    pd.testing.assert_frame_equal(rows_of(from_file), rows_of(small_plan))


GRID = "[[sweep.grid]]\nstiffness_loss = 0.2\n"


@pytest.mark.parametrize(
    "other",
    [
        "seed = 1\n" + GRID,
        "specimens = 2\n" + GRID,
        "runout = 3.8\n" + GRID,
        GRID.replace("0.2", "0.3"),
        GRID + "[measurement]\nsnr_db = 1.0\n",
        GRID + "[signature]\nsamples_per_tooth = 32\n",
        GRID + "operating.torque = 300.0\n",
        'gear = "gear"\n' + GRID,
    ],
)
def test_whatever_changes_rows_changes_the_hash(plan_of, other):
    assert plan_of(other).hash != plan_of(GRID).hash


@pytest.mark.parametrize(
    "same",
    [
        "# a comment\n" + GRID,
        GRID + '[recognition]\nlearner = "lda"\n',
        GRID + "tooth = 'all'\n",
        'gear = "pinion"\n' + GRID,
        "runout = 0.0\n" + GRID,
        GRID + "[measurement]\naverages = 102\n",
    ],
)
def test_what_changes_no_row_keeps_the_hash(plan_of, same):
    assert plan_of(same).hash == plan_of(GRID).hash


@given(st.lists(st.integers(0, 500), min_size=1, max_size=8))
@settings(max_examples=8, deadline=None)
def test_any_ranges_of_the_table_join_to_the_whole(small_plan, cuts):
    edges = sorted({0, small_plan.rows, *(cut for cut in cuts if cut < small_plan.rows)})
    pieces = [small_plan.table(start, stop) for start, stop in itertools.pairwise(edges)]
    joined = pd.concat(pieces, ignore_index=True)
    pd.testing.assert_frame_equal(joined, rows_of(small_plan), check_dtype=False)


def test_ids_are_consecutive(small_plan):
    assert rows_of(small_plan)["id"].tolist() == list(range(small_plan.rows))


def test_every_combination_is_there_once(plan_of):
    plan = plan_of(
        "specimens = 2\ndraws = 3\n[[sweep.grid]]\ntooth = [2, 5]\ndamaged_teeth = [1, 3]\n"
        "phase_shift_deg = [0.0, 1.0]\nstiffness_loss = [0.0, 0.2]\nloss_extent = 0.5\nsnr_db = [0.0, 6.0]\n"
        "averages = [3, 6]\nindex_error = 1e-6\noperating.torque = [200.0, 300.0]\n"
    )
    expected = {
        (torque, tooth, count, shift, loss, snr, averages, specimen, draw)
        for torque, tooth, count, shift, loss, snr, averages, specimen, draw in itertools.product(
            (200.0, 300.0), (2, 5), (1, 3), (0.0, 1.0), (0.0, 0.2), (0.0, 6.0), (3, 6), range(2), range(3)
        )
        if shift or loss
    }
    rows = rows_of(plan)
    names = ["torque", "tooth", "damaged_teeth", "phase_shift_deg", "stiffness_loss", "snr_db", "averages"]
    found = list(zip(*(rows[name].tolist() for name in [*names, "specimen", "draw"]), strict=True))
    assert len(found) == len(expected)
    assert set(found) == expected
    # The extent of no loss means nothing, so it is told as 1.
    assert rows["loss_extent"].tolist() == [0.5 if loss else 1.0 for loss in rows["stiffness_loss"]]
    assert set(rows["index_error"]) == {1e-6}


def test_healthy_rows_are_made_for_each_specimen_and_measurement(plan_of):
    plan = plan_of(
        "specimens = 3\nhealthy = 4\n[[sweep.grid]]\ntooth = 1\nstiffness_loss = [0.0, 0.2]\nsnr_db = [0.0, 6.0]\n"
        "operating.speed_rpm = [12000.0, 14400.0]\n"
    )
    rows = rows_of(plan)
    healthy = rows[rows["tooth"] == 0]
    groups = healthy.groupby(["speed_rpm", "snr_db", "specimen"])["draw"].apply(sorted)
    assert len(groups) == 2 * 2 * 3
    assert all(draws == [0, 1, 2, 3] for draws in groups)
    for label in ("damaged_teeth", "phase_shift_deg", "stiffness_loss"):
        assert (healthy[label] == 0).all()
    assert len(rows) - len(healthy) == 2 * 2 * 3


def test_healthy_alone_is_a_sweep(plan_of):
    plan = plan_of("healthy = 5\n[[sweep.grid]]\n")
    assert rows_of(plan)["tooth"].tolist() == [0] * 5
    assert plan.n_templates == 1


@pytest.mark.parametrize(
    "text",
    [
        GRID + "tooth = [1, 2]\n" + GRID + "tooth = [3, 4]\n",
        GRID + "operating.torque = [200.0, 356.05]\n" + GRID,
        GRID + "pinion.teeth = 12\n" + GRID + "gears.pinion.teeth = 12\n",
        "[[sweep.grid]]\nphase_shift_deg = 1.0\nstiffness_loss = [0.0, 0.5]\nloss_extent = [0.2, 1.0]\n",
    ],
    ids=["same damage", "same operating point", "two names of one path", "extent of no loss"],
)
def test_templates_are_distinct_cases(plan_of, text):
    """Templates hold each distinct case once, so equal rigs with equal damage share one."""
    plan = plan_of(text)
    cases = [
        (
            plan.rig_points[template.rig_point].rig.model_dump_json(),
            tuple(
                (tooth, one.phase_shift_deg, one.stiffness_loss, one.loss_extent if one.stiffness_loss else None)
                for tooth, one in template.damage.on_teeth(12).items()
            ),
        )
        for template in plan.cases()
    ]
    assert len(set(cases)) == len(cases)


def test_a_sweep_is_the_union_of_its_grids(plan_of):
    """A case that two grids name is in the union once."""
    rows = rows_of(plan_of("healthy = 2\n" + GRID + GRID + "tooth = 6\noperating.torque = 356.05\n"))
    assert len(rows) == 2 + 12
    assert not rows.drop(columns=["id", "template"]).duplicated().any()


@given(st.integers(0, 10**8))
def test_the_size_of_a_part_follows_from_the_number_of_rows(rows):
    part_rows = rows_of_a_part(rows)
    assert part_rows % NOISE_BLOCK == 0
    assert 2048 <= part_rows <= 32768
    # Whole parts for sixteen workers, wherever parts are not at a limit.
    assert part_rows == 2048 or rows / part_rows > 7


def test_documented_parts_of_large_sweeps(plan_of):
    """10^6 rows are 31 parts of 32768, 10^8 are 3052."""
    for draws, parts in ((10**6 // 4, 31), (10**8 // 4, 3052)):
        large = plan_of(f"draws = {draws}\n" + GRID + "tooth = [1, 2, 3, 4]\n")
        assert (large.rows, large.part_rows, large.row_parts) == (4 * draws, 32768, parts)


def test_all_teeth_are_those_of_the_gear(plan_of):
    assert rows_of(plan_of(GRID))["tooth"].tolist() == list(range(1, 13))
    assert rows_of(plan_of('gear = "gear"\n' + GRID))["tooth"].tolist() == list(range(1, 37))
    assert rows_of(plan_of(GRID + "tooth = [7, 3]\n"))["tooth"].tolist() == [7, 3]
    assert rows_of(plan_of(GRID + "tooth = 7\n"))["tooth"].tolist() == [7]


def test_swept_tooth_counts_have_their_own_teeth(plan_of):
    rows = rows_of(plan_of(GRID + "pinion.teeth = [11, 12, 13]\naverages = 108\n"))
    for teeth, some in rows.groupby("teeth"):
        assert sorted(some["tooth"]) == list(range(1, teeth + 1))
    assert set(rows["teeth"]) == {11, 12, 13}
    assert "pinion.teeth" not in rows


@pytest.mark.parametrize(
    "axis",
    [
        "operating.torque = [200.0, 300.0]",
        '"operating.torque" = [200.0, 300.0]',
        "operating = { torque = [200.0, 300.0] }",
        'rig = { "operating.torque" = [200.0, 300.0] }',
    ],
)
def test_axes_over_the_rig_by_dotted_path(plan_of, axis):
    plan = plan_of(GRID + "tooth = 1\n" + axis)
    assert rows_of(plan)["torque"].tolist() == [200.0, 300.0]
    assert [point.rig.operating.torque for point in plan.rig_points] == [200.0, 300.0]


def test_other_parameters_of_the_rig_are_columns_by_their_path(plan_of):
    plan = plan_of(GRID + "tooth = 1\n" + GRID + "tooth = 2\nmain.stiffness = [2.0e8, 2.1e8]\n")
    assert plan.swept == ("main.stiffness",)
    assert rows_of(plan)["main.stiffness"].tolist() == [2.2e8, 2.0e8, 2.1e8]


def test_one_value_is_an_axis_of_one_point(plan_of):
    listed = plan_of("[[sweep.grid]]\ntooth = [3]\nphase_shift_deg = [1.0]\ndamaged_teeth = [2]\npinion.teeth = [12]\n")
    scalar = plan_of("[[sweep.grid]]\ntooth = 3\nphase_shift_deg = 1.0\ndamaged_teeth = 2\npinion.teeth = 12\n")
    assert scalar.hash == listed.hash


def test_patterns(small_plan):
    rows = rows_of(small_plan)
    patterned = rows[rows["pattern"] == "both"]
    assert set(patterned["tooth"]) == {3, 12}
    assert (patterned["damaged_teeth"] == 3).all()
    assert patterned[["phase_shift_deg", "stiffness_loss", "loss_extent"]].isna().all(axis=None)
    (damage,) = {case.damage for case in small_plan.cases() if case.damage.pattern}
    assert [(one.phase_shift_deg, one.stiffness_loss, one.loss_extent) for one in damage.each] == [
        (0.0, 0.4, 0.2),
        (0.0, 0.0, 1.0),
        (1.0, 0.0, 1.0),
    ]


def test_every_template_is_at_tooth_1_or_healthy(small_plan):
    assert {case.damage.tooth for case in small_plan.cases()} == {0, 1}
    # Four operating points or tooth counts, each with its healthy template; 6 + 1 + 1 + 1 + 1 kinds of damage.
    assert sum(case.damage.tooth == 0 for case in small_plan.cases()) == 4
    assert small_plan.n_templates == 4 + 10


@pytest.mark.parametrize("name", ["x", "title", "sources"])
def test_a_pattern_counts_whatever_its_name(plan_of, name):
    """Titles and sources of a rig's numbers are left out of the hash; a pattern of such a name is not."""
    text = '[[sweep.grid]]\npattern = "{0}"\n[sweep.patterns]\n{0} = [{{ stiffness_loss = {1} }}]\n'
    assert plan_of(text.format(name, 0.2)).hash != plan_of(text.format(name, 0.4)).hash


def test_sources_and_title_of_a_rig_change_no_row(plan_of, tmp_path):
    text = BUILT_IN.read_text(encoding="utf-8")
    renamed = text.replace('title = "', 'title = "A better name: ')
    reworded = renamed.replace("published: the paper", "published: measured")
    assert reworded.count("measured") > 1
    (tmp_path / "rig.toml").write_text(reworded, encoding="utf-8")
    recipe = f'[sweep]\nrig = "{(tmp_path / "rig.toml").as_posix()}"\n' + GRID
    assert plan_of(recipe).hash == plan_of(GRID).hash
