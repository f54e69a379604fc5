"""Unit: cases off the grid lie between those of the plan, and whole numbers are those that it lists."""

import numpy as np
import pytest

from sigdb.core.errors import InputError
from sigdb.sweep import make_plan
from sigdb.sweep.density.off_grid import off_grid

FEW = "\n[signature]\nsamples_per_tooth = 32\nsensors = ['pinion-vertical']\n"
SPUR = '[sweep]\nrig = "spur-test-rig"\n'
TWO_STAGE = '[sweep]\nrig = "two-stage-gearbox"\n'


@pytest.fixture
def between(plan_of):
    """The plan of cases between those of a recipe, and the columns of its damaged templates."""

    def made(text, cases=200, seed=1):
        base = plan_of(text)
        design = off_grid(base, cases=cases, seed=seed, specimens=4)
        plan = make_plan(design, base.measurement, base.signature, base.rig, base_fields=base.damage_fields)
        frame = plan.table(0, plan.rows).drop_duplicates("template")
        return plan, frame[frame["tooth"] > 0], frame

    return made


def grid(lines):
    return f"[[sweep.grid]]\n{lines}\n"


def test_listed_numbers_are_spanned_and_whole_ones_kept(between):
    text = grid(
        "tooth = 'all'\nstiffness_loss = [0.4, 0.1, 0.2]\nphase_shift_deg = [-2.0, 1.0]\ndamaged_teeth = [1, 3]"
    )
    plan, cases, _ = between(text + FEW)
    assert len(cases) == 200
    assert cases["stiffness_loss"].between(0.1, 0.4).all()
    assert cases["phase_shift_deg"].between(-2, 1).all()
    # Of 100 even draws each, some lie within the outer tenths of the span.
    assert cases["stiffness_loss"].min() < 0.13 < 0.37 < cases["stiffness_loss"].max()
    assert cases["phase_shift_deg"].nunique() == 100
    assert cases["damaged_teeth"].value_counts().to_dict() == {1: 100, 3: 100}
    assert set(cases["tooth"]) == {1}
    assert set(cases["loss_extent"]) == {1.0}
    # A fourth as many undamaged rows a specimen: as many as cases.
    assert (plan.table(0, plan.rows)["tooth"] == 0).sum() == 200


def test_another_seed_is_another_sample(between):
    text = grid("stiffness_loss = [0.1, 0.4]") + FEW
    one, same, other = (between(text, seed=seed)[1]["stiffness_loss"].tolist() for seed in (1, 1, 2))
    assert one == same
    assert not {*one} & {*other}


def test_ranges_are_spanned_and_whole_ones_run_through(between):
    text = grid(
        "points = 5\nstiffness_loss = { min = 0.1, max = 0.3 }\npinion.teeth = { min = 11, max = 13 }\n"
        "operating.speed_rpm = { min = 9000.0, max = 12000.0 }\naverages = { min = 30, max = 120 }\n"
        "tooth = { min = 1, max = 11 }\nsnr_db = { min = -3.0, max = 3.0 }"
    )
    _, cases, every = between(text + FEW)
    assert cases["teeth"].value_counts().to_dict() == {11: 66, 12: 66, 13: 66}
    assert cases["speed_rpm"].between(9000, 12000).all()
    assert cases["speed_rpm"].nunique() == 66
    assert cases["snr_db"].between(-3, 3).all()
    # The same teeth of z and 36 meet again after lcm(z, 36) / z revolutions.
    for teeth, cycle in ((11, 36), (12, 3), (13, 36)):
        averages = cases.loc[cases["teeth"] == teeth, "averages"]
        assert averages.between(30, 120).all()
        assert (averages % cycle == 0).all()
    assert len(every) == 2 * len(cases)  # an undamaged row for each rig


def test_tables_are_spanned(between):
    text = grid(
        "[sweep.grid.table]\ntooth = [2, 11, 3]\npinion.teeth = [12, 11, 12]\nstiffness_loss = [0.1, 0.3, 0.2]\n"
        "operating.torque = [200.0, 200.0, 200.0]\ndamaged_teeth = [1, 1, 4]\naverages = [36, 72, 36]\n"
        "index_error = [1e-6, 1e-6, 1e-6]"
    )
    _, cases, _ = between(
        text.replace("pinion.teeth", '"pinion.teeth"').replace("operating.torque", '"operating.torque"') + FEW
    )
    assert cases.groupby(["teeth", "damaged_teeth"]).size().to_dict() == dict.fromkeys(
        [(11, 1), (11, 4), (12, 1), (12, 4)], 50
    )
    assert cases["stiffness_loss"].between(0.1, 0.3).all()
    assert set(cases["torque"]) == {200.0}
    assert set(cases["tooth"]) == {1}
    assert cases["averages"].between(36, 72).all()
    assert (cases["index_error"] == 1e-6).all()


