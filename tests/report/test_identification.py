"""The page of an identification: its numbers, its pictures, and what is marked in them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.identification import Identification, Member, Targets
from sigdb.identification.problem import Problem
from sigdb.report import identification_figures, write_identification_report
from sigdb.report.panels import DAMAGE, INK
from sigdb.transmission import load_transmission


@pytest.fixture(scope="module")
def result():
    """Three members of a rig with three ranges; a frequency is fitted, another is held out."""
    rig = load_transmission("luo-10dof")
    stated = [{"frequency_hz": f, "error_hz": 2.0, "held_out": held} for f, held in ((100.0, False), (200.0, True))]
    problem = Problem(rig, Targets(title="<made up>", modes=stated))
    members = [
        Member(
            z=np.array([0.01 * i, i, 0.0]),
            rig=rig,
            misfit=0.5,
            predicted=np.array([100.0 + i, 204.0 + i]),
            observed=np.array([]),
        )
        for i in (-1, 0, 1)
    ]
    return Identification(problem=problem, members=tuple(members), left_out={"unstable": 2})


def test_the_page_has_the_fit_the_tables_and_two_pictures(result, tmp_path):
    text = write_identification_report(result, tmp_path / "page").read_text(encoding="utf-8")
    assert "3 of 3 rigs meet the targets" in text
    assert "2 draws were left out: unstable." in text
    assert "&lt;made up&gt;" in text
    assert text.count("<figure>") == 2
    assert "<script" not in text


def test_members_stand_at_their_places_in_the_range(result):
    axes = identification_figures(result)[0].figure.axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == list(result.posterior().index)
    ticks = axes.lines[2]
    assert_allclose(ticks.get_xdata(), [0.158655, 0.5, 0.841345], atol=1e-6)
    assert ticks.get_color() == DAMAGE  # from 0.16 to 0.84 at a level of 1/2: not identified
    assert axes.lines[0].get_color() == INK


def test_predictions_are_in_standard_deviations_of_their_errors(result):
    axes = identification_figures(result)[1].figure.axes[0]
    bands = [line for line in axes.lines if line.get_linewidth() == 3]
    assert_allclose([band.get_xdata() for band in bands], [[-0.5, 0.5], [1.5, 2.5]])
    assert [band.get_color() for band in bands] == [INK, DAMAGE]
