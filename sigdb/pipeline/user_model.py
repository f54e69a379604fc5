"""An estimator of a user's own, found by the name of its class in a file or module."""

import importlib
import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from sigdb.core import InputError, suggestion

_NAME = re.compile(r"(?P<module>.+\.py|[^\W\d]\w*(?:\.[^\W\d]\w*)*):(?P<name>[^\W\d]\w*)")


def is_user_model(text: str) -> bool:
    """Return whether a text is ``FILE.py:NAME`` or ``MODULE:NAME``, and not the folder of a model.

    Examples
    --------
    >>> is_user_model("my_model.py:Model"), is_user_model("sklearn.dummy:DummyClassifier"), is_user_model("models/a")
    (True, True, False)
    """
    return _NAME.fullmatch(text) is not None and not Path(text).exists()


def load_user_model(text: str) -> Any:
    """Return the estimator that ``FILE.py:NAME`` or ``MODULE:NAME`` names.

    A class, or a function without ``fit``, is called without arguments; an estimator is returned as it is.

    Parameters
    ----------
    text
        The name; a module is looked for in the current folder too.

    Raises
    ------
    InputError
        If file, module or name do not exist, or it cannot be imported or called.
    """
    match = _NAME.fullmatch(text)
    if match is None:
        raise InputError(f"model = {text!r} must be FILE.py:NAME or MODULE:NAME")
    module = _module(match["module"])
    named = getattr(module, match["name"], None)
    if named is None:
        names = [name for name in vars(module) if not name.startswith("_")]
        raise InputError(f"{text}: {match['module']} has no {match['name']}{suggestion(match['name'], names)}")
    if not isinstance(named, type) and hasattr(named, "fit"):
        return named
    if not callable(named):
        raise InputError(
            f"{text} is a {type(named).__name__}; name a class, a function that returns an estimator, or one"
        )
    try:
        return named()
    except Exception as error:  # a user's class may do anything
        raise InputError(
            f"{text}() raised {type(error).__name__}: {error}; give a class that needs no arguments"
        ) from None


def _module(name: str) -> ModuleType:
    """Return a module by its name or by the path of its file."""
    is_file = name.endswith(".py")
    file = Path(name).resolve()
    if is_file and not file.is_file():
        raise InputError(f"{name}: no such file; give the path of a file in Python")
    folder = str(file.parent if is_file else Path.cwd())
    sys.path.insert(0, folder)
    try:
        return _of_file(file) if is_file else importlib.import_module(name)
    except (Exception, SystemExit) as error:
        raise InputError(f"{name}: cannot be imported ({type(error).__name__}: {error})") from None
    finally:
        sys.path.remove(folder)


def _of_file(file: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(file.stem, file)
    if spec is None or spec.loader is None:
        raise ImportError(f"{file} is no module")
    module = importlib.util.module_from_spec(spec)
    sys.modules.setdefault(file.stem, module)  # classes are copied by the name of their module
    spec.loader.exec_module(module)
    return module
