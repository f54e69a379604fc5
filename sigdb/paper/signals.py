"""Clean signals of the paper's cases, simulated on a rig."""

from collections.abc import Mapping
from dataclasses import dataclass

from sigdb.core import FloatArray, InputError
from sigdb.dynamics import PeriodicRig, prepare_periodic
from sigdb.transmission import ToothDamage, Transmission

TEETH, TOOTH, ELSEWHERE = 12, 6, 9
"""Teeth of the pinion, the damaged tooth, and the tooth to which P2 moves the damage."""
SHIFTS, LOSSES = (1.5, 3.0, 4.5), (0.25, 0.5)
FRICTION = 0.08
"""Friction in Figures 8 and 9, assumed: lubricated gear teeth have 0.03 to 0.08, and pitted flanks are rough."""

_PITTED = ToothDamage(stiffness_loss=0.5, loss_extent=0.2, friction=FRICTION)
_BROKEN = ToothDamage(stiffness_loss=0.5, friction=FRICTION)
FIGURE_8A = {6: _PITTED}
FIGURE_8B = {5: _PITTED, 6: _BROKEN, 7: _PITTED}


@dataclass(frozen=True, kw_only=True)
class PaperSignals:
    """Signals of one revolution of the pinion, (n,) each, sample 0 at the tacho mark.

    Attributes
    ----------
    teeth
        Teeth of the pinion.
    healthy
        Signal without damage.
    shifts
        Signals by phase shift of tooth 6, deg.
    elsewhere
        Signal of the greatest shift at another tooth.
    losses
        Signals by stiffness loss of tooth 6.
    pitted
        Figure 8A: tooth 6 pitted, with friction.
    broken
        Figure 8B: tooth 6 broken between two pitted ones, with friction.
    min_compression
        Least compression of the mesh in all cases, as a fraction of the static one. Below 0 the teeth part, and these
        signals, of the linear rig, are wrong.
    """

    teeth: int
    healthy: FloatArray
    shifts: Mapping[float, FloatArray]
    elsewhere: FloatArray
    losses: Mapping[float, FloatArray]
    pitted: FloatArray
    broken: FloatArray
    min_compression: float


def paper_signals(rig: Transmission, *, gear: str, sensor: str) -> PaperSignals:
    """Simulate the paper's cases.

    Raises
    ------
    InputError
        If the gear has not 12 teeth, as the paper's pinion has, or the rig has no such sensor.
    UnstableRigError
        If the rig is unstable.
    """
    check_subject(rig, gear, sensor)
    return signals_of(rig, prepare_periodic(rig, gear=gear), sensor)


def check_subject(rig: Transmission, gear: str, sensor: str) -> None:
    """Refuse a rig to which the paper's claims do not apply.

    Raises
    ------
    InputError
        If the gear has not 12 teeth, or the rig has no such sensor.
    """
    if gear not in rig.gears or rig.gears[gear].teeth != TEETH:
        raise InputError(
            f"the paper's claims are about the {TEETH} teeth of a pinion, and gear {gear!r} of rig {rig.name!r} is no "
            f"gear of {TEETH} teeth; name such a gear, or leave out report.paper"
        )
    if sensor not in rig.sensors:
        raise InputError(f"rig {rig.name!r} has no sensor {sensor!r}; known: {', '.join(rig.sensors)}")


def signals_of(rig: Transmission, prepared: PeriodicRig, sensor: str) -> PaperSignals:
    """Simulate the paper's cases on a prepared rig."""
    row, least = list(rig.sensors).index(sensor), []

    def signal(damage: dict[int, ToothDamage]) -> FloatArray:
        state = prepared.steady_state([damage], specimens=False)[0]
        least.append(float(state.min_compression))
        return state.signals[row]

    for damage in ({}, {TOOTH: ToothDamage(stiffness_loss=max(LOSSES))}):
        prepared.floquet_multiplier([damage])
    return PaperSignals(
        teeth=prepared.teeth,
        healthy=signal({}),
        shifts={shift: signal({TOOTH: ToothDamage(phase_shift_deg=shift)}) for shift in SHIFTS},
        elsewhere=signal({ELSEWHERE: ToothDamage(phase_shift_deg=SHIFTS[-1])}),
        losses={loss: signal({TOOTH: ToothDamage(stiffness_loss=loss)}) for loss in LOSSES},
        pitted=signal(FIGURE_8A),
        broken=signal(FIGURE_8B),
        min_compression=min(least),
    )
