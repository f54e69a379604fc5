"""Rigs by name or by file: one look-up that works from a checkout and from a wheel."""

from importlib import resources
from importlib.resources.abc import Traversable
from os import PathLike
from pathlib import Path

from sigdb.core import InputError, read_toml, suggestion, validated
from sigdb.transmission.ensemble.assumptions import value_problems
from sigdb.transmission.parts.casing_matrices import CasingMatrices
from sigdb.transmission.rig import Transmission, transmission_of


def load_transmission(name_or_path: str | Path) -> Transmission:
    """Return a rig by the name of a built-in one, or from a TOML file.

    Parameters
    ----------
    name_or_path
        A name as listed by :func:`built_in_transmissions`, or the path of a file that ends in ``.toml``.

    Returns
    -------
    Transmission

    Raises
    ------
    InputError
        If there is no such rig, or the file breaks a rule; the message names file, key, value and remedy.

    Examples
    --------
    >>> import sigdb
    >>> sigdb.load_transmission("nasa-spiral-bevel").operating.speed_rpm
    14400.0
    """
    text = str(name_or_path)
    if text.endswith(".toml"):
        return _read(Path(text), owner=text)
    files = _built_in_files()
    if text not in files:
        raise InputError(f"no built-in rig {text!r}{suggestion(text, files)} (a rig file's name ends in .toml)")
    with resources.as_file(files[text]) as path:
        return _read(path, owner=path.name)


def as_transmission(rig: Transmission | str | PathLike[str]) -> Transmission:
    """Return a transmission as it is, or load the one of that name or file.

    Raises
    ------
    TypeError
        If it is neither.
    """
    if isinstance(rig, Transmission):
        return rig
    if isinstance(rig, str | PathLike):
        return load_transmission(Path(rig) if isinstance(rig, PathLike) else rig)
    raise TypeError(
        f"rig is of type {type(rig).__name__}; give a Transmission, as of sigdb.load_transmission, or a name or file"
    )


def _read(path: Path, *, owner: str) -> Transmission:
    """A rig file, with a casing that is given by matrices turned into modes."""
    data = read_toml(path)
    matrices = data.get("casing", {}).pop("matrices", None) if isinstance(data.get("casing", {}), dict) else None
    if matrices is not None:
        if data["casing"].get("modes"):
            raise InputError(f"{owner}: casing.modes and casing.matrices are both given; give one of them")
        described = validated(CasingMatrices, matrices, owner=f"{owner}: casing.matrices")
        try:
            data["casing"]["modes"] = [mode.model_dump() for mode in described.casing_modes(path.parent)]
        except InputError as error:
            raise InputError(f"{owner}: {error}") from None
    rig = transmission_of(data, owner=owner)
    problems = list(value_problems(rig))
    if problems:
        raise InputError("\n".join(f"{owner}: {problem}" for problem in problems))
    return rig


def built_in_transmissions() -> list[str]:
    """Return the names of the rigs that come with sigdb.

    Returns
    -------
    list of str
    """
    return list(_built_in_files())


def built_in_file(name: str) -> Traversable:
    """Return a file from the folder of the built-in rigs, in a checkout or in a wheel."""
    return _folder() / name


def _built_in_files() -> dict[str, Traversable]:
    folder = _folder()
    names = sorted(entry.name for entry in folder.iterdir() if entry.name.endswith(".toml"))
    return {name.removesuffix(".toml").replace("_", "-"): folder / name for name in names}


def _folder() -> Traversable:
    packaged = resources.files("sigdb") / "data" / "transmissions"
    return packaged if packaged.is_dir() else Path(__file__).parents[2] / "data" / "transmissions"
