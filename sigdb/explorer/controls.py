"""The sliders of a page: name, unit, help, range and value of each setting that the rig allows."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sigdb.core import SigdbError, unit_of, validated
from sigdb.dynamics import check_in_one_mesh
from sigdb.explorer.live import LiveRig
from sigdb.explorer.view import MOST_TEETH, View, settings_in
from sigdb.transmission import FLAWS, SIZES, Damage, ToothDamage, damaged_profile


@dataclass(frozen=True, kw_only=True)
class Control:
    """One slider with its number field.

    Attributes
    ----------
    name, label, unit, help
        Setting of a :class:`View`, its words, unit and description.
    group
        Heading that it stands under.
    low, high, step, value
        Range, step and first value of the slider, in the unit. A number field takes more.
    scale
        Units of the setting in one unit of the slider: 1e-6 for micrometres.
    default
        Value at which the setting is left out of an address.
    """

    name: str
    label: str
    unit: str
    help: str
    group: str
    low: float
    high: float
    step: float
    value: float
    scale: float = 1.0
    default: float | None = None


_FRICTION_HIGH, _LENGTH_HIGH = 0.2, 5e-3
"""Greatest friction coefficient and greatest length of a flaw (m) of a slider."""
_TRIED = 1e-4
"""Length of a flaw (m) that a mesh is tried with."""


def controls_of(live: LiveRig) -> list[Control]:
    """Return the controls of a rig, in the order of the page."""
    rig, teeth = live.rig, live.teeth
    speed, torque = rig.operating.speed_rpm, rig.operating.torque
    controls = []
    if _can_be_damaged(live):
        controls += [
            _of_damage("tooth", 0, teeth, 1, 6 if teeth > 6 else 1),
            _of_damage("damaged_teeth", 1, min(teeth, 6), 1, 1),
            _of_damage("stiffness_loss", 0, 0.9, 0.01, 0.5),
            _of_damage("phase_shift_deg", -180 / teeth, 180 / teeth, 0.05, 0),
            _of_damage("loss_extent", 0, 1, 0.01, 1),
            _of_damage("friction", 0, _FRICTION_HIGH, 0.005, 0),
            *_flaws(live),
        ]
    described = View.model_fields
    for name, label, group, low, high, step, value, scale in (
        ("speed_rpm", "speed", "Operating point", 0.5 * speed, 1.5 * speed, speed / 200, speed, 1.0),
        ("torque", "torque", "Operating point", 0.1 * torque, 2 * torque, torque / 100, torque, 1.0),
        ("teeth", "tooth count", "Operating point", max(5, teeth - 6), min(teeth + 6, MOST_TEETH), 1, teeth, 1.0),
        ("snr_db", "signal-to-noise ratio", "Measurement", -30, 40, 1, 0, 1.0),
        ("averages", "averages", "Measurement", 1, 400, 1, 102, 1.0),
        ("index_error", "index errors", "Measurement", 0, 10, 0.1, 0, 1e-6),
        ("specimen", "specimen", "Measurement", 0, 99, 1, 0, 1.0),
    ):
        if low >= high:  # a gear with more teeth than a page takes keeps them
            continue
        field = described[name]
        unit = {1e-6: "µm"}.get(scale, unit_of(field))
        controls.append(
            Control(
                name=name, label=label, unit=unit, help=str(field.description), group=group, low=float(low),
                high=float(high), step=float(step), value=float(value), scale=scale,
                default=None if name == "snr_db" else value * scale,
            )
        )  # fmt: skip
    return controls


def first_view(controls: Sequence[Control]) -> dict[str, Any]:
    """Return the settings of the first view of a page: the values of its controls that are not left out."""
    values = {each.name: each.value * each.scale for each in controls if each.default is not None}
    return settings_in({each.name: values[each.name] for each in controls if values.get(each.name) != each.default})


def _of_damage(name: str, low: float, high: float, step: float, value: float, scale: float = 1.0) -> Control:
    field = Damage.model_fields[name]
    unit = unit_of(field)
    return Control(
        name=name,
        label=name.removesuffix("_deg").replace("_", " "),
        unit="mm" if scale != 1 else unit,
        help=str(field.description),
        group="Damage",
        low=low,
        high=high,
        step=step,
        value=value,
        scale=scale,
        default=field.default,
    )


def _flaws(live: LiveRig) -> list[Control]:
    """Return controls of the flaws of a tooth's geometry that the mesh's profile knows."""
    rig = live.rig
    mesh = rig.meshes[rig.meshes_of(live.gear)[0]]
    controls = []
    for size in FLAWS:
        try:
            damage = validated(ToothDamage, {size: _TRIED}, owner=size)
            damaged_profile(mesh.profile, damage, live.teeth, driving=mesh.driving == live.gear)
        except SigdbError:
            continue
        controls.append(_of_damage(size, 0, 1e3 * _LENGTH_HIGH, 0.01, 0, scale=1e-3))
    return controls


def _can_be_damaged(live: LiveRig) -> bool:
    try:
        check_in_one_mesh(live.rig, live.gear)
    except SigdbError:
        return False
    return bool(SIZES)
