"""The README's table of speed, from the numbers that the benchmarks stored.

    python benchmarks/speed_table.py

writes it between its marks in README.md.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import Any

HERE = Path(__file__).parent
README = HERE.parent / "README.md"
BEGIN, END = "<!-- speed: made by benchmarks/speed_table.py -->", "<!-- speed: end -->"
NAMES = {"numpy": "NumPy", "scipy": "SciPy", "pyarrow": "pyarrow", "duckdb": "DuckDB", "pandas": "pandas"}


@dataclass(frozen=True, kw_only=True)
class Line:
    """A line of the table: sigdb and a peer, each a row of a stored table, named by some of its values."""

    what: str
    file: str
    table: str
    value: str
    unit: str
    ours: dict[str, Any]
    peer: dict[str, Any]
    name: str
    less_is_better: bool = True


def _timed(what: str, file: str, table: str, value: str, unit: str, name: str, *, by: str, key: str) -> Line:
    return Line(
        what=what, file=file, table=table, value=value, unit=unit, name=name,
        ours={"what": key, "by": "sigdb"}, peer={"what": key, "by": by},
    )  # fmt: skip


SIGNATURE, QUERY = ("signature", "Signatures", "us", "us"), ("query", "Queries", "ms", "ms")
LINES = (
    _timed(
        "indicators of an average of 768 samples", *SIGNATURE, "a loop with NumPy and SciPy",
        by="NumPy and scipy", key="indicators",
    ),
    _timed(
        "its pooled Wigner-Ville features", *SIGNATURE, "a loop with NumPy and SciPy",
        by="NumPy and scipy", key="pooled features",
    ),
    _timed(
        "average of 100 revolutions of 1024 samples", *SIGNATURE, "SciPy, cubic B-spline",
        by="scipy, cubic B-spline", key="synchronous average",
    ),
    Line(
        what="signatures a second to Parquet, on one core", file="sweep", table="One file a row",
        value="rows a second", unit="",
        ours={"by": "sigdb, on one core"}, peer={"by": "a loop: simulate, analyse, savemat"},
        name="a loop that simulates, analyses and saves", less_is_better=False,
    ),
    _timed(
        "1000 rows by id, of 100 000", *QUERY, "an npz file a row, 1000 files", by="one .npz a row",
        key="look-up of 1000 ids",
    ),
    _timed("average by tooth over 100 000 rows", *QUERY, "pandas", by="pandas, all columns", key="aggregate"),
    _timed("the same", *QUERY, "DuckDB, without checksums", by="DuckDB, no checksums", key="aggregate"),
    _timed("match with 100 000 templates", *QUERY, "NumPy", by="NumPy, scaled up", key="match"),
)  # fmt: skip


def main() -> None:
    """Write the table."""
    write_table()


def write_table() -> None:
    """Write the table into the README."""
    README.write_text(with_table(README.read_text(encoding="utf-8")), encoding="utf-8")


def with_table(readme: str) -> str:
    """Return the README with the table of what is stored."""
    before, _, rest = readme.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n\n{table()}\n\n{END}{after}"


def table() -> str:
    """Return the table with its machine, as Markdown."""
    documents = {line.file: json.loads((HERE / f"{line.file}.json").read_text(encoding="utf-8")) for line in LINES}
    lines = ["| what | sigdb | peer | by the peer | sigdb is faster by |", "|---|---|---|---|---|"]
    for line in LINES:
        rows = documents[line.file]["tables"][line.table]
        ours, theirs = (_found(rows, some)[line.value] for some in (line.ours, line.peer))
        factor = theirs / ours if line.less_is_better else ours / theirs
        unit = f" {line.unit}" if line.unit else ""
        lines.append(
            f"| {line.what} | {_digits(ours)}{unit} | {line.name} | {_digits(theirs)}{unit} | {_digits(factor)} |"
        )
    return "\n".join([*lines, "", *_machines(list(documents.values()))])


def _found(rows: list[dict[str, Any]], some: dict[str, Any]) -> dict[str, Any]:
    (row,) = [row for row in rows if all(row.get(name) == value for name, value in some.items())]
    return row


def _machines(documents: list[dict[str, Any]]) -> Iterator[str]:
    machine = {name: value for document in documents for name, value in document["machine"].items()}
    versions = [f"{NAMES[name]} {machine[name]}" for name in NAMES if name in machine]
    yield from wrap(
        f"On one core of {machine['cpus']} of an {machine['processor']} machine, with Python {machine['python']}, "
        f"{', '.join(versions)}. `make bench` measures them again.",
        120,
    )


def _digits(value: float) -> str:
    """Return a number with two or three digits."""
    return f"{value:,.0f}".replace(",", " ") if value >= 100 else f"{value:.3g}" if value >= 1 else f"{value:.2g}"


if __name__ == "__main__":
    main()
