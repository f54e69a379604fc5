"""Batches through torch's DataLoader, and rows of a data set of Hugging Face: run by benchmarks/loaders.py.

python -m peers.torch_loops DATABASE FOLDER IDS
"""

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import datasets
import numpy as np
import pyarrow as pa
import torch
from peers.reading_rates import BATCH, Rate, drop_pages, rate
from torch.utils.data import DataLoader

from sigdb.loaders import BatchDataset, RowDataset


def main() -> None:
    """Print the rates as a line of JSON."""
    database, folder, count = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
    torch.set_num_threads(1)
    datasets.disable_progress_bars()
    print(json.dumps([asdict(one) for one in (*_sigdb(database), *_hugging_face(folder, count))]))


def _sigdb(database: Path) -> list[Rate]:
    rows = RowDataset(database, "location")
    batches = DataLoader(BatchDataset(rows, batch_size=BATCH), batch_size=None)
    single = DataLoader(rows, batch_size=BATCH, shuffle=True)
    return [
        rate("batches, torch", "sigdb, BatchDataset", len(rows), lambda: _loop(batches)),
        rate("batches, torch", "sigdb, RowDataset", len(rows), lambda: _loop(single)),
    ]


def _loop(loader: Any) -> float:
    """A training loop that only adds its inputs up."""
    return sum(float(x.sum()) for x, _ in loader)


def _hugging_face(folder: Path, count: int) -> list[Rate]:
    kinds = {}
    for key in ("tsa", "spectrum"):
        matrix = np.load(folder / f"{key}.npy")
        values = pa.FixedSizeListArray.from_arrays(pa.array(matrix.ravel()), matrix.shape[1])
        kinds[key] = values
    table = pa.table({**kinds, "tooth": np.arange(len(kinds["tsa"])) % 13})
    datasets.Dataset(table).save_to_disk(str(folder / "hugging_face"))
    del table, kinds
    files = [file for file in (folder / "hugging_face").iterdir() if file.is_file()]
    opened = datasets.load_from_disk(str(folder / "hugging_face")).with_format("numpy")
    ids = np.random.default_rng(0).choice(len(opened), count, replace=False)

    def cold() -> Any:
        return datasets.load_from_disk(str(folder / "hugging_face")).with_format("numpy")[ids]

    some = opened.select_columns(["tsa", "tooth"]).select(range(min(len(opened), 20_000))).with_format("torch")
    loader = DataLoader(some, batch_size=BATCH, shuffle=True)

    def loop() -> float:
        return sum(float(batch["tsa"].sum()) for batch in loader)

    return [
        rate("random rows, cold", "Hugging Face datasets", count, cold, before=drop_pages(files)),
        rate("random rows, warm", "Hugging Face datasets", count, lambda: opened[ids]),
        rate("batches, torch", "Hugging Face datasets", len(some), loop),
    ]


if __name__ == "__main__":
    main()
