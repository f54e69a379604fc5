"""The view of a page: a case of damage at an operating point, its specimen, its noise and its sensor."""

from collections.abc import Mapping
from typing import Any

from sigdb.core import InputError, Section, quantity, validated
from sigdb.transmission import Damage, Transmission

_DAMAGE = tuple(name for name in Damage.model_fields if name not in {"pattern", "each"})
MOST_TEETH = 300
"""Tooth count that a view may have at most: it is solved within a minute."""


class View(Section):
    """The settings of a page: what stands in its address.

    A setting that is left out is that of the rig, and the page has no noise.
    """

    damage: Damage = Damage()
    teeth: int | None = quantity(
        "-", "Tooth count of the damaged gear; that of the rig if left out.", ge=5, le=MOST_TEETH, default=None
    )
    speed_rpm: float | None = quantity("rev/min", "Speed of the drive.", gt=0, le=1e6, default=None)
    torque: float | None = quantity("N m", "Torque of the drive.", gt=0, le=1e9, default=None)
    snr_db: float | None = quantity(
        "dB", "Signal-to-noise ratio of one revolution; no noise if left out.", default=None
    )
    averages: int = quantity("rev", "Revolutions in the average.", ge=1, default=102)
    index_error: float = quantity("m", "Standard deviation of the index errors of the teeth.", ge=0, default=0.0)
    specimen: int = quantity("-", "Number of the specimen, which determines its index errors.", ge=0, default=0)
    sensor: str | None = None

    @classmethod
    def of(cls, settings: Mapping[str, Any]) -> "View":
        """Return the view of settings as they stand in an address: fields of the damage and of the view together.

        Raises
        ------
        InputError
            If a setting is unknown or breaks a rule.
        """
        if not isinstance(settings, Mapping):
            raise InputError(f"view = {settings!r} is no table of settings by name")
        damage = {name: value for name, value in settings.items() if name in _DAMAGE and value is not None}
        if not damage.get("tooth"):
            damage = {name: damage[name] for name in ("gear",) if name in damage}
        others = {name: value for name, value in settings.items() if name not in _DAMAGE}
        return validated(cls, others | {"damage": validated(Damage, damage, owner="damage")}, owner="view")

    def changes(self, rig: Transmission, gear: str) -> dict[str, float]:
        """Return the numbers of the rig that the view changes, by dotted path, without the torque."""
        wanted = {f"gears.{gear}.teeth": self.teeth, "operating.speed_rpm": self.speed_rpm}
        return {path: value for path, value in wanted.items() if value is not None and value != rig.value(path)}


def settings_in(address: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of a view among the entries of a page's address; all but words are numbers.

    Raises
    ------
    InputError
        If a setting is no number.

    Examples
    --------
    >>> settings_in({"tooth": "6", "sensor": "pinion-vertical", "tab": "database"})
    {'tooth': 6, 'sensor': 'pinion-vertical'}
    """
    if not isinstance(address, Mapping):
        raise InputError(f"address = {address!r} is no table of settings by name")
    taken = {*_DAMAGE, *View.model_fields} - {"damage"}
    settings: dict[str, Any] = {name: value for name, value in address.items() if name in taken}
    for name in settings.keys() - {"sensor", "gear"}:
        try:
            number = float(settings[name])
        except (TypeError, ValueError):
            raise InputError(f"{name} = {settings[name]!r} is no number") from None
        settings[name] = int(number) if number.is_integer() else number
    return settings
