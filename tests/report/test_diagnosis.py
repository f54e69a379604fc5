"""Unit: the page of a diagnosis says what its facts say, of each kind of answer."""

import re

import numpy as np
import pytest

from sigdb.report.diagnosis import diagnosis_html, diagnosis_text

SIGNALS = dict.fromkeys(("tsa", "compared", "template", "healthy"), np.cos(np.arange(96)))


def facts(kind, answer, *, tooth=2, severity=True, missing=()):
    levels = [{"target": "stiffness_loss", "estimate": 0.2, "low": 0.15, "high": 0.3}]
    nearest = {"stiffness_loss": 0.2, "phase_shift_deg": 0.0, "damaged_teeth": float(tooth > 0), "tooth": tooth}
    return {
        "answer": answer,
        "kind": kind,
        "p_damage": 0.75,
        "channel": "a<1>",
        "unit": "m/s",
        "teeth": [{"tooth": j, "probability": 0.25, "candidate": j in (0, 2)} for j in range(4)],
        "severity": levels if severity else None,
        "nearest": [nearest | {"probability": 0.5, "misfit": 1.1}],
        "misfit": 1.1,
        "limit": 1.4,
        "missing": list(missing),
        "notes": ["Mind <this>."],
        "reading": ["12 of 12 revolutions"],
    }


@pytest.mark.parametrize(
    ("kind", "alarm", "pictures"), [("none", False, 3), ("tooth", True, 3), ("not sure", True, 3), ("outside", True, 2)]
)
def test_the_answer_stands_first_and_alarms_unless_there_is_none(kind, alarm, pictures):
    page = diagnosis_html(facts(kind, "An <answer>."), SIGNALS, title="a & b")
    first = re.search(r"</h1>\n<p( class=\"alarm\")?><strong>(.*?)</strong>", page)
    assert (bool(first[1]), first[2]) == (alarm, "An &lt;answer&gt;.")
    assert page.count("<img") == pictures
    assert not re.findall(r"<script|<link|https?://|url\(", page)
    assert "<li>Mind &lt;this&gt;.</li>" in page
    assert ("no evidence" in page) == (kind == "outside")


def test_severity_is_only_if_damaged_where_none_is_possible():
    page = diagnosis_html(facts("not sure", "Not sure."), SIGNALS, title="t")
    assert "<h2>How severe, if damaged</h2>" in page
    assert "<td>0.15 to 0.3</td>" in page
    assert "How severe" not in diagnosis_html(facts("none", "None.", severity=False), SIGNALS, title="t")


def test_a_healthy_template_has_no_tooth_and_what_is_missing_is_listed():
    page = diagnosis_html(facts("none", "None.", tooth=0, missing=("A mark.",)), SIGNALS, title="t")
    assert "<td>none</td>" in page
    assert "<h2>What is missing</h2>\n<ul><li>A mark.</li></ul>" in page


def test_the_text_has_the_same_parts():
    text = diagnosis_text(facts("tooth", "Damage at tooth 2.", missing=("A mark.",)))
    assert text.startswith("Damage at tooth 2.\nProbability of damage 0.75, at even odds")
    for part in ("nearest templates\n", "missing\n  A mark.\n", "notes\n  Mind <this>.\n", "reading\n  12 of 12"):
        assert part in text


def test_no_text_of_the_facts_is_markup():
    script = "<script>alert(1)</script>"
    said = facts("tooth", script, missing=[script]) | {"notes": [script], "reading": [script], "channel": script}
    page = diagnosis_html(said | {"unit": script}, SIGNALS, title=script)
    assert "<script" not in page
    assert page.count("&lt;script&gt;") == 2 + 1 + 3 + 2  # title, answer, lists, caption
