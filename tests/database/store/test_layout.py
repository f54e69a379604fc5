"""Unit: the files of a database are those of the documented layout, and say themselves what they hold."""

import base64
import hashlib
import json
import tomllib
import zlib

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import sigdb
from sigdb.signature import INDICATORS

TABLES = ("templates", "features", "signals")


def parquet(folder, table, part=0):
    return pq.ParquetFile(folder / table / f"part-{part:05d}.parquet")


def test_the_files(folder, parts_folder):
    for where, parts in ((folder, 1), (parts_folder, 3)):
        found = {str(path.relative_to(where)) for path in where.rglob("*") if path.is_file()}
        expected = {"sigdb.toml", "schema.json", "templates/part-00000.parquet", "receipts/templates-00000.json"}
        for part in range(parts):
            expected |= {f"{table}/part-{part:05d}.parquet" for table in ("features", "signals")}
            expected.add(f"receipts/rows-{part:05d}.json")
        assert found - {".lock"} == expected


def test_receipts_know_their_files(parts_folder):
    first = 0
    for part in range(3):
        path = parts_folder / "receipts" / f"rows-{part:05d}.json"
        receipt = json.loads(path.read_text(encoding="utf-8"))
        assert receipt.pop("sha256") == hashlib.sha256(path.read_bytes().split(b"\n", 1)[1]).hexdigest()
        assert receipt.pop("plan") == tomllib.loads((parts_folder / "sigdb.toml").read_text("utf-8"))["plan"]["hash"]
        assert set(receipt) == {"name", "part", "first", "rows", "failed", "files", "host", "seconds", "versions"}
        assert (receipt["name"], receipt["part"], receipt["first"]) == ("rows", part, first)
        assert [one["path"] for one in receipt["files"]] == [
            f"features/part-{part:05d}.parquet",
            f"signals/part-{part:05d}.parquet",
        ]
        for record in receipt["files"]:
            content = (parts_folder / record["path"]).read_bytes()
            assert record["bytes"] == len(content)
            assert record["sha256"] == hashlib.sha256(content).hexdigest()
            size = record.get("block", 256 * 1024)
            assert size == (8 * 1024 if record["path"].startswith("signals") else 256 * 1024)
            blocks = [content[i : i + size] for i in range(0, len(content), size)]
            sums = b"".join(zlib.crc32(block).to_bytes(4, "little") for block in blocks)
            assert base64.b64decode(record["blocks"]) == sums
            ids = pq.read_table(parts_folder / record["path"], columns=["id"])["id"].to_pylist()
            assert ids == list(range(first, first + receipt["rows"]))
        assert receipt["versions"]["pyarrow"] == pa.__version__
        first += receipt["rows"]
    assert first == 5060


def test_row_groups_are_small_for_signals_and_large_for_features(parts_folder):
    for part, rows in ((0, 2048), (1, 2048), (2, 5060 - 4096)):
        signals = parquet(parts_folder, "signals", part).metadata
        sizes = [signals.row_group(i).num_rows for i in range(signals.num_row_groups)]
        assert sizes[:-1] == [256] * (len(sizes) - 1)
        assert sum(sizes) == rows
        features = parquet(parts_folder, "features", part).metadata
        assert (features.num_row_groups, features.num_rows) == (1, rows)


