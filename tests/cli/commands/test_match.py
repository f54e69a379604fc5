"""``sigdb match``: what the table leaves out of the rows of recordings."""

import csv
import io

import numpy as np
import pytest

from sigdb.ingest import IngestSettings, ingest


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A database of two averages."""
    folder = tmp_path_factory.mktemp("measured")
    angle = 2 * np.pi * np.arange(384) / 384
    np.savez(folder / "a.npz", tsa=[np.cos(12 * angle), np.cos(12 * angle) + 0.1 * np.cos(5 * angle)])
    settings = IngestSettings(averages_of="tsa", teeth="12", samples_per_tooth=32)
    ingest(folder, folder / "db", settings=settings, jobs=1)
    return folder / "db"


def test_a_table_leaves_out_the_notes_that_csv_has(invoke, measured):
    table = invoke("match", measured, "--id", "0").stdout
    assert "residual_distance" in table
    assert "notes" not in table
    assert "sha256" not in table
    rows = list(csv.DictReader(io.StringIO(invoke("match", measured, "--id", "0", "--format", "csv").stdout)))
    assert len(rows) == 2
    assert {"notes", "sha256"} <= set(rows[0])
