"""Unit: parts of added features hold a row for each row of the part, also for those without an average."""

import re

import numpy as np
import pytest

import sigdb
from sigdb.database.added.added_part import AddedWork, make_added_part, probed_names
from sigdb.database.added.added_set import AddedSet, read_added_sets
from sigdb.database.added.feature_function import FeatureFunction
from sigdb.database.store.receipts import read_receipt
from sigdb.database.store.store import DamagedFileError, Store

MODULE = """
def facts(tsa, teeth, torque, scatter, sensor, unit):
    return {"teeth seen": teeth, "torque seen": torque, "scatter seen": scatter, "first": tsa[0],
            "letters": len(sensor) + 100 * len(unit)}
"""


@pytest.fixture
def added(copy, tmp_path, monkeypatch):
    """A database with failed rows and two sensors, with the facts that a function gets as columns."""
    monkeypatch.chdir(tmp_path)
    name = re.sub(r"\W", "_", f"part_{tmp_path.name}")
    (tmp_path / f"{name}.py").write_text(MODULE, encoding="utf-8")
    function = FeatureFunction.of(f"{name}:facts")
    database = sigdb.open(copy)
    one = AddedSet(
        module=name,
        function="facts",
        module_sha256=function.sha256,
        names=("teeth seen", "torque seen", "scatter seen", "first", "letters"),
        sensors=database.sensors,
        help="Facts of the row.",
    )
    one.write(database.store)
    units = {sensor: database.unit("tsa", sensor) for sensor in database.sensors}
    receipt = make_added_part(AddedWork(added=one, function=function, units=units), database.store, 0)
    return copy, one, receipt


def test_each_row_has_the_facts_of_its_own(added):
    folder, one, receipt = added
    database = sigdb.open(folder)
    second = database.sensors[1]
    cases = database.cases()
    ok = cases["status"] == "ok"
    assert (receipt.rows, receipt.failed) == (len(cases), (~ok).sum())
    assert receipt.failed > 0
    assert set(cases.loc[~ok, "facts_status"]) == {"the row has no average"}
    assert set(cases.loc[ok, "facts_status"]) == {"ok"}
    seen = [column.name for column in one.columns[:-1]]
    assert cases.loc[~ok, seen].isna().all(axis=None)
    rows = cases[ok]
    for name, source in {"teeth seen": "teeth", "torque seen": "torque", "scatter seen": "scatter"}.items():
        np.testing.assert_array_equal(rows[name], rows[source])
    np.testing.assert_array_equal(rows[f"scatter seen__{second}"], rows[f"scatter__{second}"])
    ids = rows.loc[rows["teeth"] == 11, "id"].to_numpy()
    first = rows.set_index("id").loc[ids]
    for sensor, name in ((database.sensors[0], "first"), (second, f"first__{second}")):
        np.testing.assert_array_equal(first[name], database.signals(ids, sensor=sensor)["tsa"][:, 0])
    letters = len(second) + 100 * len(database.unit("tsa", second))
    assert set(rows[f"letters__{second}"]) == {letters}


def test_the_names_of_all_tooth_counts(added, tmp_path):
    folder, one, _ = added
    database = sigdb.open(folder)
    (tmp_path / f"{one.module}_names.py").write_text(
        "def of_teeth(tsa, teeth):\n    if teeth == 12: raise ValueError(teeth)\n    return {f'of {teeth}': 1}\n",
        encoding="utf-8",
    )
    function = FeatureFunction.of(f"{one.module}_names:of_teeth").load()
    some = "select teeth, min(id) as id from features where status = 'ok' group by teeth order by id"
    rows = database.arrow(some)
    tsa = database.signal_rows(rows["id"].to_numpy(), ["tsa"])["tsa"]
    units = dict.fromkeys(database.sensors, "m")
    names, why = probed_names(function, rows.append_column("tsa", tsa), database.sensors, units)
    assert set(rows["teeth"].to_pylist()) == {11, 12}
    assert names == ["of 11"]
    assert why == "ValueError: 12"


def test_a_description_that_is_another_sets_is_refused(added):
    folder, one, _ = added
    store = Store.at(folder)
    path = folder / "added" / f"{one.module}.other.json"
    path.write_bytes((folder / one.file).read_bytes())
    with pytest.raises(DamagedFileError, match=f"is a copy of {one.file}; delete it"):
        read_added_sets(store)
    path.unlink()
    assert read_added_sets(store) == [one]


def test_the_receipt_is_of_the_averages(added):
    folder, one, receipt = added
    store = Store.at(folder)
    assert read_receipt(store, one.kind, 0) == receipt
    assert receipt.source == read_receipt(store, "rows", 0).file("signals").sha256
    assert receipt.plan == one.hash
    assert b'"source"' not in (folder / "receipts" / "rows-00000.json").read_bytes()
