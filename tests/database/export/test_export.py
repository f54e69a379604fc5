"""Unit: exports hold what the database holds, read by SciPy and h5py."""

import sys

import h5py
import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.io import loadmat

import sigdb
from sigdb.core.errors import DatabaseError, InputError

SECOND = "pinion-housing-vertical"
LISTS = ("tsa", "spectrum", "wigner_ville")


class Mat:
    """A MAT-file."""

    def __init__(self, path):
        self.file = loadmat(path)

    def column(self, name):
        values = self.file["cases"][0, 0][name]
        if values.dtype == object:
            return [str(one[0]) if one.size else "" for one in values[:, 0]]
        assert values.dtype == np.float64
        assert values.shape[1] == 1  # a column vector
        return values[:, 0]

    def names(self):
        return set(self.file["cases"].dtype.names) | {name for name in self.file if name.split("__")[0] in LISTS}

    def matrix(self, name):
        return self.file[name]

    def unit(self, name):
        return str(self.file["units"][0, 0][name][0])

    def about(self, name):
        return "".join(self.file["about"][0, 0][name])


class Hdf5:
    """An HDF5 file."""

    def __init__(self, path):
        self.file = h5py.File(path)

    def column(self, name):
        values = self.file["cases"][name]
        if h5py.check_string_dtype(values.dtype):
            return values.asstr()[:].tolist()
        assert values.dtype == np.float64
        return values[:]

    def names(self):
        return set(self.file["cases"]) | {name for name in self.file if name != "cases"}

    def matrix(self, name):
        return self.file[name][:]

    def unit(self, name):
        return (self.file[name] if name in self.file else self.file["cases"][name]).attrs["unit"]

    def about(self, name):
        return self.file.attrs[name]


READERS = {"mat": Mat, "h5": Hdf5}
both = pytest.mark.parametrize("kind", READERS)


def padded(lists, width):
    rows = np.full((len(lists), width), np.nan, np.float32)
    for row, values in zip(rows, lists, strict=True):
        if values is not None:
            row[: len(values)] = values
    return rows


@pytest.fixture(scope="module", params=READERS)
def whole(request, database, tmp_path_factory):
    """The whole of a database with two sensors, two tooth counts and failed rows, in batches of unequal width."""
    path = tmp_path_factory.mktemp("export") / f"all.{request.param}"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sigdb.database.export.export._BATCH", 60)
        done = database.export(path)
    assert (done.path, done.rows) == (path, len(database))
    return READERS[request.param](path), done


def test_columns_are_those_of_the_database(whole, database):
    file, done = whole
    features = database.features()
    assert file.names() == {
        name.replace("-", "_") for name in [*features, *(f"{one}{s}" for one in LISTS[:2] for s in ("", f"__{SECOND}"))]
    }
    assert done.columns == len(file.names())
    for name in database.cases():
        found, expected = file.column(name.replace("-", "_")), features[name]
        if isinstance(found, list):
            assert found == expected.tolist(), name
        else:
            assert_array_equal(found, expected.astype(float), name)


@pytest.mark.parametrize("sensor", ["pinion-vertical", SECOND])
def test_signals_are_padded_where_tooth_counts_differ(whole, database, sensor):
    file, _ = whole
    suffix = "" if sensor == "pinion-vertical" else f"__{SECOND}"
    rows = database.sql(f'select "tsa{suffix}" as tsa, "spectrum{suffix}" as spectrum from signals order by id')
    rows["wigner_ville"] = database.features()[f"wigner_ville{suffix}"]
    for name, width in (("tsa", 384), ("spectrum", 193), ("wigner_ville", 12 * 17)):
        found = file.matrix(f"{name}{suffix}".replace("-", "_"))
        assert found.dtype == np.float32
        assert_array_equal(found, padded(rows[name], width))
    # 3 failed rows, and 20 % of the others are shorter.
    assert np.isnan(file.matrix("tsa")).all(axis=1).sum() == 3


def test_units_and_origin(whole, database):
    file, _ = whole
    assert file.unit("tsa") == "m/s"
    assert file.unit("tsa__pinion_housing_vertical") == "m/s^2"
    assert file.unit("speed_rpm") == "rpm"
    assert file.about("hash") == database.manifest.hash
    assert file.about("licence") == "CC0-1.0"


def test_descriptions(whole, database):
    file, _ = whole
    field = database.dataset("features").schema.field("fm4").metadata
    if isinstance(file, Mat):
        found = {key: str(file.file[f"{key}s"][0, 0]["fm4"][0]) for key in ("description", "formula")}
    else:
        found = {key: file.file["cases/fm4"].attrs[key] for key in ("description", "formula")}
        assert file.file["cases"]["rms__pinion_housing_vertical"].attrs["column"] == f"rms__{SECOND}"
    assert found == {key: field[key.encode()].decode() for key in found}


