"""Unit: the plan of a database again from its resolved recipe, and plans that extend a database."""

import pickle
import tomllib

import numpy as np
import pandas as pd
import pytest
import tomli_w

import sigdb
from sigdb.core.errors import DatabaseError
from sigdb.measurement import MeasurementSettings
from sigdb.signature.settings import SignatureSettings
from sigdb.sweep import SweepSettings, make_plan, plan_from
from sigdb.transmission import built_in_transmissions

HEAD = '[sweep]\nrig = "nasa-spiral-bevel"\nseed = 4\nspecimens = 2\nhealthy = 3\n'
GRID = "[[sweep.grid]]\nstiffness_loss = 0.2\n"
RANGES = (
    "[[sweep.grid]]\nstiffness_loss = { min = 0.1, max = 0.5 }\noperating.torque = { min = 200, max = 400 }\n"
    "tooth = { min = 1, max = 12 }\npoints = 6\nmethod = 'sobol'\nsnr_db = [0.0, 3.0]\n"
)
TEXTS = {
    "grid": GRID + "operating.torque = [100.0, 200.0]\n",
    "ranges": RANGES,
    "averages": GRID + "averages = { min = 3, max = 30 }\npoints = 4\n",
    "table": "[[sweep.grid]]\ntable = { tooth = [1, 6], stiffness_loss = [0.2, 0.4], operating.torque = [9, 200.5] }\n",
    "union": GRID + RANGES,
    "patterns": '[[sweep.grid]]\npattern = ["own", "pitted"]\n[sweep.patterns]\nown = [{ stiffness_loss = 0.3 }, {}]\n',
    "worn on other tooth counts": '[[sweep.grid]]\npattern = "worn"\npinion.teeth = [11, 13]\naverages = 36\n',
    "other gear": 'gear = "gear"\n' + GRID,
}


def stored(resolved):
    """A resolved recipe after it has been in a TOML file, which holds no null."""

    def without_none(value):
        if isinstance(value, dict):
            return {key: without_none(item) for key, item in value.items() if item is not None}
        return [without_none(item) for item in value] if isinstance(value, list) else value

    return tomllib.loads(tomli_w.dumps(without_none(resolved)))


def assert_same(one, other):
    assert one.hash == other.hash
    pd.testing.assert_frame_equal(
        one.table(one.first_row, one.first_row + one.rows), other.table(other.first_row, other.first_row + other.rows)
    )
    assert [*one.cases()] == [*other.cases()]


@pytest.mark.parametrize("name", TEXTS)
def test_a_plan_is_made_again_from_its_database(plan_of, name):
    plan = plan_of(HEAD + TEXTS[name])
    assert_same(plan_from(stored(plan.resolved)), plan)


GEARED = [name for name in built_in_transmissions() if sigdb.load_transmission(name).meshes]


@pytest.mark.parametrize("name", GEARED)
def test_a_plan_is_made_again_for_every_rig(name):
    rig = sigdb.load_transmission(name)
    design = SweepSettings(rig=name, healthy=1, grid=[{"stiffness_loss": 0.1, "averages": 720 * 23}])
    plan = make_plan(design, MeasurementSettings(), SignatureSettings(), rig)
    assert_same(plan_from(stored(plan.resolved)), plan)


def test_the_manifest_of_a_run_gives_its_plan(small_run, small_plan):
    manifest = tomllib.loads((small_run[0] / "sigdb.toml").read_text(encoding="utf-8"))
    plan = plan_from(manifest["plan"]["resolved"])
    assert plan.hash == manifest["plan"]["hash"]
    assert_same(plan, small_plan)


@pytest.mark.parametrize(
    "change",
    [
        lambda resolved: resolved | {"format": 99},
        lambda resolved: resolved | {"new": 1},
        lambda resolved: resolved | {"sweep": resolved["sweep"] | {"grid": [{"new_axis": [1.0]}]}},
        lambda resolved: {key: value for key, value in resolved.items() if key != "rig"},
    ],
    ids=["format", "more than is known", "an unknown axis", "no rig"],
)
def test_a_recipe_that_another_version_resolved_is_refused(plan_of, change):
    with pytest.raises(DatabaseError, match=r"made by another version of sigdb"):
        plan_from(change(plan_of(HEAD + GRID).resolved))


@pytest.fixture
def extension():
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    design = SweepSettings(
        rig=rig.name, seed=9, healthy=2, grid=[{"stiffness_loss": {"min": 0.1, "max": 0.5}, "points": 70}]
    )
    parts = {"first_row_part": 3, "first_template_part": 2, "part_rows": 512}
    return make_plan(design, MeasurementSettings(), SignatureSettings(), rig, **parts), make_plan(
        design, MeasurementSettings(), SignatureSettings(), rig
    )


def test_an_extension_counts_on_from_the_database(extension):
    extended, alone = extension
    assert (extended.rows, extended.n_templates) == (alone.rows, alone.n_templates) == (70 * 12 + 2, 71)
    assert extended.row_part_numbers == range(3, 5)
    assert extended.template_part_numbers == range(2, 4)
    assert [extended.row_range(part) for part in extended.row_part_numbers] == [(1536, 2048), (2048, 1536 + 842)]
    assert [*map(extended.template_range, (2, 3))] == [range(128, 192), range(192, 199)]
    table, base = extended.table(1536, 1536 + 842), alone.table(0, 842)
    assert (table["id"] - base["id"]).unique() == [1536]
    assert (table["template"] - base["template"]).unique() == [128]
    names = ["id", "template"]
    pd.testing.assert_frame_equal(table.drop(columns=names), base.drop(columns=names))
    assert extended.case(150) == alone.case(22)
    assert extended.case_columns(150) == alone.case_columns(22)


def test_an_extension_is_another_plan_and_is_made_again(extension):
    extended, alone = extension
    assert extended.hash != alone.hash
    again = plan_from(stored(extended.resolved))
    assert again.part_rows == 512
    assert_same(again, extended)


def test_rows_in_a_part_may_be_given(plan_of):
    base = plan_of(HEAD + GRID)
    made_from = base.design, base.measurement, base.signature, base.rig
    plan = make_plan(*made_from, part_rows=256)
    assert base.part_rows == 2048
    assert plan_from(stored(plan.resolved)).part_rows == 256


def test_a_plan_goes_to_workers_whole_and_small(plan_of):
    plan = plan_of(HEAD + GRID + "snr_db = { min = -10, max = 10 }\npoints = 50000\n")
    assert plan.rows == 50_000 * 12 * 2 + 50_000 * 3 * 2
    content = pickle.dumps(plan)
    assert len(content) < 3e6
    last = pickle.loads(content).table(plan.rows - 5, plan.rows)
    pd.testing.assert_frame_equal(last, plan.table(plan.rows - 5, plan.rows))


def test_a_template_says_what_its_rows_say(small_plan):
    rows = small_plan.table(0, small_plan.rows)
    for number, some in rows.groupby("template"):
        for name, value in small_plan.case_columns(number).items():
            expected = [np.nan] if value is None else [value]
            assert np.array_equal(some[name].unique(), expected, equal_nan=value is None), name
