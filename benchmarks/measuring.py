"""What the benchmarks share: the machine, times, a core's peak, memory, and tables."""

import argparse
import json
import os
import platform
import time
import tracemalloc
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

import sigdb

REPEATS, SECONDS = 9, 1.0
"""Least number of runs, and how long they are repeated at least, s: what disturbs them comes and goes."""
_PEAK_SIZE = 768


def environment(*packages: str) -> dict[str, Any]:
    """What times depend on: the machine, how busy it is, and versions."""
    return {
        "platform": platform.platform(),
        "processor": _processor(),
        "cpus": os.cpu_count(),
        "load": round(os.getloadavg()[0], 1),
        "python": platform.python_version(),
        **{package: version(package) for package in packages},
        "sigdb": sigdb.__version__,
    }


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def least_seconds(call: Callable[[], Any], repeats: int = REPEATS) -> float:
    """Least processor time of several runs, s: other programs that share the machine count little in it."""
    call()
    found: list[float] = []
    while len(found) < repeats or sum(found) < SECONDS:
        found.append(timed(call)[1])
    return min(found)


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """A result, and the processor time of its one run, s."""
    started = time.process_time()
    return call(), time.process_time() - started


def peak_flops() -> float:
    """Floating-point operations a second of this core, by a product of matrices."""
    A = np.random.default_rng(0).standard_normal((_PEAK_SIZE, _PEAK_SIZE))
    return 2 * _PEAK_SIZE**3 / least_seconds(lambda: A @ A)


def peak_megabytes(call: Callable[[], Any]) -> float:
    """Greatest memory held at once during a call, beyond what was held before, 10^6 bytes."""
    call()
    tracemalloc.start()
    call()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak / 1e6


def json_option(parser: argparse._ActionsContainer) -> None:
    """Add the option for the file that the numbers are stored in."""
    parser.add_argument("--json", type=Path, metavar="FILE", help="store the numbers in this file too")


def publish(
    machine: Mapping[str, Any],
    tables: Mapping[str, Sequence[Mapping[str, Any]]],
    file: Path | None,
    *,
    more: Mapping[str, Any] | None = None,
) -> None:
    """Print tables with the machine that they are of, and store both, with more, where a file is given."""
    print(", ".join(f"{key} {value}" for key, value in machine.items()))
    for title, rows in tables.items():
        print_table(title, rows)
    if file is not None:
        document = {"machine": machine, "tables": tables, **(more or {})}
        file.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def print_table(title: str, rows: Sequence[Mapping[str, Any]]) -> None:
    """A title, and a line for each row."""
    print(f"\n{title}")
    if rows:
        cells = [list(rows[0]), *([_shown(value) for value in row.values()] for row in rows)]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        for line in cells:
            print("  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True)))


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"
    return "-" if value is None else str(value)
