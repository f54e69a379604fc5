"""Check the docstrings of all public names, and of the public methods of their classes, by numpydoc's rules.

Usage: python tests/checks/numpydoc_names.py [PACKAGE ...]

Prints ``name: code: message`` for each offence, and ends with 1 if there is any.
"""

import dataclasses
import importlib
import inspect
import pkgutil
import re
import sys
from collections.abc import Iterator

from numpydoc.docscrape import NumpyDocString, get_doc_object
from numpydoc.validate import validate
from pydantic import BaseModel

import sigdb

IGNORED = {
    "GL01": "summaries begin on the line of the quotes",
    "GL08": "the architecture's tests see that every public name has a docstring",
    "ES01": "not every function needs more than its summary",
    "EX01": "not every function needs an example",
    "SA01": "pages of the reference group what belongs together",
    "YD01": "a generator's Returns says what it yields",
    "RT02": "a description of the result may stand alone",
    "PR04": "types stand in the signature, and in the docstring where they say more, such as a shape",
    "PR08": "descriptions begin with code or with a symbol too",
    "RT04": "as PR08",
    "PR09": "phrases need no period",
    "RT05": "as PR09",
    "RT03": "as PR08",
}
"""Codes of numpydoc that do not count, each with the reason."""

IGNORED_OF_METHODS = {
    "PR01": "one sentence may say what a method takes",
    "RT01": "one sentence may say what a method returns",
}
"""Codes that do not count for methods, either."""


def main() -> int:
    """Run the check."""
    offences = [offence for package in sys.argv[1:] or packages() for offence in check(package)]
    print(*offences, sep="\n")
    return 1 if offences else 0


def packages() -> list[str]:
    """The package and its direct sub-packages."""
    return ["sigdb", *(f"sigdb.{module.name}" for module in pkgutil.iter_modules(sigdb.__path__) if module.ispkg)]


def check(package: str) -> Iterator[str]:
    """Offences of the public names of a package."""
    loaded = importlib.import_module(package)
    for public in sorted(getattr(loaded, "__all__", ())):
        value = getattr(loaded, public)
        if inspect.ismodule(value) or not (inspect.isclass(value) or inspect.isfunction(value)):
            continue
        if package == "sigdb" and value.__module__.startswith("sigdb."):
            continue  # checked with its own package
        yield from _wrong(package, public, value)
        if inspect.isclass(value):
            for name, member in vars(value).items():
                if not name.startswith("_") and inspect.isfunction(member):
                    yield from _wrong(package, f"{public}.{name}", member)


def _wrong(package: str, public: str, value: object) -> Iterator[str]:
    is_method = "." in public
    for code, message in validate(get_doc_object(value))["errors"]:
        ignored = IGNORED if not is_method else IGNORED | IGNORED_OF_METHODS
        if code not in ignored and not (code == "PR01" and _documented_otherwise(value, message)):
            yield f"{package}.{public}: {code}: {message}"


def _documented_otherwise(value: object, message: str) -> bool:
    """Whether parameters of a class stand with its attributes, or with the fields of a section, or there are none."""
    if not inspect.isclass(value):
        return False
    if issubclass(value, BaseModel | Exception) or getattr(value, "_is_protocol", False):
        return True
    if not dataclasses.is_dataclass(value):
        return False
    documented = NumpyDocString(inspect.getdoc(value) or "")["Attributes"]
    names = {name.strip() for entry in documented for name in entry.name.split(",")}
    return set(re.findall(r"'(\w+)'", message)) <= names


if __name__ == "__main__":
    sys.exit(main())
