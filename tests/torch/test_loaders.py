"""Documentation and unit: torch's DataLoader takes both datasets as they are, with and without workers."""

import re
from pathlib import Path

import numpy as np
import pytest
import torch
from torch.utils.data import DataLoader, IterableDataset

import sigdb
from sigdb.loaders import BatchDataset, RowDataset
from sigdb.pipeline import load_recipe
from sigdb.sweep import run

ROOT = Path(__file__).parents[2]
RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 3
specimens = 6
healthy = 50
draws = 8

[[sweep.grid]]
tooth = "all"
stiffness_loss = [0.2, 0.4]

[signature]
samples_per_tooth = 64
sensors = ["pinion-vertical"]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a database in the place that the page names."""
    folder = tmp_path_factory.mktemp("torch")
    (folder / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    recipe = load_recipe(folder / "recipe.toml")
    run(recipe.plan(), folder / "data" / "quick" / "signatures", recipe=recipe.text, jobs=1)
    return folder


@pytest.fixture
def rows(folder):
    return RowDataset(folder / "data" / "quick" / "signatures", "location", fold="training")


@pytest.mark.parametrize("workers", [0, 2])
def test_a_map_style_loader_gives_each_row_once(rows, workers):
    generator = torch.Generator().manual_seed(1)
    loader = DataLoader(rows, batch_size=100, shuffle=True, num_workers=workers, generator=generator)
    x, tooth = (torch.cat(parts).numpy() for parts in zip(*loader, strict=True))
    assert (x.dtype, tooth.dtype) == (np.float32, np.int64)
    _same_rows(rows, x, tooth)


@pytest.mark.parametrize("workers", [0, 2])
def test_an_iterable_loader_gives_each_row_once_and_another_order_each_time(rows, workers):
    batches = BatchDataset(rows, batch_size=100)
    assert isinstance(batches, IterableDataset)
    loader = DataLoader(batches, batch_size=None, num_workers=workers)
    orders = []
    for _ in range(2):
        x, tooth = (torch.cat(parts).numpy() for parts in zip(*loader, strict=True))
        _same_rows(rows, x, tooth)
        orders.append(x[:, 0])
    assert not np.array_equal(*orders)


def _same_rows(rows, x, tooth):
    stored, labels = rows[:]
    order, due = np.argsort(x[:, 0]), np.argsort(stored[:, 0])
    assert np.array_equal(x[order], stored[due])
    assert np.array_equal(tooth[order], labels[due])


def test_the_examples_of_the_page_run(folder, monkeypatch):
    monkeypatch.chdir(folder)
    page = (ROOT / "docs" / "guide" / "torch.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```(?:\{code-block\} )?python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    names = {"sigdb": sigdb}
    assert len(blocks) == 4
    for source in blocks:
        exec(compile(source, "torch.md", "exec"), names)
    assert float(names["loss"].detach()) > 0
    x, tooth = next(iter(names["loader"]))
    assert x.shape == (256, 768)
    assert tooth.dtype == torch.int64
