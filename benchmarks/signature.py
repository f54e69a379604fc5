"""Signature analysis on one core: sigdb against tftb, scipy and straightforward NumPy, all in this run.

Three things are timed: averaging 100 revolutions of 1024 samples, the features of an average of 768 samples (12 teeth,
lags up to two tooth passes, 384 bins), and its Wigner-Ville distribution itself. Times are the best of several runs
after a first one, in microseconds an average; batches are of 256. The fraction of the flop bound is that of the rate of
a matrix product measured here. Errors are against the closed form of the averaged signal, the whole distribution pooled
and, for tftb's distribution, sigdb's between zeros, as fractions of the largest value.

tftb is measured if it is installed (`make peers`); scipy and NumPy always are.

    python benchmarks/signature.py [--json FILE]
"""

import argparse
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
from measuring import environment, json_option, publish
from scipy.interpolate import CubicSpline
from scipy.ndimage import map_coordinates
from scipy.signal import hilbert
from scipy.stats import kurtosis, moment
from threadpoolctl import threadpool_limits

from sigdb.signature import (
    indicators,
    mesh_bands,
    order_spectrum,
    pooled_wigner_ville,
    synchronous_average,
    wigner_ville,
)

TEETH, N, LAGS, BINS = 12, 768, 128, 384
REVOLUTIONS, SAMPLES = 100, 1024
BATCH = 256
SECONDS = 0.5
AIMS = {"pooled features": 50.0, "whole signature": 100.0, "synchronous average": 3000.0}


@dataclass(frozen=True, kw_only=True)
class Row:
    """One way to do one thing: microseconds an average, flops where counted, error where there is a truth."""

    what: str
    by: str
    us: float
    flops: float | None = None
    error: float | None = None


def main() -> None:
    """Print the table, or a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    json_option(parser)
    given = parser.parse_args()
    with threadpool_limits(1):
        machine, peak = environment("numpy", "scipy", "numba"), matrix_product_rate()
        rows = [*averaging(), *features(), *distributions()]
    machine |= {"gflops": round(peak / 1e9, 1), "tftb": tftb_version() or "not installed"}
    publish(machine, {"Signatures": table(rows, peak)}, given.json)
    if not any(row.by == "tftb" for row in rows):
        print("tftb is not installed, so not measured; `make peers` installs it")


def tftb_version() -> str | None:
    """The installed tftb, if any."""
    try:
        return version("tftb")
    except PackageNotFoundError:
        return None


def matrix_product_rate() -> float:
    """Flops a second of a large product of float64 matrices, the machine's practical peak."""
    a = np.random.default_rng(0).normal(size=(1024, 1024))
    return 2 * 1024**3 / (timed(lambda: a @ a) * 1e-6)


