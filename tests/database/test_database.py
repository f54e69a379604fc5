"""Unit: reading cases, features, signals and templates, of a whole and of an unfinished database."""

import shutil
import tomllib

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

import sigdb
from sigdb.core.errors import DatabaseError, InputError
from sigdb.database import check_complete
from sigdb.database.store.seal import sealed_toml

SECOND = "pinion-housing-vertical"


@pytest.fixture(scope="module")
def stored(folder):
    """All signals, read by pyarrow alone."""
    return pq.read_table(folder / "signals" / "part-00000.parquet").to_pydict()


def test_what_it_is(database, folder):
    # 30 healthy rows of 4 specimens at three rig points; 4 specimens at 12 + 11 teeth with two losses; 4 at one tooth.
    rows = 3 * 4 * 30 + 4 * 2 * (12 + 11) + 4
    assert len(database) == rows == database.manifest.rows
    assert repr(database) == f"Database('{folder}', {rows} of {rows} rows)"
    assert database.sensors == ("pinion-vertical", SECOND)
    assert len(sigdb.open(str(folder))) == rows


def test_cases_are_rows_without_lists(database, folder):
    table = pq.read_table(folder / "features" / "part-00000.parquet")
    scalars = [name for name in table.schema.names if not name.startswith("wigner_ville")]
    pd.testing.assert_frame_equal(database.cases(), table.select(scalars).to_pandas(), check_dtype=False)
    features = database.features()
    assert list(features) == table.schema.names
    expected = table["wigner_ville"].to_pylist()
    for cells, other in zip(features["wigner_ville"], expected, strict=True):
        assert cells is None if other is None else np.array_equal(cells, np.float32(other))


def test_where(database):
    cases = database.cases()
    some = database.cases("tooth = 6 and stiffness_loss >= 0.25")
    expected = cases[(cases["tooth"] == 6) & (cases["stiffness_loss"] >= 0.25)].reset_index(drop=True)
    assert len(expected) == 4 * 2
    pd.testing.assert_frame_equal(some, expected)
    pd.testing.assert_frame_equal(database.features("tooth = 6 and stiffness_loss >= 0.25")[list(cases)], expected)
    assert len(database.cases("tooth = 99")) == 0
    assert len(database.cases("id < 3 -- a comment")) == 3


def test_signals_are_in_the_order_asked_for(database, stored):
    ids = [300, 5, 299, 5, 0, 255, 256, 257]
    signals = database.signals(ids)
    assert signals["tsa"].dtype == signals["spectrum"].dtype == np.float32
    assert signals["tsa"].shape == (8, 384)
    assert signals["spectrum"].shape == (8, 193)
    for i, tsa, spectrum in zip(ids, signals["tsa"], signals["spectrum"], strict=True):
        assert np.array_equal(tsa, np.float32(stored["tsa"][i]))
        assert np.array_equal(spectrum, np.float32(stored["spectrum"][i]))


@pytest.mark.parametrize("ids", [7, [7], np.array([7]), pd.Series([7]), np.int32(7), (7,)])
def test_ids_come_in_any_shape(database, stored, ids):
    assert np.array_equal(database.signals(ids)["tsa"], np.float32([stored["tsa"][7]]))


def test_signals_of_the_other_sensor(database, stored):
    for sensor, suffix in (("pinion-vertical", ""), (SECOND, f"__{SECOND}")):
        signals = database.signals([3, 1], sensor=sensor)
        for key in ("tsa", "spectrum"):
            assert np.array_equal(signals[key], np.float32([stored[key + suffix][i] for i in (3, 1)]))
    assert database.unit("tsa") == "m/s"
    assert database.unit("spectrum", SECOND) == "m/s^2"
    for call in (lambda: database.signals([0], sensor="gear"), lambda: database.unit("tsa", "gear")):
        with pytest.raises(InputError, match=r"sensor 'gear' is not stored in .*; stored: pinion-vertical, pinion-ho"):
            call()


def test_signals_of_one_tooth_count_at_a_time(database):
    twelve, eleven = (database.cases(f"teeth = {teeth} and status = 'ok'")["id"].tolist() for teeth in (12, 11))
    assert database.signals(eleven)["tsa"].shape == (len(eleven), 11 * 32)
    with pytest.raises(InputError, match=r"different lengths \[352, 384\]; select rows of one tooth count"):
        database.signals([twelve[0], eleven[0]])


@pytest.mark.parametrize("wrong", [-1, 548, 10**6, 10**12, [0, 548], [0, -3]])
def test_an_id_that_is_not_there(database, wrong):
    assert len(database) == 548
    wanted = max(np.atleast_1d(wrong).tolist(), key=lambda i: i < 0 or i >= 548)
    with pytest.raises(InputError, match=rf"id {wanted} is not in .*, which has 548 finished rows"):
        database.signals(wrong)


@pytest.mark.parametrize("wrong", [1.5, [0, 0.25], float("nan")])
def test_an_id_is_a_whole_number(database, wrong):
    """Nothing is rounded: the row 1 is not an answer to 1.5."""
    with pytest.raises(InputError, match=r"id"):
        database.signals(wrong)


def test_no_ids(database):
    signals = database.signals([])
    assert len(signals["tsa"]) == len(signals["spectrum"]) == 0


