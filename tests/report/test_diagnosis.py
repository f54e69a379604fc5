"""Unit: the page of a diagnosis shows the diagnosis, for each kind of answer."""

import json
import re

import numpy as np
import pandas as pd
import pytest

from sigdb.core import Note
from sigdb.diagnosis import Comparison, Diagnosis
from sigdb.recording import MeshPresence, RecordedSignature
from sigdb.report import diagnosis_text, write_diagnosis_report
from sigdb.report.diagnosis import diagnosis_html

SIGNAL = np.cos(np.arange(96))
PRESENT = MeshPresence(present=True, reason="the mesh stands out", p_value=1e-9)


def note(text):
    return Note(code="any", text=text)


def signature(channel="a<1>", unit="m/s"):
    empty = pd.DataFrame()
    return RecordedSignature(
        intervals=pd.DataFrame({"indicator": [], "low": [], "high": []}),
        envelope=None,
        order_map=None,
        source="run.csv", channel=channel, unit=unit, gear="pinion", shaft="shaft", teeth=3, angle="tacho",
        absolute=True, tsa=SIGNAL, scatter=0.1, noise=np.full(49, 0.1), averages=12, dropped=0, cycle=3,
        speed_rpm=600.0, speed_track=empty, kept=1.0, presence=PRESENT, highest_order=48.0, order_spectrum=empty,
        record_spectrum=empty, lines=empty, indicators={}, notes=(),
    )  # fmt: skip


def diagnosis(
    kind, answer, *, tooth=2, missing=(), notes=("Mind <this>.",), reading=("12 of 12 revolutions",), **names
):
    nearest = {"stiffness_loss": 0.2, "phase_shift_deg": 0.0, "damaged_teeth": float(tooth > 0), "tooth": tooth}
    comparison = Comparison(
        x=SIGNAL,
        reference=None,
        candidates=(0, 2),
        probability=np.full(4, 0.25),
        severity=pd.DataFrame([{"target": "stiffness_loss", "estimate": 0.2, "low": 0.15, "high": 0.3}]),
        nearest=pd.DataFrame([nearest | {"probability": 0.5, "reduced_chi2": 1.1}]),
        template=SIGNAL,
        healthy=SIGNAL,
        reduced_chi2=1.1,
        limit=1.4,
    )
    return Diagnosis(
        signature=signature(**names),
        healthy=None,
        kind=kind,
        answer=answer,
        comparison=comparison,
        missing=tuple(map(note, missing)),
        notes=tuple(map(note, notes)),
        reading=tuple(map(note, reading)),
    )


@pytest.mark.parametrize(
    ("kind", "alarm", "pictures"), [("none", False, 3), ("tooth", True, 3), ("not sure", True, 3), ("outside", True, 2)]
)
def test_the_answer_stands_first_and_alarms_unless_there_is_none(kind, alarm, pictures):
    page = diagnosis_html(diagnosis(kind, "An <answer>."), title="a & b")
    first = re.search(r"</h1>\n<p( class=\"alarm\")?><strong>(.*?)</strong>", page)
    assert (bool(first[1]), first[2]) == (alarm, "An &lt;answer&gt;.")
    assert page.count("<img") == pictures
    assert not re.findall(r"<script|<link|https?://|url\(", page)
    assert "<li>Mind &lt;this&gt;.</li>" in page
    assert ("no evidence" in page) == (kind == "outside")


def test_severity_is_only_if_damaged_where_none_is_possible():
    page = diagnosis_html(diagnosis("not sure", "Not sure."), title="t")
    assert "<h2>How severe, if damaged</h2>" in page
    assert "<td>0.15 to 0.3</td>" in page
    assert "How severe" not in diagnosis_html(diagnosis("none", "None."), title="t")


def test_a_healthy_template_has_no_tooth_and_what_is_missing_is_listed():
    page = diagnosis_html(diagnosis("none", "None.", tooth=0, missing=("A mark.",)), title="t")
    assert "<td>none</td>" in page
    assert "<h2>What is missing</h2>\n<ul><li>A mark.</li></ul>" in page


def test_the_text_has_the_same_parts():
    text = diagnosis_text(diagnosis("tooth", "Damage at tooth 2.", missing=("A mark.",)))
    assert text.startswith("Damage at tooth 2.\nProbability of damage 0.75, at even odds")
    for part in ("nearest templates\n", "missing\n  A mark.\n", "notes\n  Mind <this>.\n", "reading\n  12 of 12"):
        assert part in text


def test_no_text_of_a_diagnosis_is_markup():
    script = "<script>alert(1)</script>"
    texts = {"missing": [script], "notes": [script], "reading": [script], "channel": script, "unit": script}
    page = diagnosis_html(diagnosis("tooth", script, **texts), title=script)
    assert "<script" not in page
    assert page.count("&lt;script&gt;") == 2 + 1 + 3 + 2  # title, answer, lists, caption


def test_the_numbers_with_the_page_are_those_of_the_diagnosis(tmp_path):
    """A probability that is no number is null: the file is JSON that any reader takes."""
    found = diagnosis("tooth", "Damage at tooth 2.")
    found.comparison.nearest["phase_shift_deg"] = np.nan
    page = write_diagnosis_report(found, tmp_path / "page")
    assert "<h1>Diagnosis of run.csv</h1>" in page.read_text(encoding="utf-8")
    numbers = json.loads((tmp_path / "page" / "diagnosis.json").read_text(encoding="utf-8"))
    assert numbers["reduced_chi2"] == 1.1
    assert numbers["nearest"][0]["phase_shift_deg"] is None
    assert numbers["notes"] == [{"code": "any", "text": "Mind <this>.", "values": {}}]
    assert numbers["signals"]["template"] == SIGNAL.tolist()
