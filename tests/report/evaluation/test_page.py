"""Unit: the page of an evaluation is one file, shows the numbers unchanged, and draws what there is."""

import base64
import json
import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

from sigdb.core import Note
from sigdb.recognition import TARGETS, CriteriaSettings, Estimate, Evaluation
from sigdb.recognition.answers import Answers
from sigdb.recognition.criteria import assess_criteria
from sigdb.recognition.evaluation_tables import evaluation_tables
from sigdb.recognition.metrics.evaluated import Evaluated
from sigdb.recognition.metrics.metric import estimates
from sigdb.report import evaluation_figures, evaluation_html, evaluation_text, write_evaluation_report

TEETH = 5


def an_evaluation(target, answers, rows, **others):
    question = TARGETS[target]
    evaluated = {name: Evaluated.of(each, rows) for name, each in answers.items()}
    metrics = {
        name: estimates(question.metrics, question.values(each), each.specimens) | question.quotients(each)
        for name, each in evaluated.items()
    }
    return Evaluation(
        target=target,
        learner="a",
        split="S1",
        split_text="by specimen",
        split_hash="0123456789abcdef",
        rows=len(rows),
        specimens=rows["specimen"].nunique(),
        metrics=metrics,
        tables=evaluation_tables(question, evaluated, "a", None, {}),
        **others,
    )


@pytest.fixture(scope="module")
def rows():
    stream = np.random.default_rng(0)
    tooth = np.repeat([0, *range(1, TEETH + 1)], [400, *[120] * TEETH])
    loss = np.where(tooth > 0, np.resize([0.1, 0.2, 0.3, 0.4], len(tooth)), 0.0)
    return pd.DataFrame(
        {
            "tooth": tooth,
            "teeth": TEETH,
            "stiffness_loss": loss,
            "phase_shift_deg": 0.0,
            "damaged_teeth": (tooth > 0) * 1,
            "specimen": stream.integers(0, 8, len(tooth)),
            "snr_db": stream.choice([-10.0, 0.0], len(tooth)),
            "averages": 100,
            "speed_rpm": 1000.0,
            "torque": 10.0,
        }
    )


@pytest.fixture(scope="module")
def location(rows):
    stream = np.random.default_rng(1)
    scores = stream.normal(size=(len(rows), 1 + TEETH))
    scores[np.arange(len(rows)), rows["tooth"]] += np.where(rows["tooth"] > 0, 12 * rows["stiffness_loss"], 2.0)
    p = np.exp(scores) / np.exp(scores).sum(axis=1, keepdims=True)
    return an_evaluation(
        "location",
        {
            "a": Answers(predicted=scores.argmax(axis=1), scores=scores, probabilities=p),
            "b": Answers(predicted=np.zeros(len(rows), int)),
        },
        rows,
    )


@pytest.fixture(scope="module")
def severity(rows):
    stream, damaged = np.random.default_rng(2), rows[rows["tooth"] > 0]
    found = {}
    for target, half in (("stiffness_loss", 0.1), ("phase_shift_deg", 1.0), ("damaged_teeth", 0.5)):
        found[target] = damaged[target] + half / 2 * stream.normal(size=len(damaged))
        found |= {f"{target}_low": found[target] - half, f"{target}_high": found[target] + half}
    return an_evaluation("severity", {"a": Answers(predicted=pd.DataFrame(found))}, damaged)


@pytest.fixture(scope="module")
def pages(location, severity):
    return {
        "location": evaluation_html(location, title="a & b <c>"),
        "severity": evaluation_html(severity, title="a & b <c>"),
    }


def pictures(page):
    return [base64.b64decode(one) for one in re.findall(r'src="data:image/svg\+xml;base64,([^"]+)"', page)]


@pytest.mark.parametrize("which", ["location", "severity"])
def test_the_page_is_one_file_that_needs_no_network(which, pages):
    page = pages[which]
    assert "<h1>a &amp; b &lt;c&gt;</h1>" in page
    assert re.findall(r'(?:src|href)="(?!data:)', page) == []
    assert not re.search(r"https?://|@import|url\(|<script|<link", page)
    assert len(pictures(page)) == page.count("<h3>") == page.count("<figcaption>") > 5
    for picture in pictures(page):
        assert ElementTree.fromstring(picture).tag == "{http://www.w3.org/2000/svg}svg"


