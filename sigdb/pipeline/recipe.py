"""A recipe: a TOML file whose sections are typed objects, each declared by its package."""

import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from pydantic import Field

from sigdb.core import InputError, Problems, Section, read_toml, validated
from sigdb.database import Database
from sigdb.measurement import MeasurementSettings, NuisanceSettings
from sigdb.recognition import RecognitionSettings
from sigdb.report import ReportSettings
from sigdb.signature import SignatureSettings
from sigdb.sweep import Plan, SweepLimits, SweepSettings, make_plan
from sigdb.transmission import Transmission, load_transmission

S = TypeVar("S", bound=Section)


class RecipeSections(Section):
    """The sections of a recipe file."""

    sweep: SweepSettings = Field(description="The simulated cases.")
    measurement: MeasurementSettings = Field(default=MeasurementSettings(), description="Noise and errors.")
    nuisance: NuisanceSettings = Field(
        default=NuisanceSettings(), description="Unknowns of a machine and of its measurement."
    )
    signature: SignatureSettings = Field(default=SignatureSettings(), description="The stored parts of an average.")
    limits: SweepLimits = Field(default=SweepLimits(), description="How much a sweep may plan.")
    recognition: RecognitionSettings = Field(default=RecognitionSettings(), description="Models.")
    report: ReportSettings = Field(default=ReportSettings(), description="Pictures.")


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """A recipe that was read from a file.

    Attributes
    ----------
    path
        The file.
    text
        Its text.
    sections
        Its sections.
    rig
        The rig that it names.
    """

    path: Path
    text: str
    sections: RecipeSections
    rig: Transmission

    def plan(self) -> Plan:
        """Return the plan of its sweep.

        Returns
        -------
        Plan

        Raises
        ------
        InputError
            If the design does not fit the rig.
        """
        try:
            return make_plan(
                self.sections.sweep,
                self.sections.measurement,
                self.sections.signature,
                self.rig,
                limits=self.sections.limits,
                nuisance=self.sections.nuisance,
            )
        except InputError as error:
            raise InputError("\n".join(f"{self.path}: {line}" for line in str(error).splitlines())) from None

    def evaluated_on(self) -> tuple["Recipe", ...]:
        """Return the other recipes on whose databases a run evaluates its models.

        Returns
        -------
        tuple of Recipe

        Raises
        ------
        InputError
            If one cannot be read, or two have the same name.
        """
        owner, paths = f"{self.path}: recognition.evaluate_on", self.sections.recognition.evaluate_on
        try:
            others = tuple(load_recipe(self.path.parent / path) for path in paths)
        except InputError as error:
            raise InputError("\n".join(f"{owner}: {line}" for line in str(error).splitlines())) from None
        for name, count in Counter(other.path.stem for other in others).items():
            if count > 1:
                raise InputError(f"{owner}: two recipes are called {name}; give them names that differ")
        return others


def load_recipe(path: str | Path) -> Recipe:
    """Read a recipe file and the rig that it names.

    Parameters
    ----------
    path : str or path-like
        The recipe file, TOML.

    Returns
    -------
    Recipe

    Raises
    ------
    InputError
        If keys of the file break rules, or its rig does. The message has a line for each: file, key, value and remedy.
    """
    path, problems = Path(path), Problems()
    content = _with_tables(read_toml(path), path.parent)
    for line in _several_measurements(content):
        problems.add(f"{path}: {line}")
    sections = rig = None
    with problems.collect():
        sections = validated(RecipeSections, content, owner=str(path), first=1)
    sweep = content.get("sweep")
    if isinstance(sweep, dict) and isinstance(sweep.get("rig"), str):
        with problems.collect():
            rig = _rig(sweep["rig"], path)
    problems.raise_any()
    assert sections is not None
    assert rig is not None
    return Recipe(path=path, text=path.read_text(encoding="utf-8"), sections=sections, rig=rig)


def _rig(name: str, recipe: Path) -> Transmission:
    """Return the rig that a recipe names; the path of a rig file starts at the recipe's folder."""
    try:
        return load_transmission(recipe.parent / name if name.endswith(".toml") else name)
    except InputError as error:
        raise InputError("\n".join(f"{recipe}: sweep.rig: {line}" for line in str(error).splitlines())) from None


def _several_measurements(content: dict[str, Any]) -> Iterator[str]:
    """Take lists and ranges out of ``[measurement]``, whose fields have one value, and yield a message about each."""
    measurement = content.get("measurement")
    if not isinstance(measurement, dict):
        return
    for name, value in list(measurement.items()):
        if name in MeasurementSettings.model_fields and isinstance(value, dict | list):
            kind = "a range" if isinstance(value, dict) else "a list"
            yield f"measurement.{name} is {kind}, and must be one number; {kind} of {name} goes into [[sweep.grid]]"
            del measurement[name]


def _with_tables(content: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return the content of a recipe with the paths of its tables below its folder."""
    sweep = content.get("sweep")
    grids = sweep.get("grid") if isinstance(sweep, dict) else None
    for grid in grids if isinstance(grids, list) else []:
        if isinstance(grid, dict) and isinstance(grid.get("table"), str):
            grid["table"] = str(folder / grid["table"])
    return content


def recipe_section(database: Database, section: type[S], name: str) -> S:
    """Return a section of the recipe of a database; its defaults where the recipe has no such section."""
    text = database.manifest.recipe
    return validated(section, tomllib.loads(text).get(name, {}), owner=f"{database.store}/sigdb.toml: recipe: {name}")
