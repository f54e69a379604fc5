"""Verification: the nearest of thousands of templates, against all of them in double precision."""

import numpy as np
import pyarrow as pa
import pytest
from numpy.testing import assert_allclose

from sigdb.database.matching.index import RMS, MatchIndex, index_batches
from sigdb.database.matching.nearest import nearest

TEETH, STEP = 8, 16
N = TEETH * STEP


@pytest.fixture(scope="module")
def templates():
    """3000 averages: a mesh tone, and a residual of some strength."""
    rng = np.random.default_rng(11)
    spectrum = np.zeros((3000, N // 2 + 1), complex)
    spectrum[:, 3:20] = (rng.normal(size=(3000, 17, 2)) @ [1, 1j]) * rng.exponential(size=(3000, 1))
    return np.float32(np.cos(2 * np.pi * np.arange(N) / STEP) + np.fft.irfft(spectrum, N))


@pytest.fixture(scope="module")
def bank(templates):
    """In batches of unequal size, with other lengths and missing ones between them."""
    rows = [*templates[:1000], None, np.zeros(N - 8, np.float32), *templates[1000:]]
    numbers = [*range(1000), -1, -2, *range(1000, 3000)]
    table = pa.table({"template": numbers, "tsa": pa.array(rows, pa.list_(pa.float32()))})
    blocks = list(index_batches(table.to_batches(max_chunksize=77), "tsa", N, TEETH))
    whole = pa.Table.from_batches(blocks)
    spectra = tuple(
        chunk.flatten().to_numpy().reshape(len(chunk), -1).view(np.complex64) for chunk in whole["spectrum"].chunks
    )
    assert whole["template"].to_pylist() == list(range(3000))
    assert len(spectra) > 3
    return MatchIndex(cases=whole.drop_columns(["spectrum"]), spectra=spectra)


def without_regular(x):
    x = np.asarray(x, float)
    """Of unit deviation; nothing where only float32's rounding is left."""
    X = np.fft.fft((x - x.mean(axis=-1, keepdims=True)) / x.std(axis=-1, keepdims=True))
    for order in (1, 2, *range(TEETH, N // 2, TEETH)):
        X[..., order] = X[..., -order] = 0
    z = np.fft.ifft(X).real
    return np.where(np.sqrt(np.mean(z**2, axis=-1, keepdims=True)) > 64 * 2**-23, z, 0)


def test_residuals_of_the_bank(bank, templates):
    z = without_regular(templates)
    assert_allclose(np.concatenate(bank.spectra), np.fft.rfft(z), rtol=0, atol=1e-4)
    assert_allclose(bank.cases[RMS].to_numpy(), np.sqrt(np.mean(z**2, axis=1)), rtol=1e-6)


@pytest.mark.parametrize("noise", [0, 0.1, 0.5])
def test_against_all_turns_of_all(bank, templates, noise):
    """A third of the templates takes memory and time enough."""
    rng, asked = np.random.default_rng(0), np.arange(0, 3000, 3)
    x = np.roll(templates[rng.choice(asked)], rng.integers(N)) + noise * rng.normal(size=N)
    z, z_t = without_regular(x), without_regular(templates)
    turned = np.stack([np.roll(z_t[asked], s, axis=1) for s in range(N)])
    distance = np.sqrt(np.mean((z - turned) ** 2, axis=-1))
    order = np.argsort(distance.min(axis=0))[:20]
    found = nearest(bank, x, teeth=TEETH, k=20, shifts=np.arange(N), among=np.arange(3000) % 3 == 0)
    assert found.place.tolist() == asked[order].tolist()
    assert found.shift.tolist() == distance.argmin(axis=0)[order].tolist()
    assert_allclose(found.residual_distance, distance.min(axis=0)[order], rtol=0, atol=1e-6)
    best = np.stack([np.roll(z_t[i], s) for i, s in zip(found.place, found.shift, strict=True)])
    assert_allclose(found.match, best @ z / np.linalg.norm(best, axis=1) / np.linalg.norm(z), rtol=0, atol=1e-6)


def test_among_some(bank, templates):
    among = np.zeros(3000, bool)
    among[[7, 2500]] = True
    found = nearest(bank, templates[1234], teeth=TEETH, k=5, shifts=np.arange(N), among=among)
    assert sorted(found.place.tolist()) == [7, 2500]
    assert nearest(bank, templates[2500], teeth=TEETH, k=1, shifts=np.array([0]), among=among).place.tolist() == [2500]
