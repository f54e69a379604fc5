"""Unit: rows outside the range of the training are named with the reason; rows inside it are not."""

import json

import numpy as np
import pandas as pd
import pytest

from sigdb.core.plain_values import plain
from sigdb.recognition.rows.batch import Batch
from sigdb.recognition.trained_range import TrainedRange, intervals

RANGE = TrainedRange(
    speed_rpm=((600.0, 600.0), (3000.0, 3000.0)),
    torque=((40.0, 60.0),),
    samples_per_tooth=32,
    averages=(50.0, 100.0),
    noise=(0.01, 0.2),
    level=(1.0, 1.5),
    unit="m/s^2",
)
TEETH, SAMPLES = 12, 384
ROW = {"teeth": TEETH, "speed_rpm": 3000.0, "torque": 50.0, "averages": 64, "scatter": 0.8}


def batch(*, rms=1.2, samples=SAMPLES, noise=0.0, **changed):
    """A row whose average has a root mean square apart from its noise."""
    x = np.cos(TEETH * 2 * np.pi * np.arange(samples) / samples) * np.sqrt(2) * rms
    x = x + noise * np.random.default_rng(1).normal(size=samples)
    return Batch(table=pd.DataFrame([ROW | changed]), tsa={TEETH: x[None]})


@pytest.mark.parametrize(
    "changed",
    [
        {},
        {"speed_rpm": 600.0},
        {"speed_rpm": 3050.0},
        {"torque": 39.0},
        {"averages": 26},
        {"averages": 200},
        {"rms": 0.6},
        {"rms": 2.9},
        {"scatter": 1e-4},
        {"scatter": 2.4},
    ],
    ids=str,
)
def test_a_row_like_those_of_the_training_is_inside(changed):
    assert RANGE.reasons(batch(**changed)) == [""]


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"speed_rpm": 1800.0}, "speed_rpm = 1800 rpm was not trained on; 600, 3000 was"),
        ({"speed_rpm": 3070.0}, "speed_rpm = 3070 rpm was not trained on"),
        ({"speed_rpm": 50.0}, "speed_rpm = 50 rpm was not trained on"),
        ({"speed_rpm": np.nan}, "speed_rpm = nan rpm was not trained on"),
        ({"torque": 64.0}, "torque = 64 N m was not trained on; 40 to 60 was"),
        ({"torque": -50.0}, "torque = -50 N m was not trained on"),
        ({"averages": 20}, "averages = 20 was not trained on; 50 to 100 rev was"),
        ({"averages": 500, "scatter": 2.0}, "averages = 500 was not trained on"),
        ({"samples": 768}, "tsa has 64 samples a tooth, and 32 were trained on"),
        ({"samples": 400}, "tsa has 33.33 samples a tooth"),
        ({"scatter": 8.0}, "noise, scatter / sqrt(averages), = 1 was not trained on; at most 0.2 m/s^2 was"),
        (
            {"rms": 1.2 / 9.81},
            "without its noise, was not trained on; 1 to 1.5 m/s^2 was: check",
        ),
        ({"rms": 1.2 * 9.81}, "check the unit and the sensor"),
        ({"rms": 1200.0}, "check the unit and the sensor"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_a_row_outside_is_named_with_the_reason(changed, says):
    (reason,) = RANGE.reasons(batch(**changed))
    assert says in reason


@pytest.mark.parametrize("factor", [1000.0, 9.81, 1 / 9.81, 1 / 1000])
@pytest.mark.parametrize("noise", [0.01, 0.3, 3.0])
def test_another_unit_of_average_and_scatter_is_noticed_in_any_noise(factor, noise):
    """Noise of training reaches from a hundredth of the signal to ten times it."""
    trained = TrainedRange(
        speed_rpm=((3000.0, 3000.0),), torque=((50.0, 50.0),), samples_per_tooth=32, noise=(0.01, 3.0), level=(1.0, 1.5)
    )
    row = batch(rms=1.2, noise=noise, scatter=8 * noise)
    assert trained.reasons(row) == [""]
    row = Batch(table=row.table.assign(scatter=8 * noise * factor), tsa={TEETH: row.tsa[TEETH] * factor})
    assert "check the unit" in trained.reasons(row)[0] or "noise" in trained.reasons(row)[0]


def test_a_range_that_is_not_known_refuses_nothing():
    unknown = TrainedRange(speed_rpm=RANGE.speed_rpm, torque=RANGE.torque, samples_per_tooth=32)
    assert unknown.reasons(batch(rms=1e6, averages=1, scatter=1e9)) == [""]


def test_a_row_without_its_average_is_compared_by_its_root_mean_square():
    table = pd.DataFrame([ROW | {"rms": 1.2}, ROW | {"rms": 1200.0}, ROW | {"rms": np.nan}])
    reasons = RANGE.reasons(Batch(table=table))
    assert [bool(reason) for reason in reasons] == [False, True, False]


def test_the_range_is_that_of_the_rows(database, rows):
    found = TrainedRange.of_rows(database, rows.set_index("id"))
    assert found.speed_rpm == ((rows["speed_rpm"].min(), rows["speed_rpm"].max()),)
    assert found.averages == (108.0, 108.0)
    assert (found.samples_per_tooth, found.unit) == (64, "m/s")
    noise = (rows["scatter"] / np.sqrt(rows["averages"])).astype(float)
    np.testing.assert_allclose(found.noise, (noise.min(), noise.max()))
    clean = np.sqrt(np.mean(np.stack(rows["tsa"]).astype(float) ** 2, axis=1) - noise**2)
    np.testing.assert_allclose(found.level, (clean.min(), clean.max()), rtol=1e-5)
    assert TrainedRange.from_json(json.loads(json.dumps(plain(found)))) == found
    assert not any(found.reasons(Batch.from_rows(rows, {"tsa"})))


def test_speeds_that_are_far_apart_are_intervals_of_their_own():
    assert intervals([100.0, 103.9, 104.0, 200.0], 0.02) == ((100.0, 104.0), (200.0, 200.0))
    assert intervals([5.0], 0.02) == ((5.0, 5.0),)
