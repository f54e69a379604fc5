"""Rows in random order, and batches into a training loop: sigdb against npz files, HDF5 and Hugging Face datasets.

A database of --rows rows is written as benchmarks/query.py does: averages of 768 samples and spectra of 385 bins, of
made-up numbers that weigh as much as simulated ones. Its averages and spectra are also written as one npz file a row
(of --files rows), as an HDF5 file (contiguous, not compressed) and as a data set of Hugging Face (Arrow, mapped).

Each way reads the averages and spectra of --ids random rows. *Warm* is the best of several runs; *cold* is one run
after the pages of the files were dropped from memory, with opening. Then averages go through a loop in shuffled batches
of 256, as NumPy arrays and through torch's DataLoader. Rates are rows a second, by the time that passed and by
processor time.

    python benchmarks/loaders.py [--rows 100000] [--ids 1000] [--files 2000] [--environments build/peers] [--json FILE]

torch and datasets are in an environment of their own, which the first run makes in some minutes.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import venv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from measuring import environment, print_table
from peers.reading_rates import Rate, drop_pages, rate, shuffled
from query import synthetic

import sigdb
from sigdb.loaders import BatchDataset, RowDataset

ROOT = Path(__file__).parents[1]
AIMS = {"random rows, warm": 50_000, "random rows, cold": 20_000, "batches, NumPy": 50_000, "batches, torch": 50_000}
"""Aims of sigdb, rows a second."""


def main() -> None:
    """Print the table, or write a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=100_000, help="rows of the database")
    parser.add_argument("--ids", type=int, default=1000, help="random rows that are read at once")
    parser.add_argument("--files", type=int, default=2000, help="files of the peer that keeps one a row")
    parser.add_argument("--environments", type=Path, default=ROOT / "build" / "peers", help="folder of environments")
    parser.add_argument("--json", type=Path, help="file for the numbers")
    options = parser.parse_args()
    python = _environment(options.environments / "loaders")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        database = synthetic(folder / "db", options.rows, 1000)
        rows = [*_sigdb(database, options.ids), *_npz(database, folder / "npz", options.files, options.ids)]
        rows += _hdf5(database, folder / "rows.h5", options.ids)
        signals = sigdb.open(database).signals(np.arange(options.rows))
        for key, values in signals.items():
            np.save(folder / f"{key}.npy", values)
        del signals
        command = [python, "-m", "peers.torch_loops", database, folder, str(options.ids)]
        paths = os.pathsep.join([str(ROOT), str(Path(__file__).parent)])
        done = subprocess.run(
            command, check=True, stdout=subprocess.PIPE, env=os.environ | {"PYTHONPATH": paths}, text=True
        )
        rows += [Rate(**row) for row in json.loads(done.stdout.splitlines()[-1])]
    table = [row.shown(AIMS.get(row.what) if row.by.startswith("sigdb") else None) for row in rows]
    if options.json:
        facts = {"rows": options.rows, "ids": options.ids, "files": options.files}
        document = {"machine": environment("numpy", "pyarrow", "h5py"), **facts, "tables": {"rates": table}}
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    print_table(f"Rows a second; {options.rows} rows, {options.ids} of them at random", table)


def _environment(folder: Path) -> Path:
    """Return the Python of the environment with sigdb, torch and datasets, which is made if it is missing."""
    python = folder / "bin" / "python"
    if not python.exists():
        venv.create(folder, with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", str(ROOT), "torch", "datasets"], check=True)
    return python


def _sigdb(path: Path, count: int) -> Iterator[Rate]:
    files = [file for file in path.rglob("*") if file.is_file()]
    opened = sigdb.open(path)
    ids = np.random.default_rng(0).choice(len(opened), count, replace=False)
    yield rate("random rows, cold", "sigdb", count, lambda: sigdb.open(path).signals(ids), before=drop_pages(files))
    yield rate("random rows, warm", "sigdb", count, lambda: opened.signals(ids))
    rows = RowDataset(path, "location")
    yield rate("batches, NumPy", "sigdb, BatchDataset", len(rows), lambda: sum(len(x) for x, _ in BatchDataset(rows)))
    order = shuffled(len(rows))
    yield rate("batches, NumPy", "sigdb, RowDataset", len(rows), lambda: sum(len(rows[some][0]) for some in order))


def _npz(path: Path, folder: Path, files: int, count: int) -> Iterator[Rate]:
    folder.mkdir()
    signals = sigdb.open(path).signals(np.arange(files))
    names = [folder / f"{number:06d}.npz" for number in range(files)]
    for number, name in enumerate(names):
        np.savez(name, **{key: values[number] for key, values in signals.items()})
    some = [names[i] for i in np.random.default_rng(0).integers(0, files, count)]

    def read(chosen: list[Path], *keys: str) -> Any:
        return [_arrays(name, *keys) for name in chosen]

    both = tuple(signals)
    yield rate("random rows, cold", "npz, a file a row", count, lambda: read(some, *both), before=drop_pages(names))
    yield rate("random rows, warm", "npz, a file a row", count, lambda: read(some, *both))
    every = [[names[i % files] for i in batch] for batch in shuffled(files)]
    yield rate("batches, NumPy", "npz, a file a row", files, lambda: [read(batch, "tsa") for batch in every])


def _arrays(name: Path, *keys: str) -> Any:
    with np.load(name) as content:
        return [content[key] for key in keys]


def _hdf5(path: Path, file: Path, count: int) -> Iterator[Rate]:
    opened = sigdb.open(path)
    signals = opened.signals(np.arange(len(opened)))
    with h5py.File(file, "w") as content:
        for key, values in signals.items():
            content.create_dataset(key, data=values)
    del signals
    ids = np.sort(np.random.default_rng(0).choice(len(opened), count, replace=False))  # h5py takes ascending rows

    def read(content: h5py.File) -> Any:
        return content["tsa"][ids], content["spectrum"][ids]

    def cold() -> Any:
        with h5py.File(file) as content:
            return read(content)

    yield rate("random rows, cold", "HDF5", count, cold, before=drop_pages([file]))
    with h5py.File(file) as content:
        yield rate("random rows, warm", "HDF5", count, lambda: read(content))
        order = [np.sort(batch) for batch in shuffled(20_000 if len(opened) > 20_000 else len(opened))]
        rows = sum(map(len, order))
        yield rate("batches, NumPy", "HDF5", rows, lambda: sum(len(content["tsa"][some]) for some in order))


if __name__ == "__main__":
    sys.exit(main())
