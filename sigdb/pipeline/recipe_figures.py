"""The figures of a recipe: cases of its database, side by side."""

from collections.abc import Hashable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.database import Database, suffixed
from sigdb.measurement import MeasurementSettings
from sigdb.pipeline.recipe import Recipe
from sigdb.report import Picture
from sigdb.sweep import Plan
from sigdb.transmission import Damage, tooth_stiffness

if TYPE_CHECKING:
    from sigdb.report import Case

_CASE = ["template", "tooth", *MeasurementSettings.model_fields]
"""Columns that identify a case; its specimens and noise draws do not differ in them."""


def draw_figure(recipe: Recipe, plan: Plan, database: Database, picture: Picture, path: Path) -> None:
    """Draw one of a recipe's ``[[report.figures]]`` into a file.

    Raises
    ------
    InputError
        If a condition is no SQL condition, or if it selects no row, several cases, or a row without a result.
    """
    from sigdb.report import ReportSettings, comparison_figure, save_figure

    report: ReportSettings = recipe.sections.report
    sensor = picture.sensor or database.sensors[0]
    figure = comparison_figure(
        [_case(recipe, plan, database, picture, sensor, condition) for condition in picture.rows],
        sensor=sensor,
        unit=database.unit("tsa", sensor),
        panels=picture.panels,
        title=picture.title,
        caption=picture.caption,
        settings=report,
    )
    save_figure(figure, path, report)


def check_figures(recipe: Recipe, plan: Plan) -> None:
    """Refuse figures of sensors that are not stored, before the simulation.

    Raises
    ------
    InputError
        If a sensor is not stored; the message names the figure and the sensor.
    """
    for picture in recipe.sections.report.figures:
        if picture.sensor is not None and picture.sensor not in plan.sensors:
            raise InputError(
                f"{_owner(recipe, picture)}: sensor {picture.sensor!r} is not stored; stored: {', '.join(plan.sensors)}"
            )


def _owner(recipe: Recipe, picture: Picture) -> str:
    return f"{recipe.path}: report.figures: {picture.name}"


def select_row(database: Database, condition: str, owner: str) -> dict[Hashable, Any]:
    """Return the first row of the only case that a condition selects.

    Raises
    ------
    InputError
        If it is no condition, or if it selects no row, several cases, or a row without a result.
    """
    try:
        rows = database.cases(condition)
    except InputError as error:
        raise InputError(f"{owner}: row {condition!r}: {error}") from None
    if rows.empty:
        raise InputError(f"{owner}: row {condition!r} selects nothing of {database.store}; loosen the condition")
    cases = rows.drop_duplicates(_CASE)
    if len(cases) > 1:
        differing = [name for name in _CASE[1:] if cases[name].nunique() > 1] or ["damage or rig"]
        raise InputError(
            f"{owner}: row {condition!r} selects {len(cases)} different cases, which differ in {', '.join(differing)} "
            f"(rows {', '.join(map(str, cases['id'].head(5)))}); narrow it to one"
        )
    row: dict[Hashable, Any] = rows.iloc[0].to_dict()
    if row["status"] != "ok":
        raise InputError(f"{owner}: row {condition!r} selects row {row['id']}, which has no result: {row['status']}")
    return row


def _case(recipe: Recipe, plan: Plan, database: Database, picture: Picture, sensor: str, condition: str) -> "Case":
    from sigdb.report import Case

    row = select_row(database, condition, _owner(recipe, picture))
    template, teeth = int(row["template"]), int(row["teeth"])
    tsa = database.signals([int(row["id"])], sensor=sensor)["tsa"][0]
    damage = plan.case(template).damage
    if damage.tooth:
        damage = damage.model_copy(update={"tooth": int(row["tooth"])})
    stiffness = "stiffness" in picture.panels
    return Case(
        title=_title(damage),
        teeth=teeth,
        tsa=tsa,
        damaged=tuple(damage.on_teeth(teeth)),
        healthy=_healthy(plan, database, template, sensor) if damage.tooth else None,
        stiffness=_stiffness(plan, template, damage, len(tsa)) if stiffness else None,
        healthy_stiffness=_stiffness(plan, template, Damage(), len(tsa)) if stiffness and damage.tooth else None,
    )


def _healthy(plan: Plan, database: Database, template: int, sensor: str) -> FloatArray | None:
    """Return the clean signal of the undamaged gear on the same rig; None where it has no result."""
    healthy = plan.templates_at(plan.case(template).rig_point)[0]
    column = suffixed("tsa", database.sensors, sensor)
    (tsa,) = database.sql(f'select "{column}" as tsa from templates where template = {healthy}')["tsa"]
    return None if tsa is None else np.asarray(tsa)


def _stiffness(plan: Plan, template: int, damage: Damage, n: int) -> FloatArray:
    """Return (n,) stiffness of the damaged gear's mesh over its revolution, N/m."""
    point = plan.rig_points[plan.case(template).rig_point]
    mesh = point.rig.meshes[point.rig.meshes_of(plan.gear)[0]]
    u = np.arange(n) * point.teeth / n
    of_teeth = tooth_stiffness(mesh, point.teeth, u, damage.on_teeth(point.teeth), driving=plan.gear == mesh.driving)
    return np.asarray(of_teeth.sum(axis=0))


def _title(damage: Damage) -> str:
    if not damage.tooth:
        return "undamaged"
    where = (
        f"tooth {damage.tooth}" if damage.damaged_teeth == 1 else f"{damage.damaged_teeth} teeth from {damage.tooth}"
    )
    if damage.pattern:
        return f"{where}: {damage.pattern}"
    settings = [
        f"{name.removesuffix('_deg').replace('_', ' ')} {value:g}{' deg' if name.endswith('_deg') else ''}"
        for name, value in damage.model_dump(exclude={"tooth", "damaged_teeth", "gear", "pattern", "each"}).items()
        if value != type(damage).model_fields[name].default
    ]
    return f"{where}: {', '.join(settings)}"
