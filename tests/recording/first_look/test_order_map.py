"""The order map: a resonance that an order passes in a run-up, and recordings that are no run-up."""

import numpy as np
import pandas as pd
import pytest

from sigdb.core import NotApplicableError
from sigdb.recording.first_look.order_map import order_map

N, REVOLUTIONS = 64, 600


def run_up(low=600.0, high=1800.0):
    speed = np.linspace(low, high, REVOLUTIONS)
    turns = np.arange(N * REVOLUTIONS) / N
    at = np.interp(turns, np.arange(REVOLUTIONS) + 0.5, speed)
    gain = 1 / np.sqrt((1 - (at / 1200) ** 2) ** 2 + (0.1 * at / 1200) ** 2)
    return gain * np.cos(2 * np.pi * 12 * turns) + 0.5 * np.cos(2 * np.pi * 7.5 * turns), pd.DataFrame(
        {"speed_rpm": speed}
    )


def test_an_order_is_greatest_at_the_resonance():
    x, speed = run_up()
    found = order_map(x, speed, samples_per_rev=N, highest=30.0)
    along = found.along(12.0)
    assert found.speed_rpm[np.nanargmax(along)] == pytest.approx(1200, rel=0.03)
    assert np.nanmax(along) == pytest.approx(10, rel=0.05)
    np.testing.assert_allclose(found.along(7.5), 0.5, rtol=0.1)
    assert found.order[-1] == 30.0


def test_a_coast_down_has_the_same_map():
    x, speed = run_up(1800.0, 600.0)
    found = order_map(x, speed, samples_per_rev=N, highest=30.0)
    assert (np.diff(found.speed_rpm) > 0).all()
    assert found.speed_rpm[np.nanargmax(found.along(12.0))] == pytest.approx(1200, rel=0.03)


def test_a_steady_speed_is_no_run_up():
    x, speed = run_up(1000.0, 1050.0)
    with pytest.raises(NotApplicableError, match="no run-up"):
        order_map(x, speed, samples_per_rev=N, highest=30.0)


def test_a_few_revolutions_are_too_few():
    x, speed = run_up()
    with pytest.raises(NotApplicableError, match="needs 12 revolutions, there are 10"):
        order_map(x[: 10 * N], speed[:10], samples_per_rev=N, highest=30.0)
