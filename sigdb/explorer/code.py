"""A view as Python, as a recipe and as a command."""

import shlex
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import tomli_w

from sigdb.core import InputError
from sigdb.explorer.live import SEED, LiveRig
from sigdb.explorer.view import View
from sigdb.transmission import ToothDamage


def python_code(live: LiveRig, view: View, source: str) -> str:
    """Return a program that computes the average of a view as ``average``.

    Parameters
    ----------
    live : LiveRig
        The rig.
    view : View
        The view.
    source : str
        Name or file of the rig.

    Returns
    -------
    str
    """
    rig, (sensor, _) = live.built(view), live.sensor(view)
    changes: dict[str, float] = view.changes(live.rig, live.gear)
    if view.torque is not None and view.torque != live.rig.operating.torque:
        changes["operating.torque"] = view.torque
    damage = {"gear": live.gear, **_stated(view)} if view.damage.tooth else {"gear": live.gear}
    fields = ", ".join(f"{name}={value!r}" for name, value in damage.items())
    replaced = f".replace({changes!r})" if changes else ""
    lines = ["import sigdb", "", f"rig = sigdb.load_transmission({source!r}){replaced}"]
    errors = ""
    if view.index_error:
        teeth, mate = rig.gears[live.gear].teeth, rig.gears[rig.mate(live.gear)].teeth
        lines[0:1] = [
            "import sigdb",
            "from sigdb.core import specimen_stream",
            "from sigdb.measurement import index_errors",
        ]
        lines.append(
            f"errors = {view.index_error!r} * index_errors(specimen_stream({SEED}, {view.specimen}), {teeth}, {mate})"
        )
        errors = ", index_errors=errors"
    lines += [
        f"response = sigdb.simulate(rig, sigdb.Damage({fields}){errors})",
        f"average = response.signal({sensor!r})",
    ]
    if view.snr_db is not None:
        lines.insert(0, "import numpy as np")
        lines += [
            f"nominal = sigdb.simulate(rig, sigdb.Damage(gear={live.gear!r})).signal({sensor!r})",
            f"deviation = nominal.std() * 10 ** (-{view.snr_db!r} / 20) / {view.averages} ** 0.5",
            f"average = average + deviation * np.random.default_rng({SEED}).standard_normal(len(average))",
        ]
    return "\n".join(lines) + "\n"


def command_code(settings: Mapping[str, Any], source: str) -> str:
    """Return the command that opens the explorer with a view."""
    kept = {name: value for name, value in settings.items() if value is not None}
    return shlex.join(["sigdb", "explore", source, *(["--view", urlencode(kept)] if kept else [])])


def recipe_code(live: LiveRig, view: View, source: str, ranges: Mapping[str, Sequence[float]] | None = None) -> str:
    """Return a recipe, TOML text, whose database holds the case of a view, or a grid of ranges about it.

    Parameters
    ----------
    live : LiveRig
        The rig.
    view : View
        The view.
    source : str
        Name or file of the rig.
    ranges : mapping, optional
        Values of settings of the view, by name; those of the view for the others.

    Returns
    -------
    str

    Raises
    ------
    InputError
        If a range is of a setting that no grid has, or is no list of numbers.
    """
    ranges = dict(ranges or {})
    grid: dict[str, Any] = {
        "tooth": [max(view.damage.tooth, 1)],
        **{k: [v] for k, v in _stated(view).items() if k != "tooth"},
    }
    rig_keys = {
        "teeth": f"gears.{live.gear}.teeth", "speed_rpm": "operating.speed_rpm", "torque": "operating.torque",
    }  # fmt: skip
    for name, key in rig_keys.items():
        value = getattr(view, name)
        if value is not None:
            grid[key] = [value]
    measured = {"averages": view.averages, "index_error": view.index_error}
    if view.snr_db is not None:
        measured["snr_db"] = view.snr_db
    for name, values in ranges.items():
        if (
            name in rig_keys
            or name in ToothDamage.model_fields
            or name in ("tooth", "damaged_teeth", *measured, "snr_db")
        ):
            if not isinstance(values, Sequence) or not values or not all(_is_number(value) for value in values):
                raise InputError(f"range {name} = {values!r}: give a list of finite numbers")
            whole = name in ("tooth", "damaged_teeth", "teeth", "averages", "pits")
            grid[rig_keys.get(name, name)] = [round(value) if whole else float(value) for value in values]
        else:
            raise InputError(f"{name} is not an axis of a recipe; choose damage, speed, torque, tooth count or noise")
    content = {
        "sweep": {"rig": source, "gear": live.gear, "seed": SEED, "specimens": view.specimen + 1, "grid": [grid]},
        "measurement": {name: value for name, value in measured.items() if name not in ranges},
        "signature": {"sensors": [live.sensor(view)[0]]},
    }
    return tomli_w.dumps(content)


def recipe_cost(text: str, folder: Path) -> dict[str, float]:
    """Return the size of a recipe: ``rows``, ``templates``, ``bytes`` and ``seconds`` with all cores.

    Parameters
    ----------
    text : str
        The recipe.
    folder : pathlib.Path
        Folder that paths in it start at.

    Raises
    ------
    InputError
        If the recipe breaks a rule; the message says which.
    """
    from sigdb.pipeline import load_recipe  # takes long to import, as does sweep, and most pages make no recipe
    from sigdb.sweep import estimate

    with tempfile.TemporaryDirectory(dir=folder if folder.is_dir() else None) as place:
        file = Path(place) / "recipe.toml"
        file.write_text(text, encoding="utf-8")
        try:
            plan = load_recipe(file).plan()
        except InputError as error:
            raise InputError(str(error).replace(f"{file}: ", "")) from None
    cost = estimate(plan)
    return {"rows": plan.rows, "templates": plan.n_templates, "bytes": float(cost.bytes), "seconds": cost.seconds}


def _stated(view: View) -> dict[str, Any]:
    """Return the fields of the damage that differ from their defaults, with the tooth."""
    return view.damage.model_dump(exclude_defaults=True, exclude={"gear", "pattern", "each"})


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300
