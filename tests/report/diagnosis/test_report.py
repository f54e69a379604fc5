"""Unit: the page of a diagnosis shows the diagnosis, for each kind of answer."""

import json
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from sigdb.core import Note
from sigdb.diagnosis import Detector, Diagnosis, Finding, HealthyLaw, LevelChange, Location
from sigdb.diagnosis.change.change import Band, Change
from sigdb.diagnosis.change.statistics import Statistic
from sigdb.recording import MeshPresence, RecordedSignature, Repeatability
from sigdb.report import diagnosis_text, write_diagnosis_report
from sigdb.report.diagnosis.report import diagnosis_html

TEETH, SIGNAL = 6, np.cos(np.arange(96))
PRESENT = MeshPresence(present=True, reason="the mesh stands out", p_value=1e-9)
KINDS = ("no change", "level changed", "one tooth", "several teeth", "cannot be judged")


def note(text):
    return Note(code="any", text=text)


def signature(channel="a<1>", unit="m/s"):
    empty = pd.DataFrame()
    return RecordedSignature(
        intervals=pd.DataFrame({"indicator": [], "low": [], "high": []}),
        envelope=None,
        shafts=pd.DataFrame(),
        order_map=None,
        source="run.csv", channel=channel, unit=unit, gear="pinion", shaft="shaft", teeth=TEETH, angle="tacho",
        absolute=True, tsa=SIGNAL, scatter=0.1, noise=np.full(49, 0.1), groups=SIGNAL[None], averages=12, dropped=0,
        cycle=3, speed_rpm=600.0, speed_track=empty, kept=1.0, presence=PRESENT, highest_order=48.0,
        order_spectrum=empty, record_spectrum=empty, lines=empty, indicators={}, notes=(),
    )  # fmt: skip


def finding():
    orders = np.array([9, 10, 11, 13, 14])
    band = Band(harmonic=2, orders=orders, gain=1.0, residual=np.ones(5, complex), deviation=np.ones(5))
    statistic = Statistic(value=np.linspace(0, 2, 48), best=np.zeros(48, int), ratio=np.ones(48))
    return Finding(
        change=Change(teeth=TEETH, bands=(band,), turn=0.0, likeness=0.9),
        pulse=statistic,
        template=statistic,
        likelihood=None,
        pulse_limit=1.15,
        template_limit=1.25,
        likelihood_limit=1.15,
        wider=False,
        evidence=np.zeros(8 * TEETH),
    )


def diagnosis(kind, answer, *, compared=True, missing=(), notes=("Mind <this>.",), reading=("12 of 12",), **names):
    damaged = kind in ("one tooth", "several teeth")
    level = LevelChange(
        harmonics=np.array([1, 2]),
        mesh_db=np.array([-1.5, 2.0]),
        sidebands_db=np.zeros(2),
        band_db=np.zeros(2),
        distance=5.0,
        limit=4.0,
        cause="sensor gain" if kind == "level changed" else "none",
    )
    severity = pd.DataFrame([{"target": "stiffness_loss", "estimate": 0.2, "low": 0.15, "high": 0.3}])
    facts = {
        "reference": SIGNAL,
        "finding": finding(),
        "detectors": (
            Detector(name="pulse", value=2.0, limit=1.15, pieces=24, false_alarm_rate=0.04),
            Detector(name="FM4", value=2.9, limit=3.6, pieces=24, false_alarm_rate=0.04),
        ),
        "law": HealthyLaw(pieces=24, pulse=0.8, template=0.7, likelihood=0.0, evidence=0.9, widest=1.0, recordings=1),
        "locations": (Location(tooth=2, low=1, high=3, place=1.0),) if damaged else (),
        "level": level,
        "severity": severity if damaged else None,
    }
    return Diagnosis(
        signature=signature(**names),
        healthy=(),
        kind=kind,
        answer=answer,
        assumed=("One of 8 rigs.",),
        missing=tuple(map(note, missing)),
        notes=tuple(map(note, notes)),
        reading=tuple(map(note, reading)),
        **facts if compared else {},
    )


@pytest.mark.parametrize("kind", KINDS)
def test_the_answer_stands_first_and_alarms_unless_there_is_none(kind):
    page = diagnosis_html(diagnosis(kind, "An <answer>."), title="a & b", command="sigdb diagnose 'a b.csv'")
    first = re.search(r"</h1>\n<p( class=\"alarm\")?><strong>(.*?)</strong>", page)
    assert (bool(first[1]), first[2]) == (kind not in KINDS[:2], "An &lt;answer&gt;.")
    assert page.count("<img") == 3
    assert not re.findall(r"<script|<link|https?://|url\(", page)
    assert "<li>Mind &lt;this&gt;.</li>" in page
    assert "<pre>sigdb diagnose &#39;a b.csv&#39;</pre>" in page


