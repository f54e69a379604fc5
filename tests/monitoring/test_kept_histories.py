"""Verification: kept histories equal a computation without a cache, and whatever changes is computed again."""

import shutil

import numpy as np
import pandas as pd
import pytest

from sigdb.ingest import IngestSettings, enter_findings, ingest
from sigdb.monitoring import MonitorSettings, kept_table, monitor, monitor_database

FS, TEETH = 2048.0, 12
SETTINGS = IngestSettings(
    teeth=str(TEETH), samples_per_tooth=16, reading={"tacho": "tacho", "sampling_rate": FS}, channels=("a1",)
)
MACHINES, LOOKS = ("fan", "press"), 7


def write(folder, machine, number, *, event=0.0):
    """A recording of uneven teeth, with an event at a tooth."""
    passes = TEETH * 20 * np.arange(int(2 * FS)) / FS
    errors = 1 + 0.2 * np.random.default_rng(len(machine)).normal(size=TEETH)
    after = (passes - 5.1 + TEETH / 2) % TEETH - TEETH / 2
    x = np.cos(2 * np.pi * passes) * errors[passes.astype(int) % TEETH]
    x += event * np.exp(-2 * after**2) * np.cos(3 * np.pi * after)
    x += 0.1 * np.random.default_rng(100 + number).normal(size=passes.size)
    np.savez(folder / f"{machine}{number}.npz", a1=x, tacho=5.0 * (passes / TEETH % 1 < 0.1))


def add(folder, database, machines, numbers, *, event=0.0):
    """Ingest a recording of machines for each number, dated at uneven intervals."""
    folder.mkdir()
    lines = ["file,machine,date,state"]
    for number in numbers:
        for machine in machines:
            write(folder, machine, number, event=event)
            day = 1 + 3 * number + number % 2
            lines.append(f"{machine}{number}.npz,{machine},2026-01-{day:02d},{'normal' if number < 6 else ''}")
    (folder / "recordings.csv").write_text("\n".join(lines), encoding="utf-8")
    ingest(folder, database, settings=SETTINGS, jobs=1)


@pytest.fixture(scope="module")
def begun(tmp_path_factory):
    """Two machines, and the cache of a monitor that has seen them."""
    folder = tmp_path_factory.mktemp("watched")
    add(folder / "recordings", folder / "watched" / "db", MACHINES, range(LOOKS))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIGDB_CACHE", str(folder / "watched" / "cache"))
        monitor(folder / "watched" / "db")
    return folder / "watched"


@pytest.fixture
def folder(begun, tmp_path, monkeypatch):
    """Copies of the database and the cache."""
    shutil.copytree(begun, tmp_path / "copy")
    monkeypatch.setenv("SIGDB_CACHE", str(tmp_path / "copy" / "cache"))
    return tmp_path / "copy"


@pytest.fixture
def computed(monkeypatch):
    """Machines whose history was computed."""
    machines, compute = [], monitor_database.gear_history

    def noted(looks, settings, *, place, kept):
        machines.append(place["machine"])
        return compute(looks, settings, place=place, kept=kept)

    monkeypatch.setattr(monitor_database, "gear_history", noted)
    return machines


def watched(folder, computed, settings=None, where=None):
    """Return histories, and the machines of those that were computed."""
    computed.clear()
    return monitor(folder / "db", settings, where=where), list(computed)


