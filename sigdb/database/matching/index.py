"""The match index: spectra of the templates' residuals, with their cases, in a file of the user's cache.

The file is an uncompressed Arrow file that is memory-mapped, followed by four bytes of its CRC-32. It is written again
whenever its name or its checksum does not fit, so it may be deleted at any time.
"""

import itertools
import os
import zlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
import platformdirs
import pyarrow as pa
from numpy.typing import NDArray

from sigdb.core import publish
from sigdb.database.matching.residuals import root_mean_square, unit_residuals
from sigdb.database.signals import list_lengths, list_matrix

RMS, SPECTRUM = "residual_rms", "spectrum"
_BLOCK = 512
"""Templates of a block: their spectra and correlations stay in the cache of a core."""

_SUM_BYTES = 4


@dataclass(frozen=True, kw_only=True)
class MatchIndex:
    """The templates of one length, ready to be matched.

    Attributes
    ----------
    cases
        Columns without lists, one row a template, and ``residual_rms``.
    spectra
        Blocks of consecutive templates: (rows, n // 2 + 1) complex64, the FFT of each residual of unit deviation.
    """

    cases: pa.Table
    spectra: tuple[NDArray[np.complex64], ...]


def cached_index(key: str, make_batches: Callable[[], Iterable[pa.RecordBatch]]) -> MatchIndex:
    """Return the index with a key, from the cache if the file there is whole; else make it and write it there.

    Where the cache cannot be written, the index is held in memory.

    Parameters
    ----------
    key
        Name of all that the index depends on.
    make_batches
        Returns the batches of the index; see :func:`index_batches`.
    """
    path = cache_folder() / f"match-{key}.arrow"
    content = _read(path, key)
    if content is None:
        try:
            publish(path, lambda temporary: _write(temporary, key, make_batches()))
            content = _read(path, key)
        except OSError:
            content = None
    return _index(_in_memory(make_batches()) if content is None else content)


def cache_folder() -> Path:
    """Return the folder of caches: ``SIGDB_CACHE``, or the user's cache directory."""
    return Path(os.environ.get("SIGDB_CACHE") or platformdirs.user_cache_dir("sigdb", appauthor=False))


def index_batches(templates: Iterable[pa.RecordBatch], column: str, n: int, teeth: int) -> Iterator[pa.RecordBatch]:
    """Yield the blocks of an index.

    Parameters
    ----------
    templates
        Batches of templates.
    column
        Column of their clean averages.
    n
        Samples of an average; templates of other lengths are left out.
    teeth
        Tooth count of the averaged gear.
    """
    waiting: list[pa.RecordBatch] = []
    for batch in templates:
        fitting = batch.filter(pa.array(list_lengths(batch[column]) == n))
        waiting += [fitting] if fitting.num_rows else []
        if sum(part.num_rows for part in waiting) >= _BLOCK:
            yield _block(waiting, column, n, teeth)
            waiting = []
    if waiting:
        yield _block(waiting, column, n, teeth)


def _block(batches: list[pa.RecordBatch], column: str, n: int, teeth: int) -> pa.RecordBatch:
    (batch,) = pa.Table.from_batches(batches).combine_chunks().to_batches()
    z = unit_residuals(list_matrix(batch[column], n), teeth)
    parts = np.fft.rfft(z).astype(np.complex64).view(np.float32)
    spectra = pa.FixedSizeListArray.from_arrays(pa.array(parts.ravel()), parts.shape[1])
    cases = batch.drop_columns([column])
    return cases.append_column(RMS, pa.array(root_mean_square(z))).append_column(SPECTRUM, spectra)


def _read(path: Path, key: str) -> pa.Buffer | None:
    """The Arrow file in a file of the cache; None if it is missing, or was not written whole for this key."""
    try:
        content = np.memmap(path, dtype=np.uint8, mode="r")
    except (OSError, ValueError):
        return None
    body, stored = content[:-_SUM_BYTES], content[-_SUM_BYTES:].tobytes()
    return pa.py_buffer(body) if body.size and _sum(body, key) == stored else None


def _write(path: Path, key: str, batches: Iterable[pa.RecordBatch]) -> None:
    with path.open("wb") as file:
        _write_arrow(file, batches)
    body = np.memmap(path, dtype=np.uint8, mode="r")
    with path.open("ab") as file:
        file.write(_sum(body, key))


def _in_memory(batches: Iterable[pa.RecordBatch]) -> pa.Buffer:
    sink = pa.BufferOutputStream()
    _write_arrow(sink, batches)
    return sink.getvalue()


def _write_arrow(sink: IO[bytes] | pa.NativeFile, batches: Iterable[pa.RecordBatch]) -> None:
    batches = iter(batches)
    first = next(batches)
    with pa.ipc.new_file(sink, first.schema) as writer:
        for batch in itertools.chain([first], batches):
            writer.write_batch(batch)


def _sum(body: NDArray[np.uint8], key: str) -> bytes:
    return zlib.crc32(body.data, zlib.crc32(key.encode())).to_bytes(_SUM_BYTES, "little")


def _index(content: pa.Buffer) -> MatchIndex:
    table = pa.ipc.open_file(content).read_all()
    return MatchIndex(
        cases=table.drop_columns([SPECTRUM]),
        spectra=tuple(_complex(chunk) for chunk in table[SPECTRUM].chunks),
    )


def _complex(chunk: pa.FixedSizeListArray) -> NDArray[np.complex64]:
    parts: NDArray[np.float32] = chunk.flatten().to_numpy(zero_copy_only=True)
    return parts.reshape(len(chunk), -1).view(np.complex64)
