"""The page and the text of a plan: every measurement, a map of each sensor, and what was not found."""

import json

import numpy as np
import pandas as pd
import pytest

from sigdb.core import Note
from sigdb.planning import MeasurementPlan, PlanSettings
from sigdb.report import plan_figures, plan_text, write_plan_report


@pytest.fixture(scope="module")
def plan():
    columns = ["sensor", "speed_rpm", "torque", "averages", "a90", "a90_low", "a90_high"]
    rows = [
        ("<top>", 900.0, 20.0, 300, 0.05, 0.04, 0.07),
        ("<top>", 900.0, 20.0, 30, 0.2, 0.15, np.nan),
        ("side", 900.0, 20.0, 300, np.nan, np.nan, np.nan),
    ]
    facts = {"direction": "0 1 0", "seconds": 2.0, "noise": 1.0, "signal_unit": "m/s^2", "noise_from": "assumed"}
    table = pd.DataFrame(rows, columns=columns).assign(**facts, largest=0.6)
    notes = (Note(code="noise-assumed", text="The noise is assumed."),)
    return MeasurementPlan(rig="r", gear="g", unit="-", settings=PlanSettings(), table=table, notes=notes)


def test_the_page_has_the_answer_a_map_of_each_sensor_and_the_table(plan, tmp_path):
    text = write_plan_report(plan, tmp_path, command="sigdb plan-measurement r").read_text(encoding="utf-8")
    assert "The best of these measurements is &lt;top&gt; at 900 rpm and 20 N m with 300 revolutions" in text
    assert "The noise is assumed." in text
    assert text.count("<figure>") == 2
    assert "0.15 to &gt; 0.6" in text
    assert "<script" not in text
    assert json.loads((tmp_path / "plan.json").read_text(encoding="utf-8"))["table"][2]["a90"] is None


def test_a_map_is_of_the_greatest_number_of_averages(plan):
    top, side = plan_figures(plan)
    assert [text.get_text() for text in top.figure.axes[0].texts] == ["0.05"]
    assert [text.get_text() for text in side.figure.axes[0].texts] == ["> 0.6"]


def test_the_text_has_the_best_rows(plan):
    text = plan_text(plan, best=1)
    assert "0.04 to 0.07" in text
    assert "2 more measurements show less." in text
