"""Verification: a stream of text yields what the whole file decodes to, in bounded parts."""

import bz2
import gzip
import io
import tracemalloc

import numpy as np
import pytest

from sigdb.core import InputError
from sigdb.recording.files.formats.text import encoding
from sigdb.recording.files.formats.text.encoding import TextStream

TEXT = "".join(f"{i};{i * i % 97};µ\N{GRINNING FACE}\n" for i in range(3000))
PLAIN = TEXT.encode()


def _expanded(stored):
    """Members of gzip with empty ones, and bytes after the last that are none."""
    return gzip.compress(b"") + gzip.compress(stored[:7001]) + gzip.compress(stored[7001:]) + b"\0" * 9


STORED = {
    "plain": (PLAIN, PLAIN),
    "other bytes": (bz2.compress(PLAIN), bz2.compress(PLAIN)),
    "gzip": (_expanded(PLAIN), PLAIN),
    "little": (b"\xff\xfe" + TEXT.encode("utf-16-le"), PLAIN),
    "big": (b"\xfe\xff" + TEXT.encode("utf-16-be"), PLAIN),
    "both": (_expanded(b"\xff\xfe" + TEXT.encode("utf-16-le")), PLAIN),
    "empty": (b"", b""),
    "a byte": (b"7", b"7"),
    "empty gzip": (gzip.compress(b""), b""),
}


@pytest.mark.parametrize("at_a_time", [1, 7, 1000, 2**20])
@pytest.mark.parametrize("kind", STORED)
def test_a_stream_yields_the_text(monkeypatch, kind, at_a_time):
    monkeypatch.setattr(encoding, "_READ", at_a_time)
    stored, text = STORED[kind]
    stream = TextStream(io.BytesIO(stored))
    parts = list(iter(lambda: stream.read(1234), b""))
    assert b"".join(parts) == text
    assert [len(part) for part in parts[:-1]] == [1234] * (len(parts) - 1)


def test_gzip_that_is_cut_short_or_expands_too_far_is_refused(monkeypatch):
    monkeypatch.setattr("sigdb.recording.files.formats.contents.FREE_BYTES", 2**20)
    with pytest.raises(InputError, match="ends in the middle of its gzip data"):
        TextStream(io.BytesIO(gzip.compress(PLAIN)[:-9])).read(10**6)
    bomb = TextStream(io.BytesIO(gzip.compress(b"1,2\n" * 2**20)))
    with pytest.raises(InputError, match="which measured numbers do not do"):
        list(iter(lambda: bomb.read(2**20), b""))


def test_a_long_text_is_expanded_part_by_part():
    digits = np.random.default_rng(0).integers(48, 58, 2**24, dtype=np.uint8).tobytes()
    stream = TextStream(io.BytesIO(gzip.compress(digits, 1)))
    tracemalloc.start()
    try:
        size = sum(len(part) for part in iter(lambda: stream.read(2**18), b""))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert size == len(digits)
    assert peak < len(digits) / 2, peak
