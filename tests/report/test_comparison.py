"""Unit: cases side by side are drawn as they are, on one scale."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.report import Case, ReportSettings, comparison_figure

N = 12 * 32
ANGLE = 2 * np.pi * np.arange(N) / N


def case(amplitude, **more):
    return Case(title=f"amplitude {amplitude}", teeth=12, tsa=amplitude * np.cos(12 * ANGLE), **more)


def drawn(*cases, **options):
    return comparison_figure(cases, sensor="pinion-vertical", unit="m/s", **options)


def bars(axes):
    """Heights of each set of lines of a spectrum, by order."""
    return [
        {round(one[0][0]): one[1][1] for one in lines.get_segments()}
        for lines in axes.collections
        if hasattr(lines, "get_segments")
    ]


def test_a_column_for_each_case_and_a_row_for_each_panel():
    figure = drawn(case(1.0), case(2.0), case(3.0), title="Three", caption="One scale.")
    panels = figure.axes[:9]
    assert figure.get_suptitle() == "Three"
    assert figure.get_supxlabel() == "One scale."
    assert [axes.get_title() for axes in panels[:3]] == ["amplitude 1.0", "amplitude 2.0", "amplitude 3.0"]
    labels = [axes.get_ylabel() for axes in panels]
    assert labels[::3] == ["pinion-vertical, m/s", "peak amplitude, m/s", "Wigner-Ville: order, 1/rev"]
    assert not any(labels[1::3] + labels[2::3])
    assert len(figure.axes) == 10  # one bar of colours for all


def test_all_columns_have_one_scale():
    panels = drawn(case(1.0), case(3.0)).axes[:6]
    for left, right in (panels[:2], panels[2:4]):
        assert left.get_ylim() == right.get_ylim()
    assert panels[0].get_ylim()[1] > 3
    limits = [axes.images[0].norm.vmax for axes in panels[4:]]
    assert limits[0] == limits[1]
    # A fifth of the greatest value, which goes with the square of the amplitude.
    (alone,) = [axes.images[0].norm.vmax for axes in drawn(case(1.0)).axes if axes.images]
    assert limits[1] == pytest.approx(9 * alone, rel=1e-6)


def test_the_healthy_one_lies_behind_in_signal_and_spectrum():
    healthy = 0.5 * np.cos(12 * ANGLE)
    signal, spectrum, _ = drawn(case(2.0, healthy=healthy, damaged=(6,))).axes[:3]
    behind, front = signal.lines[:2]
    assert_allclose(behind.get_ydata()[:-1], healthy)
    assert_allclose(front.get_ydata()[:-1], 2 * np.cos(12 * ANGLE))
    assert [one[12] for one in bars(spectrum)] == pytest.approx([0.5, 2.0])
    assert len(bars(drawn(case(2.0)).axes[1])) == 1


def test_mesh_stiffness_is_drawn_from_zero_with_room_above():
    k = 2e8 + 1e8 * np.cos(12 * ANGLE)
    figure = drawn(case(1.0, stiffness=0.5 * k, healthy_stiffness=k), case(1.0, stiffness=k), panels=["stiffness"])
    left, right = figure.axes
    assert left.get_ylabel() == "mesh stiffness, N/m"
    assert left.get_ylim() == right.get_ylim() == (0, pytest.approx(1.2 * 3e8))
    assert_allclose(left.lines[0].get_ydata()[:-1], k)
    assert_allclose(left.lines[1].get_ydata()[:-1], 0.5 * k)


def test_settings_and_order_of_panels():
    figure = drawn(case(1.0), panels=["distribution", "spectrum"], settings=ReportSettings(mesh_orders=2.0))
    assert figure.axes[0].get_ylim() == (0, 24)
    assert figure.axes[1].get_xlim() == (0, 24)


def test_gears_of_different_teeth_stand_side_by_side():
    other = Case(title="more", teeth=16, tsa=np.cos(16 * 2 * np.pi * np.arange(512) / 512))
    figure = drawn(case(1.0), other)
    assert figure.axes[2].get_xlim() == (0, 48)
    assert figure.axes[3].get_xlim() == (0, 64)
    assert figure.axes[5].get_ylim() == (0, 64)
