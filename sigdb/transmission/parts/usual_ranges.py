"""Usual ranges of the numbers of a rig: a number outside one is likely given in another unit."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

_MILLI, _GRAM_MM = ((1e-3, "mm"),), ((1e-6, "g mm"),)
_INERTIA = ((1e-6, "kg mm^2"), (1e-9, "g mm^2"))
_STIFF, _DEGREES = ((1e3, "N/mm"), (1e6, "N/um")), ((180 / np.pi, "rad"),)


@dataclass(frozen=True, kw_only=True)
class UsualRange:
    """The range in which numbers of a kind usually are, by their size; zero stands for none and is always usual.

    Attributes
    ----------
    fields
        Fields of a rig, without the names of parts: ``gears.bore`` is the bore of any gear.
    unit
        Unit of the fields.
    least, greatest
        Ends of the range.
    slips
        Factors to the field's unit from units that are often taken for it, and the names of these.
    """

    fields: tuple[str, ...]
    unit: str
    least: float
    greatest: float
    slips: tuple[tuple[float, str], ...] = ()

    def remark(self, path: str, value: float) -> str | None:
        """Return a sentence on a number that is outside the range, None on any other."""
        if not value or self.least <= abs(value) <= self.greatest:
            return None
        unit = "" if self.unit == "-" else f" {self.unit}"
        meant = [(factor * value, slip) for factor, slip in self.slips]
        likely = next((f"; did you mean {v:.6g}{unit} ({value:g} {slip})?" for v, slip in meant if self.holds(v)), "")
        return f"{path} = {value:g}{unit} is outside the usual {self.least:g} to {self.greatest:g}{unit}{likely}"

    def holds(self, value: float) -> bool:
        """Whether a number is within the range."""
        return self.least <= abs(value) <= self.greatest


USUAL_RANGES: tuple[UsualRange, ...] = (
    UsualRange(fields=("materials.density",), unit="kg/m^3", least=800, greatest=23000, slips=((1e3, "g/cm^3"),)),
    UsualRange(fields=("materials.young_modulus",), unit="Pa", least=5e8, greatest=1.2e12,
               slips=((1e9, "GPa"), (1e6, "MPa"))),
    UsualRange(fields=("materials.shear_modulus",), unit="Pa", least=1e8, greatest=5e11,
               slips=((1e9, "GPa"), (1e6, "MPa"))),
    UsualRange(fields=("shafts.segments.length",), unit="m", least=1e-3, greatest=10, slips=_MILLI),
    UsualRange(
        fields=("shafts.segments.outer_diameter", "shafts.segments.inner_diameter", "disks.outer_diameter",
                "disks.inner_diameter", "disks.width", "gears.body_length", "gears.bore", "meshes.face_width",
                "meshes.centre_distance", "bearings.rolling.pitch_diameter"),
        unit="m", least=1e-3, greatest=4, slips=_MILLI,
    ),
    UsualRange(fields=("bearings.rolling.rolling_diameter",), unit="m", least=5e-4, greatest=0.3, slips=_MILLI),
    UsualRange(fields=("meshes.module",), unit="m", least=2e-4, greatest=0.06, slips=_MILLI),
    UsualRange(fields=("meshes.backlash", "meshes.profile_error.amplitude", "gears.runout"), unit="m", least=1e-8,
               greatest=3e-3, slips=(*_MILLI, (1e-6, "um"))),
    UsualRange(fields=("gears.teeth",), unit="-", least=6, greatest=400),
    UsualRange(fields=("gears.mass", "disks.mass"), unit="kg", least=1e-3, greatest=1e5, slips=((1e-3, "g"),)),
    UsualRange(fields=("casing.modes.modal_mass",), unit="kg", least=1e-4, greatest=1e6),
    UsualRange(fields=("gears.polar_inertia", "gears.diametral_inertia", "disks.polar_inertia",
                       "disks.diametral_inertia"), unit="kg m^2", least=1e-8, greatest=1e5, slips=_INERTIA),
    UsualRange(fields=("couplings.inertia",), unit="kg m^2", least=1e-8, greatest=2e3, slips=_INERTIA),
    UsualRange(fields=("gears.unbalance", "disks.unbalance"), unit="kg m", least=1e-9, greatest=0.1, slips=_GRAM_MM),
    UsualRange(fields=("meshes.stiffness", "meshes.profile.pair_stiffnesses"), unit="N/m", least=5e5, greatest=5e10,
               slips=_STIFF),
    UsualRange(fields=("meshes.profile.line_load",), unit="N/m", least=1e3, greatest=5e6, slips=((1e3, "N/mm"),)),
    UsualRange(fields=("bearings.stiffness", "couplings.lateral_stiffness"), unit="N/m", least=1e3, greatest=2e12,
               slips=_STIFF),
    UsualRange(fields=("bearings.damping", "meshes.damping"), unit="N s/m", least=1e-2, greatest=1e7),
    UsualRange(fields=("bearings.tilt_stiffness", "couplings.stiffness"), unit="N m/rad", least=0.1, greatest=1e10),
    UsualRange(fields=("couplings.damping",), unit="N m s/rad", least=1e-5, greatest=1e6),
    UsualRange(fields=("damping_ratio", "casing.modes.damping_ratio"), unit="-", least=1e-4, greatest=0.3,
               slips=((1e-2, "%"),)),
    UsualRange(fields=("casing.modes.frequency_hz",), unit="Hz", least=0.5, greatest=5e4),
    UsualRange(fields=("operating.speed_rpm",), unit="rpm", least=0.5, greatest=2e5),
    UsualRange(fields=("operating.torque",), unit="N m", least=1e-3, greatest=2e4, slips=((1e-3, "N mm"),)),
    UsualRange(fields=("operating.load_fluctuation",), unit="-", least=1e-5, greatest=0.5, slips=((1e-2, "%"),)),
    UsualRange(fields=("operating.load_order",), unit="1/rev", least=1, greatest=200),
    UsualRange(fields=("meshes.pressure_angle_deg",), unit="deg", least=12, greatest=32, slips=_DEGREES),
    UsualRange(fields=("meshes.helix_angle_deg", "bearings.rolling.contact_angle_deg"), unit="deg", least=1.6,
               greatest=60, slips=_DEGREES),
    UsualRange(fields=("bearings.rolling.rolling_elements",), unit="-", least=3, greatest=300),
    UsualRange(fields=("meshes.profile.contact_ratio",), unit="pass", least=1, greatest=5),
    UsualRange(fields=("meshes.profile.flank",), unit="pass", least=5e-3, greatest=1),
    UsualRange(fields=("meshes.profile.addendum", "meshes.profile.dedendum"), unit="-", least=0.3, greatest=2.5),
    UsualRange(fields=("meshes.profile.profile_shift",), unit="-", least=1e-4, greatest=1.5),
    UsualRange(fields=("shafts.segments.elements",), unit="-", least=1, greatest=100),
)  # fmt: skip
"""The usual range of each kind of field; fields that no row names, such as nodes and directions, have none."""

_BY_FIELD = {field: usual for usual in USUAL_RANGES for field in usual.fields}
_NAMED = ("gears", "disks", "shafts", "bearings", "couplings", "meshes", "sensors", "materials")
_GYRATION = UsualRange(fields=(), unit="m", least=2e-3, greatest=3)


def unusual_numbers(rig: Mapping[str, object]) -> list[str]:
    """Return a sentence on each number of a rig, as a rig file has it, that is outside the range of its kind.

    Examples
    --------
    >>> unusual_numbers({"meshes": {"main": {"module": 3.175}}})
    ['meshes.main.module = 3.175 m is outside the usual 0.0002 to 0.06 m; did you mean 0.003175 m (3.175 mm)?']
    """
    remarks = []
    for path, value in _numbers(rig, ()):
        words = [word for place, word in enumerate(path) if not (place == 1 and path[0] in _NAMED)]
        usual = _BY_FIELD.get(".".join(word for word in words if not word.isdigit()))
        if usual is not None and (remark := usual.remark(".".join(path), value)):
            remarks.append(remark)
    return remarks + list(_unusual_bodies(rig))


def _numbers(here: object, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], float]]:
    if isinstance(here, Mapping):
        for name, value in here.items():
            if name not in ("sources", "assumed"):
                yield from _numbers(value, (*path, str(name)))
    elif isinstance(here, list | tuple):
        for i, value in enumerate(here):
            yield from _numbers(value, (*path, str(i)))
    elif isinstance(here, int | float) and not isinstance(here, bool):
        yield path, float(here)


def _unusual_bodies(rig: Mapping[str, object]) -> Iterator[str]:
    """Sentences on bodies whose inertia does not fit their mass: each of them may be usual for itself."""
    for table in ("gears", "disks"):
        bodies = rig.get(table)
        for name, body in bodies.items() if isinstance(bodies, Mapping) else ():
            mass, inertia = (body.get(field) if isinstance(body, Mapping) else None for field in _MASS)
            if not (isinstance(mass, int | float) and isinstance(inertia, int | float) and mass > 0 and inertia > 0):
                continue
            radius = float(np.sqrt(inertia / mass))
            if not _GYRATION.holds(radius):
                yield (
                    f"{table}.{name}.polar_inertia = {inertia:g} kg m^2 with mass = {mass:g} kg is that of a ring of "
                    f"radius {radius:.3g} m; one of them is likely in another unit"
                )


_MASS = ("mass", "polar_inertia")
