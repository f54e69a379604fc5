"""Averages to choose from: the laws of each sensor's average at an operating point, without damage and with it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.database import QUANTITIES, Template
from sigdb.dynamics import SteadyState, prepare_periodic
from sigdb.planning.settings import PlanSettings
from sigdb.recognition import Hypotheses
from sigdb.transmission import Damage, Transmission, as_damage

LEVELS = 24
"""Sizes of damage that are simulated, by equal ratios."""

_LEAST = 1 / 250
"""Smallest of them over the largest."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CandidateAverages:
    """Laws of the averages of all sensors at one operating point.

    Attributes
    ----------
    sizes
        (levels,) sizes of the damage, rising, for which the meshes keep contact.
    by_sensor
        Hypotheses of each sensor: the undamaged gear, then each size.
    opens
        Whether the next greater size opens a mesh; it has no law then.
    """

    sizes: FloatArray
    by_sensor: Mapping[str, Hypotheses]
    opens: bool

    @classmethod
    def of(cls, rig: Transmission, gear: str, settings: PlanSettings) -> Self:
        """The laws of a rig's averages at its operating point.

        Parameters
        ----------
        rig
            The rig at an operating point, with one mesh.
        gear
            The damaged gear, which is averaged.
        settings
            Damage and samples.

        Raises
        ------
        InputError
            If the rig has no steady state there, the undamaged mesh opens, or no size keeps contact.
        """
        teeth = rig.gears[gear].teeth
        largest = settings.largest_size(teeth)
        if largest is None:
            raise InputError(
                f"largest is missing: {settings.kind} has no usual largest size; give it in {settings.unit}"
            )
        sizes = largest * np.geomspace(_LEAST, 1.0, LEVELS)
        damages = [
            as_damage({"gear": gear, "tooth": 1, "damaged_teeth": settings.damaged_teeth, settings.kind: float(size)})
            for size in sizes
        ]
        prepared = prepare_periodic(rig, gear=gear, samples_per_tooth=settings.samples_per_tooth)
        states = prepared.steady_state([{}, *(damage.on_teeth(teeth) for damage in damages)])
        bad = [states.failures[i] is not None or bool(states.contact_loss[i]) for i in range(len(states))]
        count = bad.index(True) if True in bad else len(states)
        at = f"at {rig.operating.speed_rpm:g} rpm and {rig.operating.torque:g} N m"
        if count < 2:
            size = "" if count == 0 else f" with {settings.kind} = {sizes[0]:.3g}"
            cause = states.failures[count] or "a mesh loses contact, where the law of an average does not hold"
            raise InputError(f"rig {rig.name} has no law {at}{size}: {cause}; change the speed or raise the torque")
        cases = [Damage(), *damages][:count]
        mate = rig.gears[rig.mate(gear)].teeth
        return cls(
            sizes=sizes[: count - 1],
            by_sensor={
                sensor: Hypotheses.from_templates(
                    [_template(states, i, place, damage, teeth) for i, damage in enumerate(cases)],
                    teeth=teeth,
                    mate_teeth=mate,
                )
                for place, sensor in enumerate(rig.sensors)
            },
            opens=count < len(states),
        )


def _template(states: SteadyState, i: int, place: int, damage: Damage, teeth: int) -> Template:
    """Return the template of one case and sensor."""
    case = {name: getattr(damage, name) for name in ("tooth", *QUANTITIES)}
    return Template(
        case={"template": i, "teeth": teeth, **case},
        orders=np.array(states.orders, float),
        reference_variance=states.signals[0, place : place + 1].var(axis=1),
        signals=states.signals[i, place : place + 1],
        specimen_response=states.specimen_response[i, place : place + 1],
        harmonic_response=states.harmonic_response[i, place : place + 1],
    )
