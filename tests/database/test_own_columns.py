"""Unit: a database keeps the columns that it was made with, whatever another version of sigdb would store."""

import shutil
import sys
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import pytest

import sigdb
from sigdb.core import DatabaseError, InputError
from sigdb.database import check_complete, database_card
from sigdb.signature import FEATURES, INDICATORS

OLD = Path(__file__).parents[1] / "compatibility" / "version_0_1" / "signatures"


@pytest.fixture
def replaced(monkeypatch):
    """Give sigdb other indicators, wherever a module has taken them."""

    def replace_tables(change):
        for table in (INDICATORS, FEATURES):
            new = MappingProxyType(change(dict(table)))
            modules = [module for name, module in list(sys.modules.items()) if name.split(".")[0] == "sigdb"]
            for module in modules:
                for name in [name for name, value in vars(module).items() if value is table]:
                    monkeypatch.setattr(module, name, new)

    return replace_tables


def one_more(table):
    """The indicator ``na9`` behind ``fm4``."""
    more = {"na9": replace(table["fm4"], name="na9")}
    at = list(table).index("fm4") + 1
    return dict(list(table.items())[:at]) | more | dict(list(table.items())[at:])


def one_fewer(table):
    return {name: value for name, value in table.items() if name != "fm4"}


@pytest.fixture(params=["small", "old"])
def older(request, copy, tmp_path):
    """A database that is made by this version, and one of version 0.1.0."""
    return copy if request.param == "small" else shutil.copytree(OLD, tmp_path / "old")


@pytest.mark.parametrize("change", [one_more, one_fewer])
def test_everything_works_on_the_columns_that_are_there(older, replaced, change, tmp_path):
    before = sigdb.open(older)
    card, cases = database_card(before), before.cases()
    replaced(change)
    database = sigdb.open(older)
    assert database_card(database) == card
    assert "fm4" in {indicator["name"] for indicator in database_card(database)["indicators"]}
    assert database.cases().equals(cases)
    assert set(database.features()) == set(before.features())
    assert len(database.sql("select fm4, na4 from cases" if "na4" in cases else "select fm4 from cases")) == len(cases)
    assert sum(batch.num_rows for batch in database.batches(columns=["id", "fm4", "wigner_ville"])) == len(cases)
    done = cases.loc[cases["status"] == "ok", "id"].to_numpy()
    tsa = database.signals(done[:1])["tsa"][0]
    assert database.match(tsa, k=2).table.equals(before.match(tsa, k=2).table)
    for suffix in ("mat", "h5"):
        assert database.export(tmp_path / f"all.{suffix}").columns == before.export(tmp_path / f"old.{suffix}").columns


def test_a_column_that_is_lacking_is_named_with_the_database_and_a_remedy(older, replaced):
    replaced(one_more)
    database = sigdb.open(older)
    says = rf"{older.name} lacks the column na9, which sigdb \S+ did not store; make the database again with sigdb"
    for ask in (
        lambda: database.sql("select avg(na9) from cases"),
        lambda: database.cases("na9 > 3"),
        lambda: database.features("tooth > 0 and na9 > 3"),
        lambda: database.batches(columns=["id", "na9"]),
        lambda: database.export(older / "x.mat", where="na9 > 1"),
    ):
        with pytest.raises(InputError, match=says):
            ask()
    with pytest.raises(DatabaseError, match=says):
        check_complete(database, ["fm4", "na9"])
    with pytest.raises(InputError, match=r"Referenced column \"fm5\" not found"):
        database.cases("fm5 > 3")
    with pytest.raises(InputError, match=r"columns: features has no column 'fm5'"):
        database.batches(columns=["fm5"])
