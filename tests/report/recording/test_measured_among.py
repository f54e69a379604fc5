"""Unit: a gain and a path that is flat in each mesh order leave no trace where they are removed."""

import numpy as np
import pytest

from sigdb.report.recording.measured_among import among_figure, among_simulated

TEETH, ORDERS = 12, 385


@pytest.fixture
def simulated():
    stream = np.random.default_rng(0)
    return np.exp(stream.normal(size=(200, ORDERS)) + 0.5 * stream.normal(size=(200, 1)) * np.linspace(-1, 1, ORDERS))


def test_simulated_rows_lie_among_themselves(simulated):
    damaged = np.arange(200) % 2 > 0
    each = among_simulated(simulated, simulated, damaged, teeth=TEETH, path_removed=False)
    np.testing.assert_array_equal(each.simulated, each.measured)
    assert each.inside == pytest.approx(0.95, abs=0.01)


def test_a_path_that_is_flat_in_each_mesh_order_is_removed(simulated):
    band = (np.arange(ORDERS) + TEETH // 2) // TEETH
    path = np.exp(np.random.default_rng(1).normal(size=band.max() + 1))[band]
    behind = 1000 * path * simulated
    damaged = np.zeros(200, bool)
    raw = among_simulated(simulated, behind, damaged, teeth=TEETH, path_removed=False)
    removed = among_simulated(simulated, behind, damaged, teeth=TEETH, path_removed=True)
    assert raw.inside < 0.5
    np.testing.assert_allclose(removed.measured, removed.simulated, atol=1e-9)
    assert len(among_figure(raw, removed, title="x").axes) == 2
