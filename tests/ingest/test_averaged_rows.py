"""Unit: averages of another program become rows with features and labels, from any of the formats."""

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import savemat

import sigdb
from sigdb.ingest import IngestSettings, ingest, verify
from sigdb.signature import features

TEETH, N = 12, 12 * 32
TSA = np.random.default_rng(3).normal(size=(3, N)) + np.cos(2 * np.pi * TEETH * np.arange(N) / N)
FACTS = {
    "tooth": np.array([0, 4, 5]),
    "torque": np.array([10.0, 10.0, 20.5]),
    "stiffness_loss": np.array([0.0, 0.2, 0.4]),
}
KINDS = ["none", "crack", "pitting"]


def npz(path):
    np.savez(path, tsa=TSA, kind=np.array(KINDS), other=np.zeros(7), **FACTS)


def mat(path):
    savemat(path, {"tsa": TSA, "kind": np.array(KINDS, dtype=object), **FACTS})


def hdf5(path):
    with h5py.File(path, "w") as file:
        for name, values in {"tsa": TSA, **FACTS}.items():
            file[name] = values
        file["kind"] = KINDS


def parquet(path):
    pq.write_table(pa.table({"tsa": list(TSA), "kind": KINDS, **FACTS}), path)


@pytest.mark.parametrize(
    ("write", "suffix"),
    [(npz, "npz"), (mat, "mat"), (hdf5, "h5"), (parquet, "parquet")],
    ids=lambda each: str(each)[:9],
)
def test_averages_of_each_format_are_rows_with_labels_and_features(tmp_path, write, suffix):
    write(tmp_path / f"model.{suffix}")
    settings = IngestSettings(averages_of="tsa", teeth="12", samples_per_tooth=32, reading={"units": "g"})
    ingest(tmp_path, tmp_path / "db", settings=settings, jobs=1)
    database = sigdb.open(tmp_path / "db")
    rows = database.cases()
    assert rows["status"].tolist() == ["ok"] * 3
    assert set(rows["source"]) == {"simulated elsewhere"}
    assert rows["tooth"].tolist() == [0, 4, 5]
    assert rows["kind"].tolist() == KINDS
    assert rows["torque"].tolist() == [10.0, 10.0, 20.5]
    assert rows["stiffness_loss"].tolist() == [0.0, 0.2, 0.4]
    np.testing.assert_allclose(database.signals(rows["id"])["tsa"], 9.80665 * TSA, rtol=1e-6)
    np.testing.assert_allclose(rows["fm4"], features(TSA, teeth=12)["fm4"], rtol=1e-5)
    assert verify(tmp_path / "db", deep=True) == ()


def test_averages_of_another_length_are_resampled_as_periods(tmp_path):
    """A sum of orders below both Nyquist orders is the same function of the angle."""
    angle = 2 * np.pi * np.arange(1000) / 1000
    np.savez(tmp_path / "model.npz", tsa=np.cos(12 * angle) + 0.3 * np.sin(25 * angle), teeth=12, tooth=3)
    ingest(tmp_path, tmp_path / "db", settings=IngestSettings(averages_of="tsa"), jobs=1)
    angle = 2 * np.pi * np.arange(768) / 768
    expected = np.cos(12 * angle) + 0.3 * np.sin(25 * angle)
    np.testing.assert_allclose(sigdb.open(tmp_path / "db").signals([0])["tsa"][0], expected, atol=1e-5)


@pytest.mark.parametrize(
    ("arrays", "reason"),
    [
        ({"x": TSA}, "has no array 'tsa'; it has x"),
        ({"tsa": TSA, "tooth": [1, 2]}, "tooth has 2 values, and there are 3 averages"),
        ({"tsa": TSA * np.nan}, "no finite number"),
        ({"tsa": np.array(["a"])}, "give averages"),
        ({"tsa": TSA, "tooth": [1, 2, -3]}, "average 3: tooth"),
    ],
)
def test_what_cannot_be_read_is_a_row_with_the_reason(tmp_path, arrays, reason):
    np.savez(tmp_path / "model.npz", **arrays)
    settings = IngestSettings(averages_of="tsa", teeth="12", samples_per_tooth=32)
    ingest(tmp_path, tmp_path / "db", settings=settings, jobs=1)
    (row,) = sigdb.open(tmp_path / "db").cases().to_dict("records")
    assert row["status_code"] == "unreadable"
    assert reason in row["status"]
