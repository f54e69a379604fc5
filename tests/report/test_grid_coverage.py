"""Unit: the picture of a study of coverage shows its cases, and its labels can be read."""

from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from sigdb.report import coverage_figure


def figure_of(match, **grid):
    rng = np.random.default_rng(0)
    axes = {name: rng.uniform(values[0], values[-1], len(match)) for name, values in grid.items()}
    return coverage_figure(pd.DataFrame({"match": match, **axes}), grid=grid, title="cases")


@pytest.mark.parametrize("least", [0.2, 0.9, 0.9699, 0.98, 0.9999])
def test_bars_meet_at_the_line_and_count_every_case(least):
    match = np.append(np.linspace(least, 1, 200), 0.97)
    first = figure_of(match, stiffness_loss=np.array([0.1, 0.4])).axes[0]
    edges = np.array([bar.get_x() for bar in first.patches])
    heights = np.array([bar.get_height() for bar in first.patches])
    assert np.abs(edges - 0.97).min() < 1e-12
    assert heights.sum() == 201
    assert abs(heights[edges < 0.97 - 1e-9].sum() - (match < 0.97).sum()) <= 1
    assert first.get_title(loc="left").startswith(f"{(match >= 0.97).mean():.1%} of the cases")


def test_each_axis_has_a_panel_with_its_cases_and_the_grid_as_ticks():
    grid = {"stiffness_loss": np.array([0.1, 0.11, 0.2, 0.4]), "phase_shift_deg": np.array([-2.0, 2.0])}
    figure = figure_of(np.linspace(0.9, 1, 30), **grid)
    _, *panels = figure.axes
    assert [axes.get_xlabel() for axes in panels] == ["stiffness_loss", "phase_shift, deg"]
    for axes, values in zip(panels, grid.values(), strict=True):
        assert_allclose(np.unique([*axes.get_xticks(), *axes.get_xticks(minor=True)]), values)
        assert_allclose(np.sort(axes.collections[0].get_offsets()[:, 1]), np.linspace(0.9, 1, 30))


def test_labels_do_not_overlap():
    grid = {
        "speed_rpm": np.sort(np.random.default_rng(1).uniform(1000, 20000, 60)),
        "operating.torque": np.array([1, 2]),
    }
    figure = figure_of(np.linspace(0.5, 1, 30), **grid)
    figure.draw_without_rendering()
    for axes in figure.axes:
        boxes = [label.get_window_extent() for label in axes.get_xticklabels() if label.get_text()]
        shown = [box for box in boxes if axes.bbox.x0 - 1 <= (box.x0 + box.x1) / 2 <= axes.bbox.x1 + 1]
        assert all(one.x1 < other.x0 for one, other in pairwise(shown))
