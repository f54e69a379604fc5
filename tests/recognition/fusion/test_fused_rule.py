"""One answer of each machine: the bound of single rows where nothing is fused, its own certainty, and its prior."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recognition import bayes_bound, fuse

GRID = 'tooth = "all"\nstiffness_loss = [0.1, 0.25]\noperating.speed_rpm = [14000, 14400]'
TWO_SENSORS = 'pinion-vertical", "pinion-housing-vertical'


@pytest.fixture(scope="module")
def measured_twice(make_database):
    """Two sensors at two speeds: 8 specimens, 8 healthy rows and 48 damaged ones each, in much noise."""
    return make_database(seed=7, specimens=8, healthy=4, grid=GRID, sensor=TWO_SENSORS, snr_db=-18.0)


@pytest.fixture(scope="module")
def fusions(measured_twice):
    choices = {"alone": [], "sensors": ["sensors"], "points": ["points"], "all": ["sensors", "points", "recordings"]}
    return {name: fuse(measured_twice, over=over) for name, over in choices.items()}


def test_without_anything_to_fuse_it_is_the_bound_of_each_row(measured_twice, fusions):
    bound = bayes_bound(measured_twice)
    alone = fusions["alone"]
    losses = alone.machines.loc[alone.rows.loc[bound.rows.index]]
    assert_allclose(losses["log_loss"].to_numpy(), bound.losses["log_loss"], rtol=1e-8, atol=1e-8)
    assert_array_equal(losses["predicted"].to_numpy(), bound.rows["predicted"])


def test_more_averages_are_never_worse_and_as_sure_as_they_are_right(fusions):
    """The mean probability of the answers and their share of right ones differ by the scatter of the rows alone."""
    loss = {name: each.machines["log_loss"].mean() for name, each in fusions.items()}
    assert loss["all"] < min(loss["sensors"], loss["points"]) < loss["alone"]
    for each in fusions.values():
        machines = each.machines
        deviation = np.sqrt((machines["probability"] * (1 - machines["probability"])).sum())
        right, expected = len(machines) - machines["error"].sum(), machines["probability"].sum()
        assert abs(right - expected) < 4 * deviation


def test_a_machine_has_all_averages_of_its_specimen_and_damage(fusions):
    machines = fusions["all"].machines
    assert len(machines) == 8 * (1 + 2 * 12)
    assert set(machines.loc[machines["tooth"] > 0, "averages"]) == {2 * 2}
    assert set(machines.loc[machines["tooth"] == 0, "averages"]) == {2 * 2 * 4}
    assert fusions["sensors"].sensors == ("pinion-vertical", "pinion-housing-vertical")


def test_the_prior_is_that_of_all_rows_whichever_are_requested(measured_twice, fusions):
    healthy = measured_twice.cases("tooth = 0")["id"].to_numpy()[:4]
    some = fuse(measured_twice, healthy, over=["sensors"])
    numbers = fusions["sensors"].rows.loc[some.rows.index]
    found, expected = (
        each["log_loss"].to_numpy() for each in (some.machines, fusions["sensors"].machines.loc[numbers])
    )
    assert_allclose(np.sort(found), np.sort(expected), rtol=1e-8)


def test_an_unknown_source_is_refused(measured_twice):
    with pytest.raises(InputError, match="over = 'channels' is no source of averages; choose of sensors, points, rec"):
        fuse(measured_twice, over=["channels"])
    with pytest.raises(InputError, match="wheel"):
        fuse(measured_twice, sensors=["wheel"])