def averaging() -> list[Row]:
    """A run-up of a shaft, 1 % over the record, with four tones that belong to it."""
    i = np.arange(int(REVOLUTIONS * SAMPLES * 1.005) + 100)
    turned = i / (1.01 * SAMPLES) + 0.5 * 0.01 / REVOLUTIONS * (i / SAMPLES) ** 2
    pulses = np.interp(np.arange(REVOLUTIONS + 1), turned, i.astype(float))
    tones = {1: 0.2, 32: 1.0, 33: 0.2, 96: 0.3}
    x, expected = (sum(a * np.cos(2 * np.pi * o * p) for o, a in tones.items()) for p in (turned, _angle(SAMPLES)))

    def places() -> Any:
        return CubicSpline(np.arange(REVOLUTIONS + 1), pulses)(np.arange(REVOLUTIONS * SAMPLES) / SAMPLES)

    def by_sigdb(samples: int = SAMPLES) -> Any:
        return synchronous_average(x, 1.0, pulses, samples_per_rev=samples).tsa

    def by_spline() -> Any:
        return map_coordinates(x, places()[None], order=3, mode="mirror").reshape(REVOLUTIONS, SAMPLES).mean(axis=0)

    def by_line() -> Any:
        return np.interp(places(), i, x).reshape(REVOLUTIONS, SAMPLES).mean(axis=0)

    def row(by: str, call: Callable[[], Any], flops: float | None = None) -> Row:
        found = call()
        truth = expected[:: SAMPLES // found.size]
        error = float(np.abs(found - truth).max() / np.abs(expected).max())
        return Row(what="synchronous average", by=by, us=timed(call), flops=flops, error=error)

    # For each of 32 samples a cubic and a product.
    resampling = REVOLUTIONS * SAMPLES * 32 * 8.0
    return [
        row("sigdb", by_sigdb, resampling),
        row("sigdb, to 256", lambda: by_sigdb(256), resampling),
        row("scipy, cubic B-spline", by_spline),
        row("NumPy, linear", by_line),
    ]


def features() -> list[Row]:
    """Spectrum, pooled features and indicators of a batch of averages."""
    x = np.random.default_rng(0).normal(size=(BATCH, N))
    bands = mesh_bands(TEETH)

    def pooled(x: Any) -> Any:
        return pooled_wigner_ville(x, teeth=TEETH, bands=bands, lag_window=LAGS, n_bins=BINS)

    def whole() -> None:
        order_spectrum(x)
        pooled(x)
        indicators(x, teeth=TEETH)

    # Lag products, the product with the matrix of bands, and two transforms of the analytic signal.
    flops = 8 * N * (LAGS + 1) + 4 * TEETH * (LAGS + 1) * (bands.size - 1) + 7.5 * N * np.log2(N)
    few = x[:16]
    expected = pool(wigner_ville(few, lag_window=LAGS, n_bins=BINS), bands)

    def error(found: Any) -> float:
        return float(np.abs(found - expected).max() / np.abs(expected).max())

    return [
        Row(what="whole signature", by="sigdb", us=timed(whole) / BATCH),
        Row(
            what="pooled features",
            by="sigdb",
            us=timed(lambda: pooled(x)) / BATCH,
            flops=flops,
            error=error(pooled(few)),
        ),
        Row(
            what="pooled features",
            by="NumPy and scipy",
            us=timed(lambda: pool(plain_distribution(few), bands)) / len(few),
            error=error(pool(plain_distribution(few), bands)),
        ),
        Row(what="order spectrum", by="sigdb", us=timed(lambda: order_spectrum(x)) / BATCH),
        Row(what="indicators", by="sigdb", us=timed(lambda: indicators(x, teeth=TEETH)) / BATCH),
        Row(
            what="indicators", by="NumPy and scipy", us=timed(lambda: [plain_indicators(one) for one in few]) / len(few)
        ),
    ]


def distributions() -> list[Row]:
    """The distribution itself, which the pooled features do without."""
    x = np.random.default_rng(0).normal(size=(16, N))
    rows = [
        Row(what="distribution", by="sigdb", us=timed(lambda: wigner_ville(x, lag_window=LAGS)) / len(x)),
        Row(what="distribution", by="NumPy and scipy", us=timed(lambda: plain_distribution(x, N)) / len(x)),
    ]
    if tftb_version():
        from tftb.processing import PseudoWignerVilleDistribution

        z = hilbert(x[0])
        window = np.hamming(2 * LAGS + 1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            us = timed(lambda: PseudoWignerVilleDistribution(z, fwindow=window).run())
            theirs, _, _ = PseudoWignerVilleDistribution(z, fwindow=window).run()
        ours = wigner_ville(z, lag_window=LAGS, boundary="zero")
        error = float(np.abs(theirs.T - ours).max() / np.abs(ours).max())
        rows.append(Row(what="distribution", by="tftb", us=us, error=error))
    return rows


def plain_distribution(x: Any, bins: int = BINS) -> Any:
    """The pseudo distribution as one would write it: index the lags, transform over them."""
    z = hilbert(x)
    n, m = np.arange(N)[:, None], np.arange(-LAGS, LAGS + 1)
    r = np.zeros((len(x), N, bins), dtype=complex)
    r[..., m % bins] = np.hamming(2 * LAGS + 1) * z[:, (n + m) % N] * z[:, (n - m) % N].conj()
    return np.fft.fft(r).real


def pool(W: Any, bands: Any) -> Any:
    """Sums over tooth passes and bands."""
    edges = np.searchsorted(np.arange(W.shape[-1]) * N / (2 * W.shape[-1]), bands)
    cells = W.reshape(len(W), TEETH, N // TEETH, -1).sum(axis=2)
    return np.add.reduceat(cells, edges, axis=-1)[..., :-1]


def plain_indicators(x: Any) -> list[Any]:
    """The thirteen indicators as one would write them one by one."""
    X = np.fft.rfft(x)
    A = np.abs(X) * 2 / N
    mesh = np.arange(TEETH, N // 2, TEETH)
    regular, difference = np.zeros_like(X), X.copy()
    kept = np.union1d([1, 2], mesh)
    regular[kept] = X[kept]
    difference[np.r_[0, kept, mesh - 1, mesh + 1]] = 0
    r, d = np.fft.irfft(regular), np.fft.irfft(difference)
    rms = np.sqrt(np.mean(x**2))
    pairs = np.arange(1, 7)
    return [
        rms,
        np.ptp(x),
        np.abs(x).max() / rms,
        kurtosis(x, fisher=False),
        kurtosis(x**2 - np.roll(x, 1) * np.roll(x, -1), fisher=False),
        np.ptp(x) / A[mesh].sum(),
        *(moment(d, q) / moment(d, 2) ** (q // 2) for q in (4, 6, 8)),
        np.sqrt(np.mean(d**2) / np.mean(r**2)),
        (A[TEETH - 1] + A[TEETH + 1]) / 2,
        (A[TEETH - 1] + A[TEETH + 1]) / np.std(x),
        (A[TEETH - pairs] + A[TEETH + pairs]).sum() / A[TEETH],
    ]


def timed(call: Callable[[], Any]) -> float:
    """Least time of several runs after a first one, us."""
    call()
    seconds, until = [], time.perf_counter() + SECONDS
    while len(seconds) < 3 or time.perf_counter() < until:
        started = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - started)
    return min(seconds) * 1e6


def _angle(n: int) -> Any:
    return np.arange(n) / n


def table(rows: list[Row], peak: float) -> list[dict[str, Any]]:
    """One row for each way, with its time as a multiple of sigdb's for the same thing."""
    own = {row.what: row.us for row in reversed(rows) if row.by == "sigdb"}
    return [
        {
            "what": row.what,
            "by": row.by,
            "us": row.us,
            "times sigdb": row.us / own[row.what],
            "aim, us": AIMS.get(row.what) if row.by == "sigdb" else None,
            "of flop bound": None if row.flops is None else row.flops / (row.us * 1e-6 * peak),
            "error": row.error,
        }
        for row in rows
    ]


if __name__ == "__main__":
    main()