def test_the_pictures_are_those_of_what_there_is(location, pages):
    assert re.findall("<h3>(.*?)</h3>", pages["location"]) == [
        "Confusion of teeth",
        "Distance around the gear",
        "Detection at low false-alarm rates",
        "Detection against stiffness loss",
        "Reliability of probabilities",
        "Accuracy, healthy rows too, against the signal-to-noise ratio",
        "Exact tooth of damaged rows against the signal-to-noise ratio",
    ]
    bare = replace(location, tables={"confusion": location.tables["confusion"]})
    assert len(list(evaluation_figures(bare))) == 2
    headings = re.findall("<h3>(.*?)</h3>", pages["severity"])
    assert len([one for one in headings if one.startswith("Estimates of the")]) == 3
    assert len([one for one in headings if one.startswith("Error of the")]) == 3


def test_coverage_is_drawn_where_cells_have_enough_rows(severity, pages):
    assert "the model gives neither sets nor intervals" in pages["location"]
    assert "no cell of severity, noise and operating point has 2000 rows" in pages["severity"]
    cell = {"stiffness_loss": [0.1, 0.2], "snr_db": 0.0, "speed_rpm": 1.0, "torque": 1.0, "rows": 2000}
    ends = {"coverage": [0.9, 0.5], "low": [0.88, 0.47], "high": [0.92, 0.53], "target": "stiffness_loss"}
    tables = {"scatter": severity.tables["scatter"], "coverage": pd.DataFrame(cell | ends)}
    heading, _, figure = list(evaluation_figures(replace(severity, tables=tables)))[-1]
    assert heading == "Coverage cell by cell: stiffness_loss"
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["loss 0.1", "loss 0.2"]


def test_the_table_tells_the_figures(location, pages):
    page = pages["location"]
    exact = location.metrics["a"]["p_exact"]
    ends = f'<span class="ends">[{exact.low:.3f}, {exact.high:.3f}]</span>'
    assert f'<td>P(exact tooth)</td><td class="ours">{exact.value:.3f} {ends}</td>' in page
    assert "The best possible answer (the Bayes bound) is not computed." in page


def test_a_text_with_a_bracket_is_no_interval(location):
    """Cells were cut where a bracket begins."""
    metrics = {"a": location.metrics["a"], "b [untuned]": location.metrics["b"]}
    page = evaluation_html(replace(location, metrics=metrics, tables={}), title="t")
    assert "<th>b [untuned]</th>" in page


def test_what_the_circular_picture_shows_adds_up(location):
    figure = next(figure for heading, _, figure in evaluation_figures(location) if heading.startswith("Distance"))
    missed = float(figure.axes[0].get_title(loc="left").split("missed: ")[1])
    assert missed == pytest.approx(1 - location.metrics["a"]["p_detected"].value, abs=5e-4)
    heights = np.array([bar.get_height() for bar in figure.axes[0].patches])
    floor = np.floor(np.log10(1 / (120 * TEETH)))
    assert 10 ** (heights[0] + floor) == pytest.approx(location.metrics["a"]["p_exact"].value)


def test_the_bound_and_an_alarm_are_shown(location, pages):
    bound = {"accuracy": Estimate(value=0.1, low=0.05, high=0.15), "pd_at_1e-2": Estimate(value=0.2, low=0.1, high=0.3)}
    tables = {"roc": location.tables["roc"]}
    page = evaluation_html(replace(location, bound=bound, above=("accuracy",), tables=tables), title="t")
    assert '<p class="alarm">The model is better than the best possible answer (P(correct), healthy too)' in page
    assert "<th>bound</th>" in page
    assert "0.100 <span" in page
    assert 'class="alarm"' not in pages["location"]


def test_files_of_a_report(location, pages, tmp_path):
    page = write_evaluation_report(location, tmp_path / "new" / "report", title="a & b <c>")
    assert sorted(one.name for one in page.parent.iterdir()) == ["evaluation.json", "index.html"]
    numbers = json.loads((page.parent / "evaluation.json").read_text(encoding="utf-8"))
    assert numbers["metrics"]["a"]["p_exact"]["value"] == location.metrics["a"]["p_exact"].value
    assert numbers["metrics"]["b"]["circular_bias"]["value"] is None
    assert set(numbers["tables"]) == set(location.tables)
    assert numbers["tables"]["roc"]["detected"] == location.tables["roc"]["detected"].tolist()
    assert page.read_text(encoding="utf-8") == pages["location"]  # the same each time