def test_rows_without_a_result_are_nan(database):
    failed = database.cases("status <> 'ok'")["id"].tolist()
    assert len(failed) == 3
    signals = database.signals([*failed, 0])
    assert np.isnan(signals["tsa"][:3]).all()
    assert np.isfinite(signals["tsa"][3]).all()


def test_rows_without_a_result_alone_keep_the_shape(database):
    """(k, n) as documented, whoever else is asked for."""
    failed = database.cases("status <> 'ok'")["id"].tolist()
    signals = database.signals(failed)
    assert signals["tsa"].shape == (3, 384)
    assert signals["spectrum"].shape == (3, 193)
    assert np.isnan(signals["tsa"]).all()


def test_templates(database):
    templates = database.templates()
    assert templates["template"].tolist() == list(range(3 + 5))
    good = templates[templates["status"] == "ok"]
    for row in good.itertuples():
        n = row.teeth * 32
        assert len(row.tsa) == len(row.compression) == len(row.mesh_force) == n
        assert len(row.specimen_response) == n * row.teeth
    pd.testing.assert_frame_equal(
        database.sql("select template, min_compression from templates order by template"),
        templates[["template", "min_compression"]],
        check_dtype=False,
    )


def test_an_unfinished_database_is_readable(parts_copy):
    """What was finished when it was opened is what is seen."""
    before = sigdb.open(parts_copy)
    (parts_copy / "receipts" / "rows-00001.json").unlink()
    database = sigdb.open(parts_copy)
    assert len(before) == 5060
    assert len(database) == 5060 - 2048
    assert repr(database).endswith(f"{5060 - 2048} of 5060 rows)")
    assert database.sql("select count(*) as n, min(id) as a, max(id) as b from features").values.tolist() == [
        [5060 - 2048, 0, 5059]
    ]
    assert database.sql("select count(*) as n from signals where id between 2048 and 4095")["n"].tolist() == [0]
    assert database.signals([2047, 4096])["tsa"].shape == (2, 352)
    with pytest.raises(InputError, match=r"id 2048 is not in .*, which has 3012 finished rows"):
        database.signals([0, 2048])
    with pytest.raises(DatabaseError, match=r"has 3012 of 5060 rows; finish the sweep first"):
        check_complete(database)
    check_complete(before)
    with pytest.raises(DatabaseError, match=r"lacks the column fm5; give a database that has it"):
        check_complete(before, ["fm4", "fm5"])


def test_parts_are_joined(parts_folder):
    database = sigdb.open(parts_folder)
    assert database.cases()["id"].tolist() == list(range(5060))
    ids = [5059, 0, 2047, 2048, 4095, 4096]
    expected = {}
    for part in range(3):
        table = pq.read_table(parts_folder / "signals" / f"part-{part:05d}.parquet", columns=["id", "tsa"])
        expected |= dict(zip(table["id"].to_pylist(), table["tsa"].to_pylist(), strict=True))
    assert np.array_equal(database.signals(ids)["tsa"], np.float32([expected[i] for i in ids]))


def test_a_file_without_receipt_is_not_seen(parts_copy):
    """As a killed sweep leaves it: a part without receipt, half a part, a temporary file."""
    (parts_copy / "receipts" / "rows-00002.json").unlink()
    path = parts_copy / "features" / "part-00002.parquet"
    path.write_bytes(path.read_bytes()[:1000])
    shutil.copy(path, parts_copy / "signals" / ".part-00003.parquet.tmp")
    database = sigdb.open(parts_copy)
    assert len(database.cases()) == 4096
    assert len(database.sql("select id from signals")) == 4096


def test_a_database_without_rows_yet(copy):
    for receipt in (copy / "receipts").glob("rows-*.json"):
        receipt.unlink()
    database = sigdb.open(copy)
    assert len(database) == 0
    assert len(database.templates()) == 8
    with pytest.raises(DatabaseError, match=r"no features are finished yet; run the sweep that makes this database"):
        database.cases()
    with pytest.raises(InputError, match=r"id 0 is not in .*, which has 0 finished rows"):
        database.signals([0])


def test_what_is_no_database(tmp_path):
    for path in (tmp_path / "none", tmp_path):
        with pytest.raises(
            InputError, match=r"is not a sigdb database \(it has no sigdb.toml\); make one with: python"
        ):
            sigdb.open(path)


def resealed(content):
    """A description whose seal is right, whatever it says."""
    return sealed_toml({key: value for key, value in content.items() if key != "sha256"})


def test_a_description_that_cannot_be_read(copy):
    manifest = copy / "sigdb.toml"
    text = manifest.read_bytes()
    content = tomllib.loads(text.decode())
    for broken, says in (
        (b"", r"is damaged or was edited"),
        (b"[", r"is damaged or was edited"),
        (text.replace(b"seed = 9\n", b"seed = 8\n", 1), r"is damaged or was edited"),
        (
            b'hash = "0123"\nformat = 1\n',
            r"format 1 is not the format 2 that this sigdb reads; make the database again",
        ),
        (resealed(content | {"format": 3}), r"format 3 is not the format 2 that this sigdb reads"),
        (resealed(content | {"sead": 9}), r"not a readable database description .*sead"),
        (resealed(content | {"plan": {}}), r"not a readable database description .*hash"),
    ):
        manifest.write_bytes(broken)
        with pytest.raises(DatabaseError, match=r"sigdb\.toml:? " + says):
            sigdb.open(copy)
