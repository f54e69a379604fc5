"""Print the lower bounds of all dependencies as constraints for pip.

Usage: python tests/checks/lowest.py [--root FOLDER]

Reads ``pyproject.toml`` of the folder. The dependencies are those of the package and of the extras that the suite
needs.
"""

import argparse
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

EXTRAS = ("dask", "delta", "excel", "iceberg", "identify", "readers", "test")
"""Extras that the suite needs."""

REQUIREMENT = re.compile(r"(?P<name>[\w.-]+)(\[[\w,-]+\])?(>=(?P<lowest>[\w.]+))?")


def main() -> None:
    """Print the constraints."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--root", type=Path, default=Path(__file__).parents[2], help="folder with pyproject.toml")
    project = tomllib.loads((parser.parse_args().root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    print(*constraints(project), sep="\n")


def constraints(project: dict) -> Iterator[str]:
    """Yield a line for each dependency.

    Raises
    ------
    ValueError
        If a dependency has no lower bound.
    """
    listed = [project["dependencies"], *(project["optional-dependencies"][extra] for extra in EXTRAS)]
    for requirement in (one for requirements in listed for one in requirements):
        found = REQUIREMENT.fullmatch(requirement)
        if found is None or not (found["lowest"] or found["name"] == project["name"]):
            raise ValueError(f"{requirement!r} has no lower bound alone; write NAME>=VERSION")
        if found["lowest"]:
            yield f"{found['name']}=={found['lowest']}"


if __name__ == "__main__":
    main()
