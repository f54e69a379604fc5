"""Reference models by name: one look-up that works from a checkout and from a wheel."""

from importlib import resources
from pathlib import Path

from sigdb.core.errors import InputError, suggestion


def built_in_models() -> list[str]:
    """Names of the reference models that come with sigdb.

    Examples
    --------
    >>> from sigdb.recognition import built_in_models
    >>> built_in_models()
    ['nasa-location', 'nasa-severity']
    """
    return list(_built_in_folders())


def model_folder(name_or_folder: str | Path) -> Path:
    """The folder of a reference model, by its name, or the folder that is given.

    A name is text without a path separator that is not a folder here.

    Raises
    ------
    InputError
        If it is a name, and there is no such model.
    """
    folder = Path(name_or_folder)
    if folder.is_dir() or len(folder.parts) != 1 or folder.name != str(name_or_folder):
        return folder
    built_in = _built_in_folders()
    if folder.name not in built_in:
        raise InputError(
            f"{folder.name} is neither a model folder nor a reference model{suggestion(folder.name, built_in)}; "
            f"reference models: {', '.join(built_in) or 'none'}; make a model with: sigdb train"
        )
    return built_in[folder.name]


def _built_in_folders() -> dict[str, Path]:
    packaged = Path(str(resources.files("sigdb"))) / "models"
    folder = packaged if packaged.is_dir() else Path(__file__).parents[2] / "models"
    return {path.parent.name: path.parent for path in sorted(folder.glob("*/model.json"))}