def check_equal_to_fresh(folder, found):
    """Compare histories with those without a cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIGDB_CACHE", str(folder / "none"))
        fresh = monitor(folder / "db")
    for one, other in zip(found, fresh, strict=True):
        assert one.as_json() == other.as_json()
        assert (one.answer, one.notes, one.change, one.trend) == (other.answer, other.notes, other.change, other.trend)
        pd.testing.assert_frame_equal(one.looks, other.looks)
        np.testing.assert_array_equal(one.tooth_map, other.tooth_map)
        np.testing.assert_array_equal(one.growth.statistic, other.growth.statistic)


def test_a_history_without_a_new_look_is_not_computed_again(folder, computed):
    add(folder / "more", folder / "db", ["press"], [LOOKS], event=1.5)
    found, machines = watched(folder, computed)
    assert machines == ["press"]
    assert [history.answer.exit_code == 1 for history in found] == [False, True]
    check_equal_to_fresh(folder, found)
    again, machines = watched(folder, computed)
    assert machines == []
    check_equal_to_fresh(folder, again)


def test_a_moved_database_has_its_histories(folder, computed):
    (folder / "elsewhere").mkdir()
    (folder / "db").rename(folder / "elsewhere" / "db")
    found, machines = watched(folder / "elsewhere", computed)
    assert (len(found), machines) == (2, [])


@pytest.mark.parametrize("settings", [{"false_alarms_a_year": 2.0}, {"severity_limit_db": 30.0}])
def test_other_settings_are_computed(folder, computed, settings):
    assert watched(folder, computed, MonitorSettings(**settings))[1] == list(MACHINES)


def test_a_condition_selects_what_is_computed(folder, computed):
    assert watched(folder, computed, where="machine = 'fan'")[1] == ["fan"]
    assert watched(folder, computed, where="recording <> 'fan6.npz'")[1] == list(MACHINES)


def test_a_corrected_label_is_computed(folder, computed):
    """One part holds a recording here, so that the other machine's parts are as they were."""
    (folder / "found.csv").write_text("date,file,tooth,kind\n2026-02-01,fan5.npz,3,pitting\n", encoding="utf-8")
    assert enter_findings(folder / "db", folder / "found.csv") == 1
    found, machines = watched(folder, computed)
    assert [history.healthy_looks for history in found] == [5, 6]
    assert machines == ["fan"]
    check_equal_to_fresh(folder, found)


def test_another_recording_under_the_same_name_is_computed(folder, computed, tmp_path):
    """The part of a recording is made again from another one, with as many rows."""
    add(folder / "more", folder / "db", ["press"], [LOOKS])
    shutil.copytree(folder / "db", tmp_path / "before")
    assert watched(folder, computed)[0][1].answer.exit_code != 1
    shutil.rmtree(folder / "db")
    shutil.copytree(tmp_path / "before", folder / "db")
    (folder / "db" / "receipts" / f"rows-{2 * LOOKS:05d}.json").unlink()
    write(folder / "more", "press", LOOKS, event=1.5)
    ingest(folder / "more", folder / "db", settings=SETTINGS, jobs=1)
    found, machines = watched(folder, computed)
    assert (found[1].answer.exit_code, machines) == (1, ["press"])


def test_another_version_of_sigdb_computes_all(folder, computed, monkeypatch):
    monkeypatch.setattr(kept_table, "__version__", "0.0.0")
    assert watched(folder, computed)[1] == list(MACHINES)


@pytest.mark.parametrize("at", [0, 40, -5])
def test_a_damaged_cache_is_made_again(folder, computed, at):
    (place,) = (folder / "cache").glob("monitor-histories-*")
    content = bytearray(place.read_bytes())
    content[at] ^= 1
    place.write_bytes(content)
    assert watched(folder, computed)[1] == list(MACHINES)
    assert watched(folder, computed)[1] == []


def test_a_history_that_cannot_be_judged_is_kept_too(folder, computed):
    for expected in (["fan"], []):
        (found,), machines = watched(folder, computed, where="machine = 'fan' and health <> 'healthy'")
        assert machines == expected
        assert found.answer.kind == "cannot be judged"
        assert found.looks.empty


def test_a_newer_recording_without_result_has_no_answer(folder, computed):
    """A sensor that has died: without the note and the exit code, the last answer would stand for ever."""
    kinds = [history.answer.exit_code for history in watched(folder, computed)[0]]
    (folder / "more").mkdir()
    (folder / "more" / "dead.npz").write_bytes(b"PK\x03\x04 no archive")
    lines = "file,machine,date\ndead.npz,press,2026-01-30"
    (folder / "more" / "recordings.csv").write_text(lines, encoding="utf-8")
    ingest(folder / "more", folder / "db", settings=SETTINGS, jobs=1)
    found, machines = watched(folder, computed)
    assert machines == ["press"]
    assert [history.answer.exit_code for history in found] == [kinds[0], 3]
    assert found[1].notes[-1].code == "newer-without-result"
    assert "1 newer recording has no result, the last is dead.npz: " in found[1].notes[-1].text
    add(folder / "later", folder / "db", ["press"], [LOOKS + 3], event=1.5)
    found, _ = watched(folder, computed)
    assert [note.code for note in found[1].notes] == []
    assert found[1].answer.exit_code == 1
