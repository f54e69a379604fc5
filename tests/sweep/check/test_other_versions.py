"""Unit: a database keeps the columns that it was begun with, whatever a later version of sigdb would store."""

import shutil
import sys
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import pytest

from sigdb.core.errors import DatabaseError
from sigdb.database.store.schema import SCHEMA_FILE, read_schema
from sigdb.database.store.store import Store
from sigdb.signature import FEATURES, INDICATORS
from sigdb.sweep import refine, repair, run, verify

COMPATIBILITY = Path(__file__).parents[2] / "compatibility" / "version_0_1" / "signatures"
NEW = "largest_of_all"


@pytest.fixture
def with_indicators(monkeypatch):
    """Make another version of sigdb: replace the tables of indicators and features wherever they are used."""

    def use(indicators):
        tables = {"INDICATORS": INDICATORS, "FEATURES": FEATURES}
        others = [feature for name, feature in FEATURES.items() if name not in INDICATORS]
        columns = [FEATURES.get(name, replace(FEATURES["rms"], name=name)) for name in indicators]
        changed = {
            "INDICATORS": MappingProxyType(indicators),
            "FEATURES": MappingProxyType({feature.name: feature for feature in (*columns, *others)}),
        }
        for module in [module for name, module in sys.modules.items() if name.startswith("sigdb")]:
            for name, table in tables.items():
                if vars(module).get(name) is table:
                    monkeypatch.setattr(module, name, changed[name])

    return use


def more():
    return {**INDICATORS, NEW: replace(INDICATORS["rms"], name=NEW)}


def fewer():
    return {name: indicator for name, indicator in INDICATORS.items() if name != "fm4"}


@pytest.fixture(params=[more, fewer])
def another_version(request, with_indicators):
    return lambda: with_indicators(request.param())


def test_a_database_of_another_version_is_not_damaged(another_version, small_run):
    another_version()
    for folder in (small_run[0], COMPATIBILITY):
        assert verify(folder, deep=True, sample=4) == ()


def test_another_sentence_about_a_failed_row_is_no_damage(plan_of, tmp_path, monkeypatch):
    text = (
        "seed = 1\nspecimens = 4\n[[sweep.grid]]\ntooth = 3\nstiffness_loss = 0.4\nindex_error = 1e-4\n"
        "[signature]\nsamples_per_tooth = 32\n"
    )
    assert run(plan_of(text), tmp_path, jobs=1).failed > 0
    monkeypatch.setattr("sigdb.sweep.work.averages._contact_loss_status", lambda least: f"lost contact: {least}")
    assert verify(tmp_path, deep=True) == ()


def test_a_new_database_has_the_columns_of_its_version(with_indicators, plan_of, tmp_path):
    with_indicators(more())
    run(plan_of("[[sweep.grid]]\ntooth = 1\nstiffness_loss = 0.3\n"), tmp_path, jobs=1)
    assert NEW in read_schema(Store.at(tmp_path)).arrow("features").names
    assert verify(tmp_path, deep=True) == ()


def test_a_database_that_goes_on_keeps_its_columns(with_indicators, parts_plan, parts_folder, digests, tmp_path):
    copy = shutil.copytree(parts_folder, tmp_path / "copy")
    (copy / "receipts" / "rows-00001.json").unlink()
    with_indicators(more())
    run(parts_plan, copy, jobs=1)
    assert digests(copy) == digests(parts_folder)
    assert (copy / SCHEMA_FILE).read_bytes() == (parts_folder / SCHEMA_FILE).read_bytes()


def test_a_column_that_this_version_does_not_compute_is_named(with_indicators, parts_plan, parts_folder, tmp_path):
    copy = shutil.copytree(parts_folder, tmp_path / "copy")
    (copy / "receipts" / "rows-00001.json").unlink()
    with_indicators(fewer())
    with pytest.raises(DatabaseError, match=r"has column fm4 of features, which this sigdb does not compute; go on"):
        run(parts_plan, copy, jobs=1)


def test_refining_keeps_the_columns(with_indicators, plan_of, tmp_path):
    text = "[[sweep.grid]]\ntooth = [1, 2]\nphase_shift_deg = [0.5, 4.0]\n[signature]\nsamples_per_tooth = 32\n"
    run(plan_of(text), tmp_path, jobs=1)
    before = (tmp_path / SCHEMA_FILE).read_bytes()
    with_indicators(more())
    assert refine(tmp_path, match=0.9999, cases=10, rounds=1, jobs=1).rows > 0
    assert (tmp_path / SCHEMA_FILE).read_bytes() == before
    assert verify(tmp_path, deep=True) == ()


@pytest.mark.parametrize("content", [None, b"{}", b'{"sha256": "0",\n "templates": []}\n'])
def test_a_lost_schema_is_written_again_from_the_parts(with_indicators, parts_folder, tmp_path, content):
    copy = shutil.copytree(parts_folder, tmp_path / "copy")
    if content is None:
        (copy / SCHEMA_FILE).unlink()
    else:
        (copy / SCHEMA_FILE).write_bytes(content)
    with_indicators(more())
    (finding,) = verify(copy)
    assert (finding.kind, finding.file) == ("damage", SCHEMA_FILE)
    assert repair(copy, jobs=1).left == ()
    assert (copy / SCHEMA_FILE).read_bytes() == (parts_folder / SCHEMA_FILE).read_bytes()
