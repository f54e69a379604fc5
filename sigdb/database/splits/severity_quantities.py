"""Quantities of the severity of damage: which ones cases have, their values, and how readers see them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sigdb.core import BoolArray, unit_of
from sigdb.database.database import Database
from sigdb.database.splits.names import QUANTITIES
from sigdb.transmission import ACTING, SIZES, ToothDamage

_PLANE = QUANTITIES[:2]
"""Sizes that span a plane of severities where there are no others: then 0 is a value of both."""

_COUNT = QUANTITIES[2]

_THIN = ("flank_deviation", "wear_depth")
"""Lengths that are shown in micrometres; others are in millimetres."""


@dataclass(frozen=True, kw_only=True)
class ShownQuantity:
    """A quantity of severity for readers.

    Attributes
    ----------
    title
        Its name in words.
    unit
        Unit that it is shown in; empty without one.
    factor
        Number by which values as stored are multiplied.
    least, most
        Ends of what the quantity can be, as stored.
    """

    title: str
    unit: str
    factor: float
    least: float
    most: float

    @property
    def label(self) -> str:
        """Title and unit."""
        return f"{self.title}, {self.unit}" if self.unit else self.title

    def text(self, value: float) -> str:
        """Return a value with its unit, as in ``2.1 mm``."""
        return f"{value * self.factor:.3g}{' ' if self.unit else ''}{self.unit}"


def _shown(name: str) -> ShownQuantity:
    field = ToothDamage.model_fields[name]
    unit = unit_of(field)
    shown, factor = {"m": ("um", 1e6) if name in _THIN else ("mm", 1e3), "-": ("", 1.0)}.get(unit, (unit, 1.0))
    rules = {key: float(getattr(mark, key)) for mark in field.metadata for key in ("ge", "le") if hasattr(mark, key)}
    title = name.removesuffix("_deg").replace("_", " ")
    least, most = rules.get("ge", -np.inf), rules.get("le", np.inf)
    return ShownQuantity(title=title, unit=shown, factor=factor, least=least, most=most)


_OF_TOOTH = tuple(name for size, details in SIZES.items() for name in (size, *details) if name not in _PLANE)

SHOWN_QUANTITIES: Mapping[str, ShownQuantity] = {name: _shown(name) for name in (*_PLANE, *_OF_TOOTH)} | {
    _COUNT: ShownQuantity(title="damaged teeth", unit="", factor=1.0, least=1.0, most=np.inf)
}
"""All quantities that a severity can have, in order: sizes of damage, each with its details, and damaged teeth."""


def severity_quantities(cases: pd.DataFrame) -> tuple[str, ...]:
    """Return the quantities of the severity of cases, the number of damaged teeth last.

    They are the sizes that some damage has, such as the depth of a crack, with those of their details that vary. Damage
    of lost stiffness and shifted phase alone has both, whether or not it has each of them.

    Parameters
    ----------
    cases
        Cases of a database: ``tooth``, the sizes that it stores, and ``pattern`` where there are any. Healthy ones, and
        teeth that differ, do not count.

    Examples
    --------
    >>> severity_quantities(pd.DataFrame({"tooth": [0, 3], "stiffness_loss": [0.0, 0.2]}))
    ('stiffness_loss', 'phase_shift_deg', 'damaged_teeth')
    >>> severity_quantities(pd.DataFrame({"tooth": [0, 3], "stiffness_loss": 0.0, "crack_depth": [0.0, 1e-3]}))
    ('crack_depth', 'damaged_teeth')
    """
    single = (cases["tooth"] > 0).to_numpy()
    if "pattern" in cases:
        single = single & (cases["pattern"].fillna("").to_numpy() == "")
    damage = cases[single]
    sizes = [name for name in SHOWN_QUANTITIES if name in SIZES and name in damage and _acts(damage, name).any()]
    if {*sizes} <= {*_PLANE}:
        sizes = [*_PLANE]
    details = {
        name
        for size in sizes
        for name in SIZES[size]
        if name in damage and damage.loc[_acts(damage, size), name].nunique() > 1
    }
    return tuple(name for name in SHOWN_QUANTITIES if name in sizes or name in details or name == _COUNT)


def database_quantities(database: Database) -> tuple[str, ...]:
    """Return the quantities of the severity of a database, see :func:`severity_quantities`."""
    columns = ", ".join(f'"{name}"' for name in ("tooth", "pattern", *damage_columns(database)))
    return severity_quantities(database.sql(f"select distinct {columns} from features where status = 'ok'"))


def damage_columns(database: Database) -> list[str]:
    """Return the columns of ``features`` with the sizes of damage and their details, as far as a database has them."""
    stored = set(database.dataset("features").schema.names)
    return [name for size, details in SIZES.items() for name in (size, *details) if name in stored]


def severity_levels(cases: pd.DataFrame, quantities: Iterable[str]) -> pd.DataFrame:
    """Return the values of quantities for cases: nan where the damage does not have one, 0 for a healthy gear.

    In a plane of stiffness losses and phase shifts 0 is a value.

    Parameters
    ----------
    cases
        As of :func:`severity_quantities`.
    quantities
        Quantities of the cases, or of others.

    Examples
    --------
    >>> cases = pd.DataFrame({"tooth": [1, 1], "stiffness_loss": [0.2, 0.0], "crack_depth": [0.0, 1e-3]})
    >>> severity_levels(cases, ("stiffness_loss", "crack_depth")).to_numpy().tolist()
    [[0.2, nan], [nan, 0.001]]
    """
    names = list(quantities)
    plane = {*names} & {*SIZES} <= {*_PLANE}
    levels = cases.reindex(columns=names).astype(float)
    for name in names:
        size = name if name in SIZES else next((size for size in SIZES if name in SIZES[size]), None)
        if size is not None and not (plane and name in _PLANE):
            levels[name] = levels[name].where(_acts(cases, size))
    if "tooth" in cases:
        levels.loc[(cases["tooth"] == 0).to_numpy()] = 0.0
    return levels


def has_several_kinds(quantities: Iterable[str]) -> bool:
    """Return whether damage may have some of the quantities and not others.

    Examples
    --------
    >>> has_several_kinds(["stiffness_loss", "phase_shift_deg", "damaged_teeth"])
    False
    >>> has_several_kinds(["stiffness_loss", "crack_depth", "damaged_teeth"])
    True
    """
    sizes = {*quantities} & {*SIZES}
    return len(sizes) > 1 and not sizes <= {*_PLANE}


def _acts(cases: pd.DataFrame, size: str) -> BoolArray:
    """Return whether cases have damage of a size, (cases,)."""
    fields = [cases[name].fillna(0).to_numpy(float) != 0 for name in ACTING[size] if name in cases]
    return np.all(fields, axis=0) if fields else np.zeros(len(cases), bool)
