"""Unit: sampled and tabulated designs, crossed with listed axes, are the cases that they say."""

import itertools

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

import sigdb
from sigdb.core.errors import InputError
from sigdb.measurement import MeasurementSettings
from sigdb.signature.settings import SignatureSettings
from sigdb.sweep import Grid, SweepSettings, make_plan, run
from sigdb.sweep.plan.schema import plan_schema
from sigdb.transmission import Transmission

HEAD = '[sweep]\nrig = "nasa-spiral-bevel"\n'
OPERATING = (
    "operating.speed_rpm = { min = 6000, max = 15000 }\noperating.torque = { min = 200.0, max = 400.0 }\npoints = 25\n"
)


def rows_of(plan):
    return plan.table(0, plan.rows)


def set_of(frame, names):
    return set(zip(*(frame[name].tolist() for name in names), strict=True))


@pytest.mark.parametrize("method", ["random", "latin-hypercube", "sobol"])
def test_sampled_operating_points_times_a_grid_of_damage_times_all_teeth(plan_of, method):
    plan = plan_of(
        f'specimens = 2\nhealthy = 3\n[[sweep.grid]]\n{OPERATING}method = "{method}"\nstiffness_loss = [0.1, 0.2]\n'
    )
    assert plan.rows == 25 * 2 * 12 * 2 + 25 * 3 * 2
    assert plan.n_templates == 25 * (1 + 2)
    rows = rows_of(plan)
    points = set_of(rows, ["speed_rpm", "torque"])
    assert len(points) == 25
    damaged = rows[rows["tooth"] > 0]
    assert set_of(damaged, ["speed_rpm", "torque", "tooth", "stiffness_loss"]) == {
        (*point, tooth, loss) for point, tooth, loss in itertools.product(points, range(1, 13), (0.1, 0.2))
    }
    assert rows["speed_rpm"].between(6000, 15000).all()
    assert rows["torque"].between(200, 400).all()
    if method == "latin-hypercube":
        speed = np.array(sorted(point[0] for point in points))
        assert np.floor((speed - 6000) / 9000 * 25).tolist() == list(range(25))


def test_the_method_is_latin_hypercube_where_none_is_given(plan_of):
    text = f"[[sweep.grid]]\n{OPERATING}stiffness_loss = 0.1\n"
    assert plan_of(text).hash == plan_of(text + 'method = "latin-hypercube"\n').hash
    assert plan_of(text).hash != plan_of(text + 'method = "sobol"\n').hash


def test_one_sample_over_damage_rig_and_measurement_together(plan_of):
    text = (
        "[[sweep.grid]]\ntooth = { min = 1, max = 12 }\ndamaged_teeth = { min = 1, max = 3 }\n"
        "stiffness_loss = { min = 0.05, max = 0.5 }\nmain.stiffness = { min = 2e8, max = 2.4e8 }\n"
        "snr_db = { min = -10, max = 10 }\npoints = 48\n"
    )
    rows = rows_of(plan_of(text))
    assert len(rows) == 48
    # One point in each of 48 strata: each of 12 teeth 4 times, each of 3 counts 16 times.
    assert rows["tooth"].value_counts().to_dict() == dict.fromkeys(range(1, 13), 4)
    assert rows["damaged_teeth"].value_counts().to_dict() == dict.fromkeys((1, 2, 3), 16)
    for name in ("stiffness_loss", "main.stiffness", "snr_db"):
        assert rows[name].nunique() == 48
    correlation = np.corrcoef(rows["stiffness_loss"], rows["snr_db"])[0, 1]
    assert abs(correlation) < 5 / np.sqrt(48)


def test_the_seed_chooses_the_sample_and_the_grid_too(plan_of):
    grid = "[[sweep.grid]]\ntooth = 1\nstiffness_loss = { min = 0.1, max = 0.5 }\npoints = 8\n"
    first, second = np.split(rows_of(plan_of(grid * 2))["stiffness_loss"].to_numpy(), 2)
    assert not np.isin(first, second).any()
    assert rows_of(plan_of(grid))["stiffness_loss"].tolist() == first.tolist()
    assert not np.isin(first, rows_of(plan_of("seed = 1\n" + grid))["stiffness_loss"]).any()


def test_the_order_in_which_axes_are_written_changes_nothing(plan_of):
    lines = ["tooth = 1", "stiffness_loss = { min = 0.1, max = 0.5 }", "operating.torque = { min = 1, max = 9 }"]
    lines += ["points = 5", "operating.speed_rpm = [6000.0, 9000.0]", "pinion.runout = [0.0, 1e-6]"]
    forth, back = (plan_of("[[sweep.grid]]\n" + "\n".join(one) + "\n") for one in (lines, lines[::-1]))
    assert forth.hash == back.hash
    pd.testing.assert_frame_equal(rows_of(forth), rows_of(back))


def test_swept_tooth_counts_by_a_range(plan_of):
    plan = plan_of(
        "[[sweep.grid]]\npinion.teeth = { min = 11, max = 13 }\npoints = 9\nstiffness_loss = 0.2\naverages = 36\n"
    )
    rows = rows_of(plan)
    # Nine points stand for three tooth counts, and a case counts once.
    assert len(plan.rig_points) == 3
    assert rows.groupby("teeth").size().to_dict() == {11: 11, 12: 12, 13: 13}


