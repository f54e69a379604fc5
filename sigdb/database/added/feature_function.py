"""A user's function of an average, found by its name, and identified by the SHA-256 of its module."""

import hashlib
import importlib
import importlib.util
import inspect
import re
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from sigdb.core import FloatArray, InputError, shown, suggestion

FACTS = ("teeth", "speed_rpm", "torque", "averages", "scatter", "sensor", "unit")
"""Facts of a row that a function gets if a parameter of it has this name. Labels of damage are none of them."""

_LONGEST_NAME, _LONGEST_REASON = 200, 300
"""Characters in the name of a column, and in the reason why a row has no numbers."""

_STARTED = time.time()
"""A module whose source is younger may have been imported before its source was changed."""

_modules: dict[str, tuple[str, ModuleType]] = {}
"""Modules by name, each with the SHA-256 of the source that it was made of."""


class NoNumbersError(Exception):
    """A function that returns no numbers for an average; the text says why."""


@dataclass(frozen=True, kw_only=True)
class FeatureFunction:
    """A function of an average to named numbers.

    Attributes
    ----------
    module, name
        Module and function.
    sha256
        SHA-256 of the module's source file.
    folder
        Folder that its module may be imported from, besides Python's path.
    """

    module: str
    name: str
    sha256: str
    folder: str

    @classmethod
    def of(cls, function: str | Callable[..., Any]) -> "FeatureFunction":
        """Return a function by its name ``module:function``, or by itself.

        Raises
        ------
        InputError
            If there is no such module or function, the module has no source file, or the function cannot be imported
            by another process.
        """
        module, name = _names(function)
        folder = str(Path.cwd())
        with importable(folder):
            sha256 = hashlib.sha256(_source(module).read_bytes()).hexdigest()
            names = cls(module=module, name=name, sha256=sha256, folder=folder)
            names.load()
        return names

    def __str__(self) -> str:
        return f"{self.module}:{self.name}"

    def load(self) -> "LoadedFunction":
        """Import the module and return the function.

        Raises
        ------
        InputError
            If the module cannot be imported or has changed, it has no such function, or a parameter is not known.
        """
        with importable(self.folder):
            now = hashlib.sha256(_source(self.module).read_bytes()).hexdigest()
            if now != self.sha256:
                raise InputError(f"{self}: the module {self.module} is not the one whose SHA-256 is {self.sha256}")
            module = _imported(self.module, now)
        function = getattr(module, self.name, None)
        if function is None:
            raise InputError(f"{self}: module {self.module} has no {self.name}{_functions_of(module, self.name)}")
        if not callable(function):
            raise InputError(f"{self}: {self.name} is a {type(function).__name__}; give a function")
        return LoadedFunction(self, function)


class LoadedFunction:
    """A function that is imported, with the facts that it takes.

    Parameters
    ----------
    names
        Its names.
    function
        Itself.
    """

    def __init__(self, names: FeatureFunction, function: Callable[..., Any]) -> None:
        self._function = function
        self.facts = _facts(names, function)

    @property
    def help(self) -> str:
        """First line of its docstring; empty without one."""
        return (inspect.getdoc(self._function) or "").partition("\n")[0].strip()

    def numbers(self, tsa: FloatArray, facts: Mapping[str, Any]) -> dict[str, float]:
        """Return the numbers of an average by name; nan where there is none.

        Parameters
        ----------
        tsa
            (n,) average.
        facts
            Facts of the row, with at least those that the function takes.

        Raises
        ------
        NoNumbersError
            If the function fails, or returns no mapping of names to numbers.
        """
        try:
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("ignore")
                result = self._function(np.array(tsa, dtype=float), **{name: facts[name] for name in self.facts})
        except (Exception, SystemExit) as error:
            text = " ".join(str(error).split())
            raise NoNumbersError(
                _shortened(f"{type(error).__name__}: {text}" if text else type(error).__name__)
            ) from None
        if not (hasattr(result, "keys") and hasattr(result, "__getitem__")):
            raise NoNumbersError(f"returned {_kind(result)}, not names with numbers such as {{'crest': 3.2}}")
        numbers: dict[str, float] = {}
        for key in result.keys():  # noqa: SIM118  # a pandas Series iterates over values
            numbers[_checked_name(key)] = _number(key, result[key])
        if not numbers:
            raise NoNumbersError("returned no numbers")
        return numbers


@contextmanager
def importable(folder: str) -> Iterator[None]:
    """Let modules be imported from a folder, too."""
    if folder in sys.path:
        yield
        return
    sys.path.insert(0, folder)
    try:
        yield
    finally:
        if folder in sys.path:
            sys.path.remove(folder)