@both
def test_a_condition(database, tmp_path, kind):
    where = "tooth = 6 and stiffness_loss > 0.3 and teeth = 12"
    done = database.export(tmp_path / f"some.{kind}", where=where)
    file, cases = READERS[kind](done.path), database.cases(where)
    assert done.rows == len(cases) == 4
    assert_array_equal(file.column("id"), cases["id"])
    assert_array_equal(file.matrix("tsa"), database.signals(cases["id"])["tsa"])
    assert file.about("where") == where


@both
def test_without_signals(database, tmp_path, kind):
    file = READERS[kind](database.export(tmp_path / f"some.{kind}", signals=False).path)
    assert file.names() == {name.replace("-", "_") for name in database.features()}


@both
@pytest.mark.parametrize("sensor", ["pinion-vertical", SECOND])
def test_one_sensor(database, tmp_path, kind, sensor):
    done = database.export(tmp_path / f"some.{kind}", where="teeth = 12 and tooth > 0", sensor=sensor)
    file, cases = READERS[kind](done.path), database.cases("teeth = 12 and tooth > 0")
    assert not [name for name in file.names() if "__" in name]
    assert {"rms", "tooth", "tsa", "spectrum", "wigner_ville"} < file.names()
    suffix = "" if sensor == "pinion-vertical" else f"__{SECOND}"
    assert_array_equal(file.column("rms"), cases[f"rms{suffix}"])
    assert_array_equal(file.matrix("spectrum"), database.signals(cases["id"], sensor=sensor)["spectrum"])
    assert file.unit("tsa") == database.unit("tsa", sensor)


@both
def test_no_rows(database, tmp_path, kind):
    done = database.export(tmp_path / f"none.{kind}", where="tooth = 99")
    assert done.rows == 0
    assert READERS[kind](done.path).matrix("tsa").shape == (0, 0)


@both
def test_more_rows_than_a_batch(database, tmp_path, monkeypatch, kind):
    monkeypatch.setattr("sigdb.database.export.export._BATCH", 100)
    ids = database.cases("teeth = 12")["id"]
    file = READERS[kind](database.export(tmp_path / f"parts.{kind}", where="teeth = 12").path)
    assert len(ids) > 200
    assert_array_equal(file.column("id"), ids)
    assert_array_equal(file.matrix("tsa"), database.signals(ids)["tsa"])


def test_what_a_mat_file_cannot_hold(database, tmp_path, monkeypatch):
    monkeypatch.setattr("sigdb.database.export.mat.LIMIT", 548 * 384 * 4 - 1)
    with pytest.raises(InputError, match=r"^tsa would have .* GB, and a variable .*; write HDF5 instead, .* \.h5"):
        database.export(tmp_path / "big.mat")
    monkeypatch.setattr("sigdb.database.export.mat.LIMIT", 548 * 384 * 4)
    database.export(tmp_path / "big.mat")
    # Columns of numbers alone have 8 bytes a value; text comes on top.
    numbers = sum(dtype.kind in "ifb" for dtype in database.cases().dtypes)
    monkeypatch.setattr("sigdb.database.export.mat.LIMIT", 548 * numbers * 8)
    monkeypatch.setattr("sigdb.database.export.export._list_sizes", lambda *_: {})
    with pytest.raises(InputError, match=r"^cases would have .* GB"):
        database.export(tmp_path / "other.mat", signals=False)
    assert [path.name for path in tmp_path.iterdir()] == ["big.mat"]


@pytest.mark.parametrize(
    ("name", "options", "says"),
    [
        ("a.csv", {}, r"a\.csv: the name of an export ends in \.mat, \.h5 or \.hdf5"),
        ("a", {}, r"the name of an export ends in"),
        ("a.h5", {"where": "true) --"}, r"where = 'true\) --'"),
        ("a.mat", {"where": "tuth = 1"}, r"where = 'tuth = 1'"),
        ("a.mat", {"sensor": "gear"}, r"sensor 'gear' is not stored in"),
    ],
)
def test_what_cannot_be_exported(database, tmp_path, name, options, says):
    with pytest.raises(InputError, match=says):
        database.export(tmp_path / name, **options)
    assert list(tmp_path.iterdir()) == []


def test_h5py_is_named_where_it_is_missing(database, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(InputError, match=r"HDF5 needs h5py, which is not installed: pip install h5py"):
        database.export(tmp_path / "a.h5")
    assert list(tmp_path.iterdir()) == []


@both
def test_damage_leaves_the_old_file(parts_copy, tmp_path, kind):
    path = parts_copy / "signals" / "part-00002.parquet"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)
    out = tmp_path / f"old.{kind}"
    out.write_text("old")
    with pytest.raises(DatabaseError, match=r"signals.part-00002\.parquet is damaged"):
        sigdb.open(parts_copy).export(out)
    assert out.read_text() == "old"
    assert sorted(one.name for one in tmp_path.iterdir()) == [out.name, "parts"]
