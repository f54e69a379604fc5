"""Unit: the healthy rows of a database are the reference of a diagnosis, as their recordings are."""

import numpy as np
import pytest

import sigdb
from sigdb.core.errors import InputError
from sigdb.diagnosis.healthy_rows import healthy_rows
from sigdb.ingest import IngestSettings, ingest

FS, TEETH = 8192.0, 12
READING = {"tacho": "tacho", "sampling_rate": FS}


def write(path, seed, load, loss=0.0):
    """A gear of uneven teeth whose mesh grows with the load, with a weak tooth 5."""
    stream, turns = np.random.default_rng(seed), 20 * np.arange(int(4 * FS)) / FS
    errors = 1 + 0.2 * np.random.default_rng(5).normal(size=TEETH)
    errors[4] -= loss
    teeth = errors[(turns * TEETH).astype(int) % TEETH]
    mesh = np.cos(2 * np.pi * TEETH * turns) + 0.4 * np.cos(4 * np.pi * TEETH * turns + 1)
    x = (1 + load / 100) * mesh * teeth + 0.1 * stream.normal(size=turns.size)
    np.savez(path, a1=x, tacho=5.0 * (turns % 1 < 0.1))


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Recordings at three loads, one of them of a later date, with a database, and one with a weak tooth."""
    folder = tmp_path_factory.mktemp("healthy")
    lines = ["file,date,load,state"]
    for number, load in enumerate((40.0, 60.0, 80.0)):
        write(folder / f"h{number}.npz", number, load)
        lines.append(f"h{number}.npz,2026-0{number + 1}-01,{load},{'normal' if number < 2 else ''}")
    (folder / "recordings.csv").write_text("\n".join(lines), encoding="utf-8")
    settings = IngestSettings(teeth="12", reading=READING)
    ingest(folder, folder / "db", settings=settings, jobs=1)
    write(folder / "run.npz", 9, 50.0, loss=0.6)
    return folder


def numbers(diagnosis):
    return diagnosis.kind, diagnosis.finding.score, diagnosis.law.pieces, diagnosis.law.pulse


def test_the_answer_is_that_of_the_recordings(place):
    files = [place / f"{name}.npz" for name in ("h0", "h1", "h2")]
    stored = sigdb.diagnose(place / "run.npz", healthy=place / "db", where="date < '2026-04-01'", load=50.0)
    raw = sigdb.diagnose(
        place / "run.npz", healthy=files, teeth=12, load=50.0, healthy_load=[40.0, 60.0, 80.0], **READING
    )
    assert [each.source for each in stored.healthy] == [file.name for file in files]
    assert numbers(stored)[0] == numbers(raw)[0] == "one tooth"
    assert numbers(stored)[1:] == pytest.approx(numbers(raw)[1:], rel=1e-3)
    assert [each.tooth for each in stored.locations] == [each.tooth for each in raw.locations] == [5]


def test_several_averages_of_a_recording_are_one_healthy_recording(place, tmp_path):
    settings = IngestSettings(teeth="12", reading=READING, averages=20)
    ingest(place, tmp_path / "db", settings=settings, jobs=1)
    stored, _ = healthy_rows(tmp_path / "db", where=None, teeth=12, channel="a1", samples=768)
    assert [(each.signature.averages, len(each.signature.groups), each.load) for each in stored] == [
        (60, 60, 40.0),
        (60, 60, 60.0),
    ]


def test_rows_of_unknown_health_count_only_where_a_condition_selects_them(place):
    ask = {"teeth": 12, "channel": "a1", "samples": 768}
    assert [each.load for each in healthy_rows(place / "db", where=None, **ask)[0]] == [40.0, 60.0]
    assert [each.load for each in healthy_rows(place / "db", where="load > 50", **ask)[0]] == [60.0, 80.0]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"where": "date < '2020-01-01'"}, "no row meets"),
        ({"where": "dates < 3"}, "dates"),
        ({"samples_per_tooth": 32}, "its averages have 768 samples, and that of the recording 384"),
        ({"healthy": (), "where": "load > 1", "teeth": 12}, "healthy names none"),
    ],
)
def test_a_mistake_is_named(place, options, message):
    with pytest.raises(InputError, match=message):
        sigdb.diagnose(place / "run.npz", **{"healthy": place / "db", **READING, **options})
