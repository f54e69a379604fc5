"""Unit: findings of an inspection become labels of the rows before it, of later rows too, and survive a stop."""

import pytest

import sigdb
from sigdb.core.errors import InputError
from sigdb.ingest import enter_findings, ingest, verify


def findings(tmp_path, text):
    (tmp_path / "findings.csv").write_text(text, encoding="utf-8")
    return tmp_path / "findings.csv"


def labels(folder):
    rows = sigdb.open(folder).cases("draw = 0 and channel = 'a1'").set_index("recording")
    return {name: (row["tooth"], row["kind"], row["label_trust"]) for name, row in rows.iterrows()}


def test_a_finding_labels_the_rows_of_its_machine_up_to_its_date(copy, tmp_path):
    before = labels(copy)
    signals = {path: path.read_bytes() for path in (copy / "signals").rglob("*.parquet")}
    changed = enter_findings(
        copy, findings(tmp_path, "date,machine,tooth,kind,severity\n2026-02-10,m2,7,pitting,slight\n")
    )
    assert changed == 4  # the row without result has a later date
    assert labels(copy) == before | {"m2-a.npz": (7, "pitting", "inspected")}
    assert sigdb.open(copy).cases("tooth = 7")["severity"].tolist() == ["slight"] * 4
    assert {path: path.read_bytes() for path in signals} == signals
    assert verify(copy, deep=True) == ()


def test_a_finding_holds_from_the_inspection_before_it_on(copy, tmp_path):
    text = "date,machine,tooth,kind\n2026-02-20,m1,4,crack\n2026-01-20,m1,0,none\n"
    assert enter_findings(copy, findings(tmp_path, text)) == 8
    assert labels(copy)["m1-a.npz"] == (0, "none", "inspected")
    assert labels(copy)["m1-b.npz"] == (4, "crack", "inspected")


def test_a_finding_of_files_needs_no_date(copy, tmp_path):
    before = labels(copy)
    assert set(before) == {"m1-a.npz", "m1-b.npz", "m2-a.npz"}
    assert enter_findings(copy, findings(tmp_path, "file,tooth,kind\nm1-*,3,pitting\nm2-a.npz,0,none\n")) == 12
    assert labels(copy) == {
        "m1-a.npz": (3, "pitting", "inspected"),
        "m1-b.npz": (3, "pitting", "inspected"),
        "m2-a.npz": (0, "none", "inspected"),
    }


def test_rows_that_come_later_have_the_labels_too(folder_copy, settings, copy, write_recording, tmp_path):
    enter_findings(copy, findings(tmp_path, "date,since,machine,tooth,kind\n2026-02-10,2026-02-01,m9,7,pitting\n"))
    place = tmp_path / "later"
    place.mkdir()
    for name in ("early.npz", "late.npz"):
        write_recording(place / name, seed=4)
    text = "file,machine,date\nearly.npz,m9,2026-01-05\nlate.npz,m9,2026-02-05T10:00\n"
    (place / "recordings.csv").write_text(text, encoding="utf-8")
    ingest(place, copy, settings=settings, jobs=1)
    found = labels(copy)
    assert found["late.npz"] == (7, "pitting", "inspected")
    assert found["early.npz"][1:] == ("unknown", "unknown")
    assert verify(copy) == ()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("date,machine\n", "has no finding"),
        ("date,machine,tooth\n,m1,4\n", "date is missing"),
        ("date,since,machine\n2026-01-01,2026-02-01,m1\n", "is after date"),
        ("machine,tooth\nm1,4\n", "line 2: date is missing"),
    ],
)
def test_a_mistake_in_a_finding_is_named(copy, tmp_path, text, message):
    with pytest.raises(InputError, match=message):
        enter_findings(copy, findings(tmp_path, text))


def test_the_labels_of_a_sweep_are_exact(of_a_sweep, tmp_path):
    with pytest.raises(InputError, match="whose labels are exact"):
        enter_findings(of_a_sweep, findings(tmp_path, "date,machine\n2026-01-01,m1\n"))