def test_the_tooth_count_of_the_mate_is_an_axis_too(plan_of):
    plan = plan_of("[[sweep.grid]]\ntooth = 1\ngear.teeth = [24, 36]\nstiffness_loss = 0.2\naverages = 6\n")
    assert [point.mate_teeth for point in plan.rig_points] == [24, 36]
    assert plan.swept == ("gear.teeth",)
    assert rows_of(plan)["gear.teeth"].tolist() == [24.0, 36.0]


def test_averages_of_a_range_are_whole_tooth_cycles(plan_of):
    """12 and 36 teeth meet again after 3 revolutions, 13 and 36 after 36: 3 to 100 holds 33 and 2 multiples of them."""
    plan = plan_of(
        "[[sweep.grid]]\ntooth = 1\nstiffness_loss = 0.2\npinion.teeth = [12, 13]\n"
        "averages = { min = 2, max = 100 }\npoints = 66\n"
    )
    rows = rows_of(plan)
    found = {teeth: sorted(set(one["averages"])) for teeth, one in rows.groupby("teeth")}
    assert found == {12: list(range(3, 100, 3)), 13: [36, 72]}
    assert not rows.drop(columns="id").duplicated().any()


TABLE = "tooth,stiffness_loss,operating.torque,snr_db,averages\n1,0.2,200,-10,3\n6,0.4,300.5,0,102\n6,0.4,300.5,5,102\n"


@pytest.fixture
def files(tmp_path):
    """A recipe whose table is a file beside it, as CSV or Parquet, or columns."""
    (tmp_path / "cases.csv").write_text(TABLE, encoding="utf-8")
    frame = pd.read_csv(tmp_path / "cases.csv")
    frame.to_parquet(tmp_path / "cases.parquet")
    columns = ", ".join(f'"{name}" = {frame[name].tolist()}' for name in frame)

    def plan(table):
        path = tmp_path / "recipe.toml"
        text = {"csv": '"cases.csv"', "parquet": '"cases.parquet"', "columns": f"{{ {columns} }}"}[table]
        path.write_text(f"{HEAD}[[sweep.grid]]\ntable = {text}\ndamaged_teeth = [1, 2]\n", encoding="utf-8")
        return sigdb.pipeline.load_recipe(path).plan()

    return plan


def test_a_table_is_its_rows_crossed_with_what_is_listed(files):
    rows = rows_of(files("csv"))
    assert set_of(rows, ["tooth", "stiffness_loss", "torque", "snr_db", "averages", "damaged_teeth"]) == {
        (*row, count)
        for row in [(1, 0.2, 200.0, -10.0, 3), (6, 0.4, 300.5, 0.0, 102), (6, 0.4, 300.5, 5.0, 102)]
        for count in (1, 2)
    }


def test_files_and_columns_are_one_plan_and_the_content_is_resolved(files):
    plans = [files(one) for one in ("csv", "parquet", "columns")]
    assert len({plan.hash for plan in plans}) == 1
    assert plans[0].resolved["sweep"]["grid"][0]["table"]["operating.torque"] == [200.0, 300.5, 300.5]
    assert "cases.csv" not in str(plans[0].resolved)


def test_a_table_of_a_product_is_that_grid(plan_of):
    """Explicit points of a full product, in the order of the axes, are the rows of the grid."""
    torque, loss, shift = [200.0, 300.0], [0.1, 0.2], [0.0, 1.5, 3.0]
    points = list(itertools.product(torque, shift, loss))
    columns = {
        name: [point[i] for point in points]
        for i, name in enumerate(("operating.torque", "phase_shift_deg", "stiffness_loss"))
    }
    named = ", ".join(f'"{name}" = {values}' for name, values in columns.items())
    grid = plan_of(
        f"specimens = 2\nhealthy = 1\n[[sweep.grid]]\noperating.torque = {torque}\nstiffness_loss = {loss}\n"
        f"phase_shift_deg = {shift}\n"
    )
    table = plan_of(f"specimens = 2\nhealthy = 1\n[[sweep.grid]]\ntable = {{ {named} }}\n")
    pd.testing.assert_frame_equal(rows_of(table), rows_of(grid))
    assert table.hash != grid.hash


def test_patterns_in_a_table(plan_of):
    plan = plan_of('[[sweep.grid]]\ntable = { pattern = ["pitted", "worn", "broken"], tooth = [3, 4, 5] }\n')
    rows = rows_of(plan)
    assert set_of(rows, ["pattern", "tooth", "damaged_teeth"]) == {("pitted", 3, 1), ("worn", 4, 12), ("broken", 5, 1)}


def test_tables_and_arrays_in_python():
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    grid = Grid(table={"stiffness_loss": np.array([0.1, 0.2]), "tooth": np.array([1, 2])})
    plan = make_plan(SweepSettings(rig=rig.name, grid=[grid]), MeasurementSettings(), SignatureSettings(), rig)
    assert rows_of(plan)["stiffness_loss"].tolist() == [0.1, 0.2]


