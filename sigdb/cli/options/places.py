"""Types of arguments that name files, rigs and databases: a missing one is refused before slow imports."""

from pathlib import Path

import click

from sigdb.core import InputError


class ExistingPath(click.ParamType):  # type: ignore[type-arg]  # generic in later versions of click only
    """A file or folder that exists."""

    name = "path"

    def convert(self, value: str | Path, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Return the path."""
        check_exists(Path(value))
        return Path(value)


class RecordingOrDatabase(ExistingPath):
    """A file or folder that exists, or the URI of a database."""

    def convert(self, value: str | Path, param: click.Parameter | None, ctx: click.Context | None) -> Path | str:  # type: ignore[override]
        """Return the path, or the URI as it is."""
        return value if isinstance(value, str) and "://" in value else super().convert(value, param, ctx)


class RigName(click.ParamType):  # type: ignore[type-arg]
    """The name of a built-in rig, or a rig file that exists."""

    name = "text"

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the name."""
        if value.endswith(".toml"):
            check_exists(Path(value))
        return value


class DatabasePlace(click.ParamType):  # type: ignore[type-arg]
    """The directory of a database, or a URI, which is read later."""

    name = "text"

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the place."""
        if "://" not in value:
            check_database(Path(value))
        return value


def check_exists(path: Path) -> None:
    """Refuse a path that does not exist.

    Raises
    ------
    InputError
        Names the path.
    """
    if not path.exists():
        raise InputError(f"{path}: no such file")


def check_database(folder: Path) -> None:
    """Refuse a folder that holds no database.

    Raises
    ------
    InputError
        Names the folder and the command that makes a database.
    """
    if not (folder / "sigdb.toml").is_file():
        raise InputError(
            f"{folder} is not a sigdb database (it has no sigdb.toml); make one with: "
            f"python -m sigdb.sweep RECIPE --out {folder}"
        )


RECIPE = ExistingPath()
RECORDING = ExistingPath()
RECORDING_OR_DATABASE = RecordingOrDatabase()
RIG = RigName()
DATABASE = DatabasePlace()
