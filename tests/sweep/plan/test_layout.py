"""Verification: rows and templates of unions of grids, against sets made by loops over every combination."""

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sigdb
from sigdb.measurement import MeasurementSettings
from sigdb.signature.settings import SignatureSettings
from sigdb.sweep import SweepSettings, make_plan

RIGS = {name: sigdb.load_transmission(name) for name in ("nasa-spiral-bevel", "two-stage-gearbox")}
AVERAGES = 36
LISTS = {
    "tooth": [1, 2, 3, 12],
    "damaged_teeth": [1, 2],
    "stiffness_loss": [0.0, 0.2],
    "loss_extent": [0.5, 1.0, 0.0],
    "phase_shift_deg": [0.0, 1.0],
    "snr_db": [0.0, 3.0],
    "index_error": [0.0, 1e-6],
    "operating.torque": [300.0, 356.05],
    "operating.speed_rpm": [6000.0, 14400.0],
    "pinion.teeth": [12, 13],
}


@st.composite
def grids(draw, axes):
    """A grid of some axes, each a list, together as a product or row by row as a table."""
    named = draw(st.sets(st.sampled_from(axes), max_size=5))
    if named and draw(st.booleans()):
        n = draw(st.integers(1, 5))
        table = {axis: draw(st.lists(st.sampled_from(LISTS[axis]), min_size=n, max_size=n)) for axis in sorted(named)}
        return {"table": table}
    return {axis: draw(st.lists(st.sampled_from(LISTS[axis]), min_size=1, max_size=3)) for axis in sorted(named)}


def cases(grid):
    """Each combination of a grid as a dictionary."""
    if "table" in grid:
        yield from (dict(zip(grid["table"], row, strict=True)) for row in zip(*grid["table"].values(), strict=True))
    else:
        yield from (dict(zip(grid, values, strict=True)) for values in itertools.product(*grid.values()))


def expected(rig, gear, design):
    """Healthy and damaged cases as tuples: rig, damage, tooth, measurement."""
    healthy, damaged = set(), set()
    for case in itertools.chain.from_iterable(map(cases, design)):
        pinion = case.get("pinion.teeth", 12)
        at = (
            case.get("operating.speed_rpm", rig.operating.speed_rpm),
            case.get("operating.torque", rig.operating.torque),
            pinion if gear == "pinion" else rig.gears[gear].teeth,
        )
        measured = (case.get("snr_db", 0.0), case.get("index_error", 2e-6))
        healthy.add((*at, *measured))
        loss, shift = case.get("stiffness_loss", 0.0), case.get("phase_shift_deg", 0.0)
        extent = case.get("loss_extent", 1.0) if loss else 1.0
        if not shift and not (loss and extent):
            continue
        for tooth in [case["tooth"]] if "tooth" in case else range(1, at[-1] + 1):
            damaged.add((*at, case.get("damaged_teeth", 1), shift, loss, extent, tooth, *measured))
    return healthy, damaged


@pytest.mark.parametrize("name", RIGS)
@given(st.data())
@settings(max_examples=30, deadline=None)
def test_rows_are_the_union(name, data):
    rig = RIGS[name]
    gear = {"nasa-spiral-bevel": "pinion", "two-stage-gearbox": "middle-pinion"}[name]
    axes = [axis for axis in LISTS if axis != "pinion.teeth" or gear == "pinion"]
    design = data.draw(st.lists(grids(axes), min_size=1, max_size=3))
    plan = make_plan(
        SweepSettings(rig=name, gear=gear, specimens=2, draws=2, healthy=3, grid=design),
        MeasurementSettings(averages=AVERAGES),
        SignatureSettings(),
        rig,
    )
    rows = plan.table(0, plan.rows)
    at, measured = ["speed_rpm", "torque", "teeth"], ["snr_db", "index_error"]
    damage = ["damaged_teeth", "phase_shift_deg", "stiffness_loss", "loss_extent"]
    healthy, damaged = expected(rig, gear, design)
    undamaged = rows["tooth"] == 0
    for some, names, wanted, draws in (
        (rows[undamaged], at + measured, healthy, 3),
        (rows[~undamaged], [*at, *damage, "tooth", *measured], damaged, 2),
    ):
        found = list(some[[*names, "specimen", "draw"]].itertuples(index=False, name=None))
        assert len(set(found)) == len(found) == len(wanted) * 2 * draws
        assert {one[:-2] for one in found} == wanted
    # A template is a rig with a damage, and with its place where other teeth are no turns of it.
    kinds = rows[[*at, *damage, *([] if rig.turns_exactly(gear) else ["tooth"])]].drop_duplicates()
    assert plan.n_templates == len(kinds) == rows["template"].nunique()
    assert rows["template"].max() == plan.n_templates - 1
    assert (rows.groupby("template")[[*at, *damage]].nunique() == 1).all(axis=None)