def test_signals_are_stored_plainly_a_page_for_each_row_group(folder, parts_folder):
    """The numbers of a row lie where the receipt says; the first folder has lists of two lengths."""
    for where, is_even in ((folder, False), (parts_folder, True)):
        receipt = json.loads((where / "receipts" / "rows-00000.json").read_text(encoding="utf-8"))
        plain = receipt["files"][1]["plain"]
        file, content = parquet(where, "signals"), (where / "signals" / "part-00000.parquet").read_bytes()
        assert plain.keys() == set(file.schema_arrow.names) - {"id"}
        for group in range(file.metadata.num_row_groups):
            columns = [file.metadata.row_group(group).column(j) for j in range(file.metadata.num_columns)]
            assert {column.compression for column in columns} == {"UNCOMPRESSED"}
            rows = file.read_row_group(group)
            for name, runs in plain.items():
                lists, (first, length, missing) = rows[name].to_pylist(), runs[group]
                present = [row for row in lists if row is not None]
                assert (length > 0) == (len({len(row) for row in present}) == 1)
                if length:
                    assert [i for i in range(len(lists)) if int(missing or "0", 16) >> i & 1] == [
                        i for i, row in enumerate(lists) if row is None
                    ]
                    stored = np.frombuffer(content, "<f4", len(present) * length, first).reshape(len(present), -1)
                    assert np.array_equal(stored, np.array(present, np.float32))
        assert all(length > 0 for _, length, _ in plain["tsa"]) == is_even


@pytest.mark.parametrize("table", ["templates", "features"])
def test_floats_are_split_by_byte_and_all_is_zstd(folder, table):
    metadata = parquet(folder, table).metadata
    for i in range(metadata.num_row_groups):
        for j in range(metadata.num_columns):
            column = metadata.row_group(i).column(j)
            assert column.compression == "ZSTD"
            if column.physical_type in ("FLOAT", "DOUBLE"):
                assert "BYTE_STREAM_SPLIT" in column.encodings, column.path_in_schema
                assert not column.has_dictionary_page
    assert {metadata.schema.column(j).physical_type for j in range(metadata.num_columns)} & {"FLOAT"}


def test_signals_have_statistics_of_their_ids_only(folder):
    metadata = parquet(folder, "signals").metadata
    for i in range(metadata.num_row_groups):
        for j in range(metadata.num_columns):
            column = metadata.row_group(i).column(j)
            assert column.is_stats_set == (column.path_in_schema == "id")
        ids = metadata.row_group(i).column(0).statistics
        assert (ids.min, ids.max) == (256 * i, min(256 * (i + 1), metadata.num_rows) - 1)


@pytest.mark.parametrize("table", TABLES)
def test_every_page_has_a_checksum(folder, table, tmp_path):
    """A bit flipped in the data of each column is found when checksums are checked."""
    path = folder / table / "part-00000.parquet"
    content, metadata = path.read_bytes(), pq.ParquetFile(path).metadata
    for j in range(metadata.num_columns):
        column = metadata.row_group(0).column(j)
        damaged = bytearray(content)
        damaged[column.data_page_offset + column.total_compressed_size - 3 - _before(column)] ^= 1
        (tmp_path / "damaged.parquet").write_bytes(damaged)
        name = metadata.schema.column(j).path.split(".list.")[0]
        file = pq.ParquetFile(tmp_path / "damaged.parquet", page_checksum_verification=True)
        with pytest.raises(OSError, match="CRC checksum verification failed"):
            file.read_row_group(0, columns=[name])


def _before(column):
    """Bytes of the dictionary page, which lies before the data page."""
    return column.data_page_offset - column.dictionary_page_offset if column.has_dictionary_page else 0


@pytest.mark.parametrize("table", TABLES)
def test_schema_json_is_the_schema_of_the_files(folder, table):
    told = json.loads((folder / "schema.json").read_text(encoding="utf-8"))
    assert list(told) == ["sha256", *TABLES]
    schema = parquet(folder, table).schema_arrow
    assert [column["name"] for column in told[table]] == schema.names
    for column in told[table]:
        field = schema.field(column["name"])
        assert column["type"] == str(field.type)
        for key in ("unit", "description", "formula"):
            assert field.metadata[key.encode()].decode() == column[key]
        assert column["unit"]
        assert column["description"].endswith(".")


def test_all_parts_have_one_schema(parts_folder):
    for table in ("features", "signals"):
        first = parquet(parts_folder, table).schema_arrow
        for part in (1, 2):
            assert parquet(parts_folder, table, part).schema_arrow.equals(first, check_metadata=True)