def test_a_sample_that_repeats_a_grid_adds_nothing(plan_of):
    """The union: tooth 1 to 12 by a range are cases that the first grid has already."""
    listed = "[[sweep.grid]]\nstiffness_loss = 0.2\n"
    sampled = listed + "tooth = { min = 1, max = 12 }\npoints = 30\n"
    pd.testing.assert_frame_equal(rows_of(plan_of(listed + sampled)), rows_of(plan_of(listed)))
    pd.testing.assert_frame_equal(rows_of(plan_of(sampled)).sort_values("tooth")[["tooth"]].reset_index(drop=True),
                                  rows_of(plan_of(listed))[["tooth"]])  # fmt: skip


def test_joint_measurements_of_one_case_share_its_template(plan_of):
    plan = plan_of(
        "healthy = 2\n[[sweep.grid]]\ntooth = [1, 2]\nstiffness_loss = [0.1, 0.2]\nsnr_db = { min = -10, max = 10 }\n"
        "index_error = { min = 0, max = 1e-5 }\npoints = 10\n"
    )
    assert (plan.n_templates, plan.rows) == (3, 10 * 2 * 2 + 10 * 2)
    rows = rows_of(plan)
    pairs = rows.groupby(["template", "tooth"])[["snr_db", "index_error"]].apply(lambda one: set_of(one, one))
    assert all(one == pairs.iloc[0] and len(one) == 10 for one in pairs)


def test_planning_a_hundred_thousand_cases_builds_no_object_for_each(monkeypatch):
    """What costs microseconds in arrays costs minutes in objects: count those that are built."""
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    built = {"rigs": 0}
    replace = Transmission.replace

    def counted(self, values):
        built["rigs"] += 1
        return replace(self, values)

    monkeypatch.setattr(Transmission, "replace", counted)
    grid = {
        "operating": {"speed_rpm": {"min": 6000, "max": 15000}, "torque": {"min": 200, "max": 400}},
        "stiffness_loss": {"min": 0.05, "max": 0.5},
        "points": 100_000,
    }
    plan = make_plan(
        SweepSettings(rig=rig.name, specimens=10, grid=[grid]), MeasurementSettings(), SignatureSettings(), rig
    )
    assert (plan.n_templates, plan.rows, len(plan.rig_points)) == (200_000, 12_000_000, 100_000)
    assert built["rigs"] < 10
    arrays = [plan.templates, plan.row_runs, plan.damages, plan.rig_points]
    held = sum(one.nbytes for part in arrays for one in vars(part).values() if isinstance(one, np.ndarray))
    assert held < 200 * plan.n_templates
    last = plan.table(plan.rows - 10, plan.rows)
    assert plan.case(int(last["template"].iloc[-1])).damage.stiffness_loss == last["stiffness_loss"].iloc[-1]
    point = plan.rig_points[plan.case(int(last["template"].iloc[-1])).rig_point]
    assert point.rig.operating.torque == last["torque"].iloc[-1]


def test_columns_of_swept_parameters_carry_unit_and_help_of_their_field(plan_of):
    plan = plan_of("[[sweep.grid]]\ntooth = 1\nstiffness_loss = 0.2\nmain.stiffness = [2e8, 2.1e8]\ngear.teeth = 36\n")
    schema = plan_schema(plan).arrow("features")
    assert schema.field("main.stiffness").metadata[b"unit"] == b"N/m"
    assert b"Swept parameter of the rig. Tooth count." in schema.field("gear.teeth").metadata[b"description"]


def test_a_sampled_sweep_runs_and_its_rows_are_simulations(plan_of, tmp_path):
    text = (
        "seed = 5\n[[sweep.grid]]\ntooth = { min = 1, max = 12 }\nstiffness_loss = { min = 0.1, max = 0.4 }\n"
        "operating.speed_rpm = { min = 9000, max = 15000 }\npoints = 3\nsnr_db = 300.0\nindex_error = 0.0\n"
        '[signature]\nsamples_per_tooth = 32\nsensors = ["pinion-vertical"]\n'
    )
    run(plan_of(text), tmp_path / "db", jobs=1)
    database = sigdb.open(tmp_path / "db")
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    for row in database.cases().itertuples():
        damage = sigdb.Damage(tooth=int(row.tooth), stiffness_loss=row.stiffness_loss)
        solver = sigdb.Periodic(samples_per_tooth=32)
        response = sigdb.simulate(rig.replace({"operating.speed_rpm": row.speed_rpm}), damage, solver=solver)
        expected = response.signal("pinion-vertical")
        tsa = database.signals([row.id])["tsa"][0]
        assert_allclose(tsa, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def test_more_cases_than_a_plan_holds_are_refused_before_they_are_made(plan_of):
    losses = ", ".join(str(i / 10_000) for i in range(5000))
    with pytest.raises(InputError, match=r"sweep\.grid\.1 has 25000000 cases of damage, and the limit is 20000000"):
        plan_of(f"[[sweep.grid]]\nstiffness_loss = [{losses}]\nfriction = [{losses}]\n")
