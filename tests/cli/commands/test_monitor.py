"""The command that watches a database of recordings: text, JSON, page, exit codes, and what it refuses."""

import json

import numpy as np
import pytest

from sigdb.ingest import IngestSettings, ingest

RATE, TEETH, REVS, SECONDS = 4096.0, 12, 10.0, 2.0


def write(path, seed, *, event):
    """A gear with uneven teeth, an event at tooth 5, and a tacho."""
    stream, t = np.random.default_rng(seed), np.arange(int(RATE * SECONDS)) / RATE
    passes = TEETH * REVS * t
    errors = 1 + 0.1 * np.random.default_rng(1).standard_normal(TEETH)
    mesh = sum(np.cos(2 * np.pi * h * passes + h) / h for h in (1, 2, 3))
    after = (passes - 5.1 + TEETH / 2) % TEETH - TEETH / 2
    x = errors[passes.astype(int) % TEETH] * mesh + event * np.exp(-2 * after**2) * np.cos(3 * np.pi * after)
    np.savez(path, a1=x + 0.3 * stream.standard_normal(t.size), tacho=5.0 * (REVS * t % 1 < 0.1))


@pytest.fixture(scope="module")
def machine(tmp_path_factory, few_tries):
    """Seven weekly recordings of a machine; the last one has an event."""
    folder = tmp_path_factory.mktemp("watched")
    lines = ["file,machine,date,state"]
    for number in range(7):
        write(folder / f"w{number}.npz", number, event=1.5 * (number == 6))
        lines.append(f"w{number}.npz,press,2026-01-{1 + 4 * number:02d},{'normal' if number < 6 else 'unknown'}")
    (folder / "recordings.csv").write_text("\n".join(lines), encoding="utf-8")
    settings = IngestSettings(teeth=str(TEETH), channels=("a1",), reading={"tacho": "tacho", "sampling_rate": RATE})
    ingest(folder, folder / "db", settings=settings, jobs=1)
    return folder / "db"


@pytest.fixture(autouse=True)
def _cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SIGDB_CACHE", str(tmp_path / "cache"))


def test_an_alarm_has_its_exit_code_in_text_json_and_page(leave, machine, tmp_path):
    out = tmp_path / "history"
    code, text, err = leave("monitor", machine, "--out", out)
    assert (code, err) == (1, f"page: {out / 'index.html'}\n")
    assert text.startswith("press, a1, 12 teeth\n  One tooth stands out: 5 ± 2.\n  Limit: ")
    assert "for 1 false alarms a year at 91.3 looks a year, from 6 healthy looks." in text
    code, text, err = leave("monitor", machine, "--format", "json")
    (found,) = json.loads(text)
    assert (code, err, found["kind"], found["machine"]) == (1, "", "one tooth", "press")
    assert [look["alarm"] for look in found["looks"]] == [False] * 6 + [True]
    assert json.loads((out / "monitor.json").read_text(encoding="utf-8"))[0]["looks"] == found["looks"]
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "<strong>One tooth stands out: 5 ± 2.</strong>" in page
    assert page.count("<img") == 2
    assert "<script" not in page


def test_without_the_last_recording_nothing_has_changed_and_results_are_kept(leave, machine, monkeypatch):
    options = ("--where", "recording <> 'w6.npz'", "--format", "json")
    code, first, _ = leave("monitor", machine, *options)
    assert (code, json.loads(first)[0]["kind"]) == (0, "no change")
    monkeypatch.setattr("sigdb.monitoring.look_results.Reference.result", None)
    monkeypatch.setattr("sigdb.monitoring.look_results.Reference.power", None)
    assert leave("monitor", machine, *options) == (0, first, "")


@pytest.mark.parametrize(
    ("options", "code", "says"),
    [
        (("--where", "machine = 'other'"), 2, "has no usable row where machine = 'other'"),
        (("--where", "machine = "), 2, "error: "),
        (("--baseline", "3"), 2, "3"),
        (("--where", "health <> 'healthy'", "--format", "json"), 3, ""),
    ],
)
def test_what_cannot_be_watched_has_a_line_and_a_code(leave, machine, options, code, says):
    found, _, err = leave("monitor", machine, *options)
    assert found == code
    assert says in err


def test_simulated_rows_are_refused(leave, folder):
    code, out, err = leave("monitor", folder / "signatures")
    assert (code, out) == (2, "")
    assert "it is no database of recordings" in err