def test_three_lights_show_what_has_changed():
    def states(kind):
        page = diagnosis_html(diagnosis(kind, "An answer."), title="t")
        return re.findall(r'<li class="(\w+)"><b>(\w+)</b>', page)

    names = ("level", "sensor", "tooth")
    lit = {"no change": (), "level changed": ("level", "sensor"), "one tooth": ("tooth",)}
    for kind, changed in lit.items():
        assert states(kind) == [("changed" if name in changed else "unchanged", name) for name in names]
    nothing = diagnosis_html(diagnosis("cannot be judged", "No.", compared=False), title="t")
    assert nothing.count('<li class="unknown">') == 3
    assert nothing.count("<img") == 1


def test_without_a_healthy_recording_the_page_shows_what_repeats_against_noise_and_pitch_errors():
    repeats = Repeatability(
        kind="one event", answer="One event.", revolutions=70, energy_ratio=40.0, same_place=66,
        same_place_by_chance=3.0, same_place_by_pitch_errors=44.2, odd_even_correlation=0.9, odd_even_by_noise=0.04,
        power_ratio=12.0,
    )  # fmt: skip
    alone = diagnosis("one event", "One event.", compared=False)
    found = replace(alone, signature=replace(alone.signature, repeatability=repeats))
    page, text = diagnosis_html(found, title="t"), diagnosis_text(found)
    for cells in (("66 of 70", "3", "44.2"), ("0.9", "± 0.08", "0.996"), ("12", "1", "159"), ("40", "-", "21.7")):
        assert "".join(f"<td>{cell}</td>" for cell in cells) in page
        assert re.search(r"\s+".join(map(re.escape, cells)), text)
    assert "What repeats" not in diagnosis_html(diagnosis("no change", "None."), title="t")


def test_severity_is_shown_where_a_tooth_stands_out():
    page = diagnosis_html(diagnosis("one tooth", "One."), title="t")
    assert "<h2>How severe</h2>" in page
    assert "<td>0.15 to 0.3</td>" in page
    assert "How severe" not in diagnosis_html(diagnosis("no change", "None."), title="t")


def test_the_text_has_the_same_parts():
    text = diagnosis_text(diagnosis("one tooth", "One tooth stands out: 2 ± 1.", missing=("A mark.",)))
    assert text.startswith("One tooth stands out: 2 ± 1.\nFalse alarms: at most one in 25 healthy recordings")
    rows = [line.split() for line in text.splitlines() if "healthy recordings alone" in line]
    assert [(row[0], row[-5:]) for row in rows] == [
        ("pulse", ["2", "1.15", "alarm", "24", "0.04"]),
        ("FM4", ["2.9", "3.6", "-", "24", "0.04"]),
    ]
    parts = ("assumed\n  One of 8 rigs.\n", "missing\n  A mark.\n", "notes\n  Mind <this>.\n")
    for part in (*parts, "reading\n  12 of 12"):
        assert part in text


def test_no_text_of_a_diagnosis_is_markup():
    script = "<script>alert(1)</script>"
    texts = {"missing": [script], "notes": [script], "reading": [script], "channel": script, "unit": script}
    page = diagnosis_html(diagnosis("one tooth", script, **texts), title=script, command=script)
    assert "<script" not in page
    assert page.count("&lt;script&gt;") == 2 + 1 + 3 + 1 + 2  # title, answer, lists, command, caption


def test_the_numbers_with_the_page_are_those_of_the_diagnosis(tmp_path):
    """A number that is none is null: the file is JSON that any reader takes."""
    found = diagnosis("one tooth", "One tooth stands out: 2 ± 1.")
    found.severity.loc[0, "high"] = np.nan
    page = write_diagnosis_report(found, tmp_path / "page")
    assert "<h1>Diagnosis of run.csv</h1>" in page.read_text(encoding="utf-8")
    numbers = json.loads((tmp_path / "page" / "diagnosis.json").read_text(encoding="utf-8"))
    assert (numbers["kind"], numbers["exit_code"]) == ("one tooth", 1)
    assert numbers["statistics"]["pulse"] == {"value": 2.0, "limit": 1.15, "place": 5.875}
    assert numbers["severity"][0]["high"] is None
    assert numbers["notes"] == [{"code": "any", "text": "Mind <this>.", "values": {}}]
    assert numbers["signals"]["tsa"] == SIGNAL.tolist()
