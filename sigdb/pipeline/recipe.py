"""A recipe: a TOML file whose sections are typed objects, each owned by its layer."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import Field

from sigdb.core import InputError, Section, read_toml, validated
from sigdb.measurement import MeasurementSettings
from sigdb.recognition import RecognitionSettings
from sigdb.report import ReportSettings
from sigdb.signature import SignatureSettings
from sigdb.sweep import Plan, SweepSettings, make_plan
from sigdb.transmission import Transmission, load_transmission


class RecipeSections(Section):
    """The sections of a recipe file."""

    sweep: SweepSettings = Field(description="Which cases are simulated.")
    measurement: MeasurementSettings = Field(default=MeasurementSettings(), description="What a measurement adds.")
    signature: SignatureSettings = Field(default=SignatureSettings(), description="What is stored of each average.")
    recognition: RecognitionSettings = Field(default=RecognitionSettings(), description="How damage is learnt.")
    report: ReportSettings = Field(default=ReportSettings(), description="How pictures look.")


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """A recipe as read: its text, its sections, its rig."""

    path: Path
    text: str
    sections: RecipeSections
    rig: Transmission

    def plan(self) -> Plan:
        """The plan of its sweep.

        Raises
        ------
        InputError
            If the design does not fit the rig.
        """
        try:
            return make_plan(self.sections.sweep, self.sections.measurement, self.sections.signature, self.rig)
        except InputError as error:
            raise InputError("\n".join(f"{self.path}: {line}" for line in str(error).splitlines())) from None

    def evaluated_on(self) -> tuple["Recipe", ...]:
        """The other recipes on whose databases a run evaluates its models.

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
        names = [other.path.stem for other in others]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"{owner}: two recipes are called {name}; give them names that differ")
        return others


def load_recipe(path: str | Path) -> Recipe:
    """Read a recipe file and the rig that it names.

    Raises
    ------
    InputError
        Names file, key, value and remedy.
    """
    path = Path(path)
    sections = validated(RecipeSections, _with_tables(read_toml(path), path.parent), owner=str(path))
    return Recipe(
        path=path, text=path.read_text(encoding="utf-8"), sections=sections, rig=_rig(sections.sweep.rig, path)
    )


def _rig(name: str, recipe: Path) -> Transmission:
    """The rig that a recipe names; a file is looked for from the recipe's folder."""
    if name.endswith(".toml"):
        return load_transmission(recipe.parent / name)
    try:
        return load_transmission(name)
    except InputError as error:
        raise InputError(f"{recipe}: sweep.rig: {error}") from None


def _with_tables(content: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The content of a recipe with the paths of its tables seen from its folder."""
    sweep = content.get("sweep")
    grids = sweep.get("grid") if isinstance(sweep, dict) else None
    for grid in grids if isinstance(grids, list) else []:
        if isinstance(grid, dict) and isinstance(grid.get("table"), str):
            grid["table"] = str(folder / grid["table"])
    return content
