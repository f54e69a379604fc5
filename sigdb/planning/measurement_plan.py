"""A plan: the smallest damage by sensor, operating point and number of averages."""

from dataclasses import dataclass
from typing import Any

import pandas as pd

from sigdb.core import Note, plain
from sigdb.planning.settings import PlanSettings


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasurementPlan:
    """The smallest damage that each measurement would show.

    Attributes
    ----------
    rig, gear
        Names of the rig and of the damaged gear, which is averaged.
    unit
        Unit of the sizes.
    settings
        The settings.
    table
        A row for each measurement, the smallest a90 first. ``sensor``, ``direction``, ``speed_rpm``, ``torque`` and
        ``averages`` describe it; ``seconds`` is the time of that many revolutions. ``noise`` is the standard deviation
        of one revolution, in ``signal_unit``, and ``noise_from`` is ``stated`` or ``assumed``. ``a90`` is the smallest
        size that is found with probability 0.9, ``a90_low`` and ``a90_high`` are those with less and more noise, by its
        doubt. ``largest`` is the largest size with a law, which an a90 of nan exceeds.
    notes
        Notes.
    """

    rig: str
    gear: str
    unit: str
    settings: PlanSettings
    table: pd.DataFrame
    notes: tuple[Note, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return the plan as plain values for JSON."""
        facts = {
            "rig": self.rig,
            "gear": self.gear,
            "unit": self.unit,
            "settings": self.settings.model_dump(mode="json"),
            "table": self.table.to_dict("records"),
            "notes": self.notes,
        }
        return {name: plain(value) for name, value in facts.items()}

    @property
    def sentences(self) -> list[str]:
        """Meaning of the sizes, the best measurement, and the notes."""
        settings, best = self.settings, self.table.iloc[0]
        where = "at any tooth" if settings.tooth == "unknown" else "at a known tooth"
        damage = f"{settings.kind} of {settings.damaged_teeth} teeth" if settings.damaged_teeth > 1 else settings.kind
        sentences = [
            f"a90 is the smallest {damage} of gear {self.gear}, {where}, that the likelihood ratio finds with "
            f"probability 0.9, at a probability of {settings.false_alarm_rate:g} of a false alarm."
        ]
        if best["a90"] == best["a90"]:
            sentences.append(
                f"The best of these measurements is {best['sensor']} at {best['speed_rpm']:.5g} rpm and "
                f"{best['torque']:.4g} N m with {best['averages']} revolutions: a90 = {best['a90']:.3g}"
                f"{'' if self.unit == '-' else ' ' + self.unit}."
            )
        else:
            sentences.append("None of these measurements shows the largest size; average more, or another sensor.")
        return sentences + [note.text for note in self.notes]
