"""Unit: the page of recordings' signatures stands alone and says what its numbers say."""

import base64
import json
import re

import numpy as np
import pytest
from markupsafe import escape

from sigdb.core import Note
from sigdb.recording import Channel, Recording, recorded_history, recorded_signature
from sigdb.report import recorded_figures, recorded_text, write_recorded_report


def signature_of(level, source, seconds=3, fs=5000.0):
    theta = 2 * np.pi * 20 * np.arange(int(seconds * fs)) / fs
    x = level * (np.cos(12 * theta) + 0.5 * np.cos(11 * theta)) + 0.1 * np.cos(5.5 * theta)
    x += 0.1 * np.random.default_rng(1).normal(size=x.size)
    channels = (
        Channel(name="a<1>", samples=x, sampling_rate=fs, unit="m/s^2"),
        Channel(name="tacho", samples=np.cos(theta), sampling_rate=fs),
    )
    notes = (Note(code="filled-gaps", text="2 samples were missing & filled"),)
    return recorded_signature(Recording(source=source, channels=channels, tacho="tacho", notes=notes), teeth=12)


@pytest.fixture(scope="module")
def signatures():
    return [signature_of(1, "first.csv"), signature_of(2, "<script>second</script>.csv")]


@pytest.fixture(scope="module")
def page(signatures, tmp_path_factory):
    history = recorded_history(signatures, baseline=1)
    return write_recorded_report(signatures, tmp_path_factory.mktemp("page"), history=history, title="A & B")


def test_the_page_needs_nothing_else(page):
    text = page.read_text(encoding="utf-8")
    assert not re.findall(r"<script|<link|https?://|url\(", text)
    pictures = re.findall(r'src="data:image/png;base64,([^"]*)"', text)
    assert len(pictures) == text.count("<img") == 1 + 2 * 6
    assert all(base64.b64decode(one, validate=True).startswith(b"\x89PNG") for one in pictures)


def test_the_page_holds_facts_and_notes_and_no_markup_of_names(page, signatures):
    text = page.read_text(encoding="utf-8")
    assert "<script" not in text
    assert "&lt;script&gt;second&lt;/script&gt;.csv" in text
    assert "<h1>A &amp; B</h1>" in text
    for one in signatures:
        for note in one.notes:
            assert f"<li>{escape(note.text)}</li>" in text
        assert f"{one.averages} revolutions; 0 dropped" in text
        assert f"<td>{escape(one.repeatability.answer)} (ratio {one.repeatability.energy_ratio:.3g}, limit" in text
        assert f"<td>{one.indicators['kurtosis']:.4g}</td>" in text


def test_the_numbers_beside_the_page_are_those_of_the_signatures(page, signatures):
    numbers = json.loads((page.parent / "signature.json").read_text(encoding="utf-8"))
    assert [one["source"] for one in numbers["signatures"]] == [one.source for one in signatures]
    np.testing.assert_array_equal(numbers["signatures"][1]["tsa"], signatures[1].tsa)
    repeats = numbers["signatures"][1]["repeatability"]
    assert (repeats["kind"], repeats["place"]) == ("nothing stands out", signatures[1].repeatability.place)
    assert [row["source"] for row in numbers["history"]] == ["first.csv", "<script>second</script>.csv"]


def test_lines_that_are_found_are_marked(signatures):
    figures = {heading: figure for heading, _, figure in recorded_figures(signatures[0])}
    (spectrum,) = figures["Order spectrum over the angle"].axes
    marked = {line.get_label(): sorted(line.get_xdata()) for line in spectrum.lines if line.get_linestyle() == "None"}
    assert marked["mesh"] == [12]
    assert marked["sideband"] == [11]
    assert marked["unnamed"] == pytest.approx([5.5], abs=1e-3)
    (average,) = figures["Synchronous average"].axes
    np.testing.assert_array_equal(average.lines[0].get_ydata()[:-1], signatures[0].tsa)
    assert [text.get_text() for text in average.texts] == [str(tooth) for tooth in range(1, 13)]


def test_the_text_lists_what_was_found_only(signatures):
    text = recorded_text(signatures[0])
    lines = text.split("over the angle\n")[1].split("\n\n")[0].splitlines()[1:]
    assert [line.split()[0] for line in lines] == ["5.500", "11.000", "12.000"]
    assert "2 samples were missing & filled" in text


def test_a_page_of_many_teeth_shows_a_distribution_of_the_mesh_orders_only(tmp_path):
    theta = 2 * np.pi * np.arange(20_000) / 2_000
    x = np.cos(100 * theta)
    channels = (
        Channel(name="a1", samples=x, sampling_rate=20_000.0),
        Channel(name="tacho", samples=np.cos(theta), sampling_rate=20_000.0),
    )
    signature = recorded_signature(Recording(source="wide", channels=channels, tacho="tacho"), teeth=100)
    *_, (_, _, figure) = recorded_figures(signature)
    image = figure.axes[0].images[0]
    # All of the power is at the mesh order, 1 in square of the amplitude: the sum over bins is K |z|^2.
    assert image.get_array().shape[1] == 1600
    sums = np.asarray(image.get_array()).sum(axis=0)
    np.testing.assert_allclose(sums, 1600, rtol=0.02)


def test_a_recording_without_the_gear_has_its_reason_and_no_indicators(tmp_path):
    theta = 2 * np.pi * 20 * np.arange(20_000) / 5000
    x = np.random.default_rng(2).normal(size=theta.size)
    channels = (
        Channel(name="a1", samples=x, sampling_rate=5000.0),
        Channel(name="tacho", samples=np.cos(theta), sampling_rate=5000.0),
    )
    signature = recorded_signature(Recording(source="noise", channels=channels, tacho="tacho"), teeth=12)
    text = recorded_text(signature)
    assert f"No indicators: {signature.presence.reason}" in text
    assert "mesh           not present: no mesh of 12 teeth stands out" in text
    page = write_recorded_report([signature], tmp_path).read_text(encoding="utf-8")
    assert f'<p class="alarm"><strong>No indicators: {signature.presence.reason}.</strong></p>' in page
    assert "<h3>Indicators</h3>" not in page
    assert json.loads((tmp_path / "signature.json").read_text(encoding="utf-8"))["signatures"][0]["indicators"] == {}