@pytest.fixture(scope="module")
def compared(location):
    bands = pd.DataFrame(
        {
            "band": ["-10 to -6 dB", "-6 to -2 dB", "all"],
            "low_db": [-10.0, -6.0, -10.0],
            "high_db": [-6.0, -2.0, -2.0],
            "rows": [500, 500, 1000],
            "specimens": 8,
            "error": [0.41, 0.2, 0.3],
            "bound_error": [0.4, 0.2, 0.3],
            "chance": 0.8,
            "loss_db": [0.31, np.inf, 0.2],
            "loss_db_low": [0.1, np.nan, 0.1],
            "loss_db_high": [0.5, np.nan, 0.3],
        }
    )
    criteria = CriteriaSettings(loss_db=0.25, a90_ratio=1.05, ece=0.01, undercovered_cells=0.01)
    return replace(
        location,
        efficiency=bands,
        criteria=assess_criteria(criteria, TARGETS["location"], [], bands, {}),
        notes=(Note(code="a-note", text="Because a < b."),),
    )


def test_the_best_possible_and_the_criteria_are_sections(compared, pages):
    page = evaluation_html(compared, title="t")
    assert "Against the best possible" not in pages["location"]
    assert "Criteria" not in pages["location"]
    section = page.split("<h2>Against the best possible</h2>")[1].split('<div class="pictures">')[0]
    assert '<td>0.410</td><td>0.400</td><td>0.310 <span class="ends">[0.100, 0.500]</span></td>' in section
    assert "<td>beyond</td>" in section
    assert "<td>no</td><td>Exceeded in 2 of 2 noise bands: 0.31 at -10 to -6 dB, beyond the range at" in section
    assert "Because a &lt; b." in section
    assert section.count("<td>not estimated</td>") == 3


def test_the_loss_is_drawn_by_noise_band(compared):
    assert "Loss" not in next(iter(evaluation_figures(compared)))[0]  # of one band only it is known
    known = replace(compared, efficiency=compared.efficiency.replace(np.inf, 0.2))
    heading, _, figure = next(iter(evaluation_figures(known)))
    assert heading == "Loss against the best possible, by noise band"
    assert figure.axes[0].containers[0].lines[0].get_xydata().tolist() == [[-8.0, 0.31], [-4.0, 0.2]]


def test_the_text_has_them_compactly(compared):
    said = evaluation_text(compared)
    assert re.search(r"^-10 to -6 dB +500 +0\.410 +0\.400 +0\.310 \[0\.100, 0\.500\]$", said, re.MULTILINE)
    assert re.search(r"^loss against the bound, dB +0\.25 +beyond +-6 to -2 dB +no$", said, re.MULTILINE)
    assert "Because a < b." in " ".join(said.split())
    assert max(map(len, said.splitlines())) <= 120


def test_the_roc_of_the_bound_is_drawn(location):
    curve = location.tables["roc"].assign(estimator="bound", detected=1.0)
    tables = {"roc": pd.concat([location.tables["roc"], curve])}
    (_, _, figure) = next(iter(evaluation_figures(replace(location, tables=tables))))
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    assert (lines["bound"].get_ydata() == 1).all()


def test_numbers_of_averages_are_labelled_as_they_are(location):
    """A logarithmic axis would label powers of ten only, of which there may be none between the values."""
    table = location.tables["snr_db"]
    averages = table.assign(at=table["at"].map({-10.0: 36.0, 0.0: 102.0}))
    (_, _, figure), *_ = evaluation_figures(replace(location, tables={"averages": averages}))
    (axes,) = figure.axes
    figure.canvas.draw()
    assert [label.get_text() for label in axes.get_xticklabels()] == ["36", "102"]
    assert axes.get_xlabel() == "revolutions in the average"


@pytest.mark.parametrize("target", TARGETS)
def test_no_title_of_a_metric_states_a_unit_twice(target):
    titles = [metric.title for metric in TARGETS[target].metrics]
    assert [title for title in titles if re.search(r"_(deg|db|rpm)\b.*, (deg|dB|rpm)\b", title)] == []