def test_patterns_and_single_cases_are_left_out_but_their_columns_stay(between):
    """Axes that only such a grid names keep their column; one parameter of the rig is one column however written."""
    text = (
        grid("pattern = 'broken'\noperating.torque = [100.0, 300.0]")
        + grid("tooth = 2\nstiffness_loss = 0.2\ngears.pinion.teeth = 12\noperating.speed_rpm = 9000.0")
        + grid("tooth = 2\nstiffness_loss = [0.2, 0.3]\npinion.teeth = 12\nsnr_db = [0.0, 10.0]")
    )
    plan, cases, _ = between(text + FEW)
    assert len(cases) == 200
    assert not cases["pattern"].any()
    assert set(cases["torque"]) == {plan.rig.operating.torque}
    assert set(cases["speed_rpm"]) == {plan.rig.operating.speed_rpm}
    assert cases["stiffness_loss"].between(0.2, 0.3).all()
    assert set(plan.table(0, plan.rows)["snr_db"]) == {0.0, 10.0}


def test_several_grids_share_the_cases(between):
    text = grid("stiffness_loss = [0.1, 0.2]\npinion.teeth = 11\naverages = 36") + grid("phase_shift_deg = [1.0, 2.0]")
    _, cases, _ = between(text + FEW)
    assert cases["teeth"].value_counts().to_dict() == {11: 100, 12: 100}
    assert (cases.loc[cases["teeth"] == 12, "stiffness_loss"] == 0).all()
    assert (cases.loc[cases["teeth"] == 12, "phase_shift_deg"] >= 1).all()


def test_damage_by_geometry(between):
    text = SPUR + grid("tooth = [3, 4]\ncrack_depth = [0.0, 1e-3, 2e-3]\ncrack_angle_deg = [45.0, 70.0]")
    text += (
        grid("pit_diameter = 1e-3\npits = [1, 3]")
        + "\n[measurement]\naverages = 48\n[signature]\nsamples_per_tooth = 32\n"
    )
    plan, cases, _ = between(text)
    assert cases["crack_depth"].between(0, 2e-3).all()
    assert cases["crack_angle_deg"].between(45, 70).all()
    assert cases["crack_depth"].nunique() == 200
    # Whole numbers alone have nothing between, but they are columns of the database.
    assert set(cases["pit_diameter"]) == {0.0}
    assert {"pits", "pit_diameter"} <= set(plan.damage_fields)


def test_where_no_turn_is_exact_the_teeth_are_the_grids(between):
    teeth = "stiffness_loss = [0.1, 0.2]\n"
    signature = "\n[measurement]\naverages = 30\n[signature]\nsamples_per_tooth = 32\n"
    _, cases, _ = between(TWO_STAGE + grid(teeth + "tooth = [3, 5]") + signature)
    assert cases["tooth"].value_counts().to_dict() == {3: 100, 5: 100}
    _, cases, _ = between(TWO_STAGE + grid(teeth) + signature)
    assert cases["tooth"].value_counts().to_dict() == dict.fromkeys(range(1, 33), 6)  # 200 / 32 points
    _, cases, _ = between(TWO_STAGE + grid(teeth + "points = 4\ntooth = { min = 2, max = 3 }") + signature)
    assert set(cases["tooth"]) == {2, 3}


@pytest.mark.parametrize(
    "lines",
    [
        "stiffness_loss = 0.2",
        "pattern = ['broken', 'pitted']",
        "stiffness_loss = 0.2\ndamaged_teeth = [1, 2]\nsnr_db = [1.0, 2.0]",
        "stiffness_loss = 0.2\npinion.teeth = [12, 11]\naverages = 36",
    ],
)
def test_nothing_between(plan_of, lines):
    with pytest.raises(InputError, match="nothing lies between the cases: no grid has an axis with several values"):
        off_grid(plan_of(grid(lines) + FEW), cases=10, seed=1, specimens=4)


def test_of_many_whole_numbers_each_has_a_case(plan_of):
    base = plan_of(grid("stiffness_loss = [0.1, 0.2]\ndamaged_teeth = [1, 2, 3, 4]") + FEW)
    design = off_grid(base, cases=1, seed=1, specimens=4)
    assert design.grid[0].points == 1
    assert design.healthy == 1
    assert np.isin([1, 2, 3, 4], design.grid[0].damaged_teeth).all()
