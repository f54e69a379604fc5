"""Unit: archives of models are expanded within limits, whatever their directories and headers state."""

import io
import struct
import zipfile

import numpy as np
import pytest

from sigdb.core.errors import InputError
from sigdb.recognition.storage import bounded_files
from sigdb.recognition.storage.bounded_files import archive_members, folder_file


def npy(values, shape=None, dtype=None):
    """An array as NPY, with a header that may state another shape or type."""
    out = io.BytesIO()
    header = np.lib.format.header_data_from_array_1_0(values)
    header |= {} if shape is None else {"shape": shape}
    header |= {} if dtype is None else {"descr": dtype}
    np.lib.format.write_array_header_1_0(out, header)
    return out.getvalue() + values.tobytes()


def zipped(members, compression=zipfile.ZIP_DEFLATED):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", compression) as archive:
        for name, data in members:
            archive.writestr(name, data)
    return out.getvalue()


GOOD = [("a.npy", npy(np.arange(6.0))), ("schema.json", b"{}")]


def test_members_come_as_they_were_written():
    assert archive_members("m", zipped(GOOD)) == dict(GOOD)
    assert archive_members("m", zipped(GOOD, zipfile.ZIP_STORED)) == dict(GOOD)


@pytest.mark.parametrize(
    ("member", "says"),
    [
        (npy(np.zeros(4), shape=(2**41,)), r"states an array of shape \(2199023255552,\) and type float64"),
        (npy(np.zeros(4), shape=(2**33, 2**33)), "states an array of shape"),
        (npy(np.zeros(4), shape=(3,)), "states an array of shape"),
        (npy(np.zeros(4), shape=(-4,)), "states an array of shape"),
        (npy(np.zeros(4), dtype="|O"), r"states .* and type object"),
        (npy(np.zeros(4)) + b"more", r"states .* and holds 36 bytes"),
    ],
    ids=["16 TB", "2^66", "fewer", "negative", "objects", "more bytes"],
)
def test_an_array_has_the_bytes_that_it_states(member, says):
    with pytest.raises(InputError, match=rf"^a\.npy of m {says}"):
        archive_members("m", zipped([("a.npy", member)]))


def test_a_directory_that_states_less_than_there_is_does_not_expand_it():
    """Both headers of the member state ten bytes of a million."""
    content = bytearray(zipped([("schema.json", bytes(10**6))]))
    for place in (22, content.rindex(b"PK\x01\x02") + 24):
        assert struct.unpack_from("<I", content, place) == (10**6,)
        struct.pack_into("<I", content, place, 10)
    with pytest.raises((InputError, zipfile.BadZipFile)):
        archive_members("m", bytes(content))


def test_a_member_that_is_there_twice_is_refused():
    with pytest.warns(UserWarning, match="Duplicate name"):
        content = zipped([*GOOD, GOOD[1]])
    with pytest.raises(InputError, match=r"m holds schema\.json twice"):
        archive_members("m", content)


@pytest.mark.parametrize("compression", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_another_compression_is_refused(compression):
    with pytest.raises(InputError, match="in a compression that models do not have"):
        archive_members("m", zipped(GOOD, compression))


@pytest.mark.parametrize(
    ("name", "limit", "says"),
    [
        ("_MOST_MEMBERS", 1, "m has 2 members"),
        ("_MOST_MEMBERS", 0, "m has a directory of 108 bytes"),
        ("MOST_BYTES", 100, "m has 178 bytes, more than the 100"),
        ("MOST_TEXT", 1, r"schema\.json of m has 2 bytes"),
    ],
)
def test_more_than_models_have_is_refused(monkeypatch, name, limit, says):
    monkeypatch.setattr(bounded_files, name, limit)
    with pytest.raises(InputError, match=f"^{says}"):
        archive_members("m", zipped(GOOD))


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    with (tmp_path / "large").open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(InputError, match="large has 1099511627776 bytes, more than the 536870912"):
        folder_file(tmp_path, "large")
    (tmp_path / "small").write_bytes(b"abc")
    assert folder_file(tmp_path, "small", most=3) == b"abc"