def _names(function: str | Callable[..., Any]) -> tuple[str, str]:
    """Return the module and the name of a function."""
    if isinstance(function, str):
        match = re.fullmatch(r"([^\W\d]\w*(?:\.[^\W\d]\w*)*):([^\W\d]\w*)", function)
        if not match:
            raise InputError(f"function = {shown(function)} is no name of a function; give MODULE:FUNCTION")
        return match[1], match[2]
    module, name = getattr(function, "__module__", None), getattr(function, "__qualname__", "")
    if not callable(function) or not isinstance(module, str) or not str(name).isidentifier():
        raise InputError(
            f"function = {shown(function)} has no name in a module; write it with def in a module, or give "
            "'MODULE:FUNCTION'"
        )
    if module == "__main__":
        raise InputError(
            f"function {name} is of the script or notebook that runs; write it into a module of its own, so that other "
            "processes can import it and its columns can be computed again"
        )
    return module, str(name)


def _source(module: str) -> Path:
    """Return the source file of a module, which is not imported; packages around it are."""
    importlib.invalidate_caches()
    try:
        spec = importlib.util.find_spec(module)
    except Exception as error:  # a package around it may do anything when it is imported
        raise InputError(f"{module}: cannot be imported ({_shortened(f'{type(error).__name__}: {error}')})") from None
    if spec is None:
        raise InputError(
            f"{module}: no such module in {Path.cwd()} or on Python's path; go to its folder, or set PYTHONPATH"
        )
    if spec.origin is None or not spec.origin.endswith(".py"):
        raise InputError(
            f"{module}: has no source file, by which a change could be recognised; give a module in Python"
        )
    return Path(spec.origin)


def _imported(name: str, sha256: str) -> ModuleType:
    """Return a module as its source is now; if it has changed since it was imported, as a new one."""
    then, module = _modules.get(name, ("", None))
    if module is not None and then == sha256:
        return module
    source = _source(name)
    stale = name in sys.modules and (module is not None or source.stat().st_mtime > _STARTED)
    try:
        spec = importlib.util.spec_from_file_location(name, source) if stale else None
        if spec is not None and spec.loader is not None:
            module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
        else:
            module = importlib.import_module(name)
    except (Exception, SystemExit) as error:
        raise InputError(f"{name}: cannot be imported ({_shortened(f'{type(error).__name__}: {error}')})") from None
    _modules[name] = sha256, module
    return module


def _functions_of(module: ModuleType, name: str) -> str:
    members = vars(module)
    return suggestion(name, [member for member in members if inspect.isfunction(members[member])])


def _facts(names: FeatureFunction, function: Callable[..., Any]) -> tuple[str, ...]:
    """Return the facts that a function takes, besides its average."""
    try:
        parameters = list(inspect.signature(function).parameters.values())
    except (TypeError, ValueError):
        return ()
    positional = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    if not parameters or parameters[0].kind not in (*positional, inspect.Parameter.VAR_POSITIONAL):
        raise InputError(f"{names}: its first parameter must take an average, an array of samples")
    facts = []
    for parameter in parameters[1:]:
        if parameter.name in FACTS and parameter.kind != inspect.Parameter.POSITIONAL_ONLY:
            facts.append(parameter.name)
        elif parameter.default is parameter.empty and parameter.kind not in (
            inspect.Parameter.VAR_POSITIONAL,
            inspect.Parameter.VAR_KEYWORD,
        ):
            raise InputError(
                f"{names}: parameter {parameter.name!r} is none of {', '.join(FACTS)}; rename it, or give it a default"
            )
    return tuple(facts)


def _checked_name(key: object) -> str:
    if not isinstance(key, str) or not key.strip():
        raise NoNumbersError(f"returned the name {shown(key)}; names must be text")
    if key != key.strip() or '"' in key or not key.isprintable() or len(key) > _LONGEST_NAME:
        raise NoNumbersError(
            f"returned the name {shown(key)}; a name has at most {_LONGEST_NAME} printable characters, no double "
            "quote, and no space at its ends"
        )
    return key


def _number(key: str, value: object) -> float:
    """Return a number; nan for None."""
    if value is None:
        return float("nan")
    try:
        array = np.asarray(value)
        if array.size == 1 and array.dtype.kind in "biuf":
            number = float(array.reshape(()).item()) if not np.ma.is_masked(value) else float("nan")
        else:
            raise NoNumbersError(f"returned {_kind(value)} for {key!r}, not a number")
    except (TypeError, ValueError, OverflowError):
        raise NoNumbersError(f"returned {_kind(value)} for {key!r}, not a number") from None
    if np.isinf(number):
        raise NoNumbersError(f"returned {number:g} for {key!r}, not a finite number")
    return number


def _kind(value: object) -> str:
    array = f" of shape {value.shape} and type {value.dtype}" if isinstance(value, np.ndarray) else ""
    return f"{shown(value)} (a {type(value).__name__}{array})"


def _shortened(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= _LONGEST_REASON else f"{text[: _LONGEST_REASON - 3]}..."