def test_a_column_without_any_value_keeps_its_type(make):
    """All rows lose contact: the schema is that of a database in which none does."""
    strong = "tooth = 2\nstiffness_loss = 0.5\nphase_shift_deg = 4.5\noperating.torque = 100.0\npinion.teeth = 12\n"
    weak = strong.replace("100.0", "356.05").replace("4.5", "0.0")
    recipe = '[sweep]\nrig = "nasa-spiral-bevel"\n[[sweep.grid]]\n{}[signature]\nsamples_per_tooth = 32\n'
    lost, kept = make(recipe.format(strong)), make(recipe.format(weak))
    assert set(sigdb.open(lost).cases()["contact_loss"]) == {True}
    assert set(sigdb.open(kept).cases()["contact_loss"]) == {False}
    for table in TABLES:
        assert parquet(lost, table).schema_arrow.equals(parquet(kept, table).schema_arrow, check_metadata=True)


def test_columns(database):
    """The documented names; the first sensor's columns without suffix, the second's with its name."""
    schema = database.dataset("features").schema
    for name in ["id", "status", "template", "gear", "tooth", "damaged_teeth", "phase_shift_deg", "stiffness_loss"]:
        assert name in schema.names
    for name in ["loss_extent", "pattern", "teeth", "speed_rpm", "torque", "shaft", "specimen", "draw", "averages"]:
        assert name in schema.names
    for name in ["snr_db", "index_error", "contact_loss", "min_compression"]:
        assert name in schema.names
    for name in [*INDICATORS, "scatter", "wigner_ville"]:
        assert name in schema.names
        assert f"{name}__pinion-housing-vertical" in schema.names
    assert schema.field("id").type == pa.int64()
    assert schema.field("torque").metadata[b"unit"] == b"N m"
    assert schema.field("rms").metadata[b"unit"] == b"m/s"
    assert schema.field("rms__pinion-housing-vertical").metadata[b"unit"] == b"m/s^2"
    assert schema.field("wigner_ville").metadata[b"unit"] == b"(m/s)^2"
    templates = database.dataset("templates").schema
    assert templates.field("specimen_response").metadata[b"unit"] == b"(m/s)/m"
    signals = database.dataset("signals").schema
    assert signals.names == ["id", *(f"{a}{b}" for b in ("", "__pinion-housing-vertical") for a in ("tsa", "spectrum"))]
    assert signals.field("tsa").type == pa.list_(pa.float32())


def test_sigdb_toml_holds_what_makes_the_rows(folder, recipe_text):
    content = tomllib.loads((folder / "sigdb.toml").read_text(encoding="utf-8"))
    assert content["recipe"] == recipe_text
    assert content["plan"]["seed"] == 9
    assert content["format"] == 2
    assert len(content["plan"]["hash"]) == 64
    assert content["extensions"] == []
    assert content["sigdb_version"] == sigdb.__version__
    assert content["licence"]
    assert content["citation"]
    assert content["sensors"] == ["pinion-vertical", "pinion-housing-vertical"]
    # With every default filled in, and the rig with the sources of its numbers.
    assert content["plan"]["resolved"]["measurement"] == {"averages": 102, "snr_db": 0.0, "index_error": 2e-6}
    assert content["plan"]["resolved"]["sweep"]["draws"] == 1
    rig = content["plan"]["resolved"]["rig"]
    assert rig["gears"]["pinion"]["teeth"] == 12
    assert "published" in rig["gears"]["pinion"]["sources"]["teeth"]


def test_the_hash_is_that_of_the_recipe_in_it(folder, tmp_path):
    from sigdb.pipeline import load_recipe

    content = tomllib.loads((folder / "sigdb.toml").read_text(encoding="utf-8"))
    (tmp_path / "again.toml").write_text(content["recipe"], encoding="utf-8")
    plan = load_recipe(tmp_path / "again.toml").plan()
    assert plan.hash == content["plan"]["hash"]
    assert (plan.rows, plan.n_templates) == (content["plan"]["rows"], content["plan"]["templates"])
