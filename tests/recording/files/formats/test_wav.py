"""Verification: WAV files, written chunk by chunk, whole and as recorders leave them when they stop too soon."""

import struct

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recording.files.formats.wav import read_wav
from sigdb.recording.files.settings import RecordingSettings

X = np.array([0.5, -0.25, 0.0, -1.0, 0.125, 0.75])
PCM, FLOAT, EXTENSIBLE = 1, 3, 0xFFFE
GUID = bytes.fromhex("000000001000800000aa00389b71")


def chunk(kind, body, *, order="<", size=None, pad=True):
    return kind + struct.pack(f"{order}I", len(body) if size is None else size) + body + b"\0" * (pad and len(body) % 2)


def fmt(kind, bits, *, channels=1, rate=8000, order="<", align=None, sub=None, valid=None):
    width = align if align is not None else channels * ((bits + 7) // 8)
    body = struct.pack(f"{order}HHIIHH", kind, channels, rate, rate * width, width, bits)
    if sub is not None:
        body += struct.pack(f"{order}HHIH", 22, valid or bits, 0, sub) + GUID
    return chunk(b"fmt ", body, order=order)


def raw(x, kind, bits, order="<"):
    """Samples as stored: fractions of full scale as integers, or floats."""
    if kind == FLOAT:
        return x.astype(f"{order}f{bits // 8}").tobytes()
    whole = (x * 2 ** (bits - 1)).astype(np.int64) + (128 if bits == 8 else 0)
    return b"".join(int(one).to_bytes(bits // 8, "little" if order == "<" else "big", signed=bits > 8) for one in whole)


def write(path, *chunks, mark=b"RIFF", size=None, order="<", after=b""):
    body = b"WAVE" + b"".join(chunks)
    path.write_bytes(mark + struct.pack(f"{order}I", len(body) if size is None else size) + body + after)
    return path


def read(path, **options):
    return read_wav(path, RecordingSettings(**options))


def codes(contents):
    return {note.code for note in contents.notes}


@pytest.mark.parametrize("extensible", [False, True])
@pytest.mark.parametrize("mark", [b"RIFF", b"RIFX"])
@pytest.mark.parametrize(
    ("kind", "bits"), [(PCM, 8), (PCM, 16), (PCM, 24), (PCM, 32), (FLOAT, 32), (FLOAT, 64), (FLOAT, 16)]
)
def test_samples_of_every_kind(tmp_path, kind, bits, mark, extensible):
    order = ">" if mark == b"RIFX" else "<"
    about = {"sub": kind} if extensible else {}
    head = fmt(EXTENSIBLE if extensible else kind, bits, order=order, channels=2, **about)
    both = np.stack([X, X[::-1]], 1).reshape(-1)
    path = write(
        tmp_path / "run.wav", head, chunk(b"data", raw(both, kind, bits, order), order=order), mark=mark, order=order
    )
    contents = read(path)
    assert contents.sampling_rate == 8000
    assert_array_equal(contents.columns[0].values, X)
    assert_array_equal(contents.columns[1].values, X[::-1])
    assert codes(contents) == {"no-unit"} | ({"full-scale"} if kind == PCM else set())
    assert "no-unit" not in codes(read(path, units="g"))


def test_twenty_bits_stand_in_the_upper_part_of_24(tmp_path):
    head = fmt(EXTENSIBLE, 24, sub=PCM, valid=20)
    contents = read(write(tmp_path / "run.wav", head, chunk(b"data", raw(X, PCM, 24))))
    assert_array_equal(contents.columns[0].values, X)


@pytest.mark.parametrize("pad", [True, False])
def test_other_chunks_are_passed_over(tmp_path, pad):
    """Broadcast and sampler facts, texts of odd length with and without a pad byte, before and after the samples."""
    before = [chunk(b"bext", bytes(603), pad=pad), chunk(b"LIST", b"INFOIART\5\0\0\0abcd\0", pad=pad)]
    head = fmt(FLOAT, 64)
    after = [chunk(b"smpl", bytes(36)), chunk(b"LIST", b"adtl!", pad=pad)]
    contents = read(write(tmp_path / "run.wav", *before, head, chunk(b"data", raw(X, FLOAT, 64)), *after))
    assert_array_equal(contents.columns[0].values, X)
    assert codes(contents) == {"no-unit"}


@pytest.mark.parametrize("mark", [b"RF64", b"BW64"])
def test_sizes_of_large_files(tmp_path, mark):
    samples = raw(X, FLOAT, 64)
    sizes = chunk(b"ds64", struct.pack("<QQQI", 999, len(samples), X.size, 0))
    data = chunk(b"data", samples, size=0xFFFFFFFF)
    path = write(
        tmp_path / "run.wav", sizes, fmt(FLOAT, 64), data, chunk(b"LIST", b"x" * 8), mark=mark, size=0xFFFFFFFF
    )
    contents = read(path)
    assert_array_equal(contents.columns[0].values, X)
    assert codes(contents) == {"no-unit"}


@pytest.mark.parametrize(
    ("stated", "whole", "code", "count"),
    [
        (0, 0, "size-not-stated", 6),
        (0, 36, "size-not-stated", 6),
        (0xFFFFFFFF, 0xFFFFFFFF, "size-not-stated", 6),
        (480, None, "cut-short", 6),
        (0x7FFFFFFF, 0, "cut-short", 6),
        (16, 52, "bytes-left-out", 2),
    ],
)
def test_sizes_of_a_recorder_that_stopped(tmp_path, stated, whole, code, count):
    samples = np.concatenate([X[:2], np.full(4, -np.pi)])
    data = chunk(b"data", raw(samples, FLOAT, 64), size=stated)
    contents = read(write(tmp_path / "run.wav", fmt(FLOAT, 64), data, size=whole))
    assert_array_equal(contents.columns[0].values, samples[:count])
    assert code in codes(contents)


@pytest.mark.parametrize(
    ("chunks", "message"),
    [
        ([fmt(PCM, 16), chunk(b"data", b""), chunk(b"LIST", b"INFO")], "holds no samples"),
        ([fmt(PCM, 16), chunk(b"LIST", b"INFO")], "holds no samples: it has no chunk 'data'"),
        ([chunk(b"data", bytes(8)), fmt(PCM, 16)], "its samples come before their format"),
        ([fmt(2, 4, align=256), chunk(b"data", bytes(256))], "holds samples ADPCM, which are not read; save it as PCM"),
        ([fmt(7, 8), chunk(b"data", bytes(8))], "holds samples mu-law"),
        ([fmt(0x1234, 8), chunk(b"data", bytes(8))], "holds samples of kind 0x1234"),
        ([fmt(PCM, 16, channels=0), chunk(b"data", bytes(8))], "it states 0 channels"),
        ([fmt(PCM, 16, rate=0), chunk(b"data", bytes(8))], "a sampling rate of 0 Hz"),
        ([fmt(PCM, 16, align=4), chunk(b"data", bytes(8))], "it states 1 channels of 16 bits in 4 bytes"),
        ([fmt(FLOAT, 24), chunk(b"data", bytes(8))], "it states 1 channels of 24 bits"),
        ([chunk(b"fmt ", bytes(8)), chunk(b"data", bytes(8))], "is cut short: its format is not whole"),
    ],
)
def test_files_that_are_refused(tmp_path, chunks, message):
    with pytest.raises(InputError, match=message):
        read(write(tmp_path / "run.wav", *chunks))
