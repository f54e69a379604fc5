"""Unit: the table of what was read from a recording."""

import numpy as np

from sigdb.core import Note
from sigdb.recording import Channel, Recording
from sigdb.report import Terminal, overview_text

X = np.clip(np.random.default_rng(6).normal(size=4000), -2, 2)


def recording(**facts):
    channels = (
        Channel(name="a1", samples=X, sampling_rate=2000.0, unit="m/s^2", rate_from="column time", start=0.05),
        Channel(name="n", samples=5.0 * (np.arange(4000) % 100 < 10), sampling_rate=2000.0),
    )
    return Recording(source="run.csv", channels=channels, tacho="n", **facts)


def test_channels_and_what_was_left_out():
    note = Note(code="ramp-left-out", text="k only rises and was left out", values={"column": "k"})
    text = overview_text(recording(notes=(note, Note(code="sampling-rate", text="2000 Hz"))))
    first, head, a1, n, title, left_out = text.splitlines()
    assert first == "Read from run.csv"
    assert head.split()[:4] == ["channel", "unit", "rate,", "Hz"]
    share = 100 * np.mean(np.abs(X) == 2)
    assert a1.split() == ["a1", "m/s^2", "2000", "column", "time", "0.05", "2", "-2", "2",
                          f"{np.sqrt(np.mean(X**2)):.4g}", f"{share:.2g}", "0", "0"]  # fmt: skip
    assert n.split()[-3:] == ["-", "-", "-"]
    assert (title, left_out) == ("Left out", "  - k only rises and was left out")


def test_nothing_was_left_out():
    text = overview_text(recording())
    assert "Left out" not in text
    assert "not stated" in text


def test_a_narrow_terminal():
    assert max(map(len, overview_text(recording(), terminal=Terminal(width=80)).splitlines())) <= 80
