"""Results of the paper's claims on signals: one function for each claim, with its threshold and the reason for it.

The definitions follow the paper's words, and were written down before the rig's answers were known. A claim that does
not hold is reported as such; neither rig nor threshold is tuned.
"""

from dataclasses import dataclass, field

import numpy as np

from sigdb.core import FloatArray
from sigdb.paper import measures
from sigdb.paper.signals import LOSSES, SHIFTS, TOOTH, PaperSignals

SEEN_SIGNAL = 0.2
"""Change that is seen at a glance, relative to the signal's rms."""
SEEN_MODULATION = 0.05, 5.0
"""Modulations that are seen in their curves: of the amplitude, relative, and of the mesh phase, deg."""
SEEN_LINE = 0.1
"""Line that is seen in a spectrum with a linear scale, relative to the mesh order's."""
SEEN_DISTRIBUTION = 0.02
"""Visible value of a distribution, relative to its greatest: a tenth of the value that saturates the colours."""
UNBROKEN = 0.1
"""Least value of a ridge without gaps, relative to its level."""
STANDS_OUT = 2.0
"""Ratio of a value that stands out to the values elsewhere."""
MORE_THAN_BEFORE = 1.5
"""Ratio that counts as growth when the loss doubles: about twice is expected."""
MUCH_LARGER = 1.5
"""Ratio of a much larger amplitude."""
VANISHES = 0.25
"""Largest ratio of an amplitude that almost vanishes."""


@dataclass(frozen=True, kw_only=True)
class ClaimResult:
    """The result of a claim on a rig.

    Attributes
    ----------
    value
        The leading number of the claim.
    holds
        Whether the claim holds; None where it cannot be decided.
    numbers
        All numbers of the claim by name.
    """

    value: float
    holds: bool | None
    numbers: dict[str, float] = field(default_factory=dict)


def modulation_rises(s: PaperSignals) -> ClaimResult:
    """Return P1: amplitude and phase modulation rise in pass 6 and grow with the shift."""
    amplitude, phase = np.transpose([measures.rises(s.shifts[shift], s.teeth, TOOTH) for shift in SHIFTS])
    seen = amplitude[-1] >= SEEN_MODULATION[0] and phase[-1] >= SEEN_MODULATION[1]
    grows = all(values[0] > 0 and np.all(np.diff(values) > 0) for values in (amplitude, phase))
    numbers = {f"amplitude, {shift} deg": float(a) for shift, a in zip(SHIFTS, amplitude, strict=True)}
    numbers |= {f"phase, {shift} deg [deg]": float(b) for shift, b in zip(SHIFTS, phase, strict=True)}
    numbers |= {
        f"highest amplitude in pass 6, {shift} deg": measures.highest(s.shifts[shift], s.teeth, TOOTH)
        for shift in SHIFTS
    }
    return ClaimResult(value=float(amplitude[-1]), holds=bool(seen and grows), numbers=numbers)


def sidebands_grow(s: PaperSignals) -> ClaimResult:
    """Return P2: sidebands grow with the shift, and the spectrum does not show where the damage is."""
    mesh = measures.line(s.healthy, s.teeth)
    sums = [measures.sidebands(tsa, s.teeth) / mesh for tsa in (s.healthy, *s.shifts.values())]
    here, there = (np.abs(np.fft.rfft(tsa)) for tsa in (s.shifts[SHIFTS[-1]], s.elsewhere))
    blind = float(np.abs(here - there)[1:].max() / here[1:].max())
    numbers = {f"sidebands / mesh, {shift} deg": ratio for shift, ratio in zip((0.0, *SHIFTS), sums, strict=True)}
    numbers["difference of the spectra at teeth 6 and 9"] = blind
    return ClaimResult(value=sums[-1], holds=bool(np.all(np.diff(sums) > 0) and blind < 1e-3), numbers=numbers)


def _low_orders(s: PaperSignals, orders: tuple[int, ...]) -> tuple[dict[str, float], bool]:
    """Return components at low orders in passes 6 and 7 of the greatest shift, and whether all are present."""
    W = measures.distribution(s.shifts[SHIFTS[-1]])
    numbers: dict[str, float] = {}
    there = True
    for order in orders:
        here, elsewhere = measures.component(W, order, s.teeth, (TOOTH, TOOTH + 1))
        numbers |= {f"order {order}, passes 6 and 7": here, f"order {order}, elsewhere": elsewhere}
        there &= here >= max(SEEN_DISTRIBUTION, STANDS_OUT * elsewhere)
    return numbers, there


def mesh_order_and_low_orders(s: PaperSignals) -> ClaimResult:
    """Return P3 for orders 8 and 4."""
    unbroken = measures.continuity(measures.distribution(s.shifts[SHIFTS[-1]]), s.teeth)
    numbers, there = _low_orders(s, (8, 4))
    value = min(numbers[f"order {order}, passes 6 and 7"] for order in (8, 4))
    return ClaimResult(
        value=value, holds=bool(there and unbroken >= UNBROKEN), numbers={"least of the ridge": unbroken} | numbers
    )


def order_one(s: PaperSignals) -> ClaimResult:
    """Return P3 for order 1."""
    numbers, there = _low_orders(s, (1,))
    return ClaimResult(value=numbers["order 1, passes 6 and 7"], holds=bool(there), numbers=numbers)


def marked_change(s: PaperSignals) -> ClaimResult:
    """Return P4: a loss changes the signal markedly at the 6th tooth pass."""
    changes = {loss: measures.changes(s.losses[loss], s.healthy, s.teeth) for loss in LOSSES}
    at = [float(changes[loss][TOOTH - 1]) for loss in LOSSES]
    before = [float(changes[loss][TOOTH - 2]) for loss in LOSSES]
    begins = all(there >= STANDS_OUT * earlier for there, earlier in zip(at, before, strict=True))
    numbers = {f"pass 6, loss {loss:g}": change for loss, change in zip(LOSSES, at, strict=True)}
    numbers |= {f"pass 5, loss {loss:g}": change for loss, change in zip(LOSSES, before, strict=True)}
    return ClaimResult(value=at[-1], holds=bool(at[1] > at[0] >= SEEN_SIGNAL and begins), numbers=numbers)


def _relative_amplitudes(s: PaperSignals) -> FloatArray:
    return measures.amplitudes(s.losses[0.5], s.teeth) / measures.amplitudes(s.healthy, s.teeth)


def pass_seven_largest(s: PaperSignals) -> ClaimResult:
    """Return P5 for pass 7: at 50 % loss it is the largest."""
    relative = _relative_amplitudes(s)
    numbers = {
        "greatest pass": float(relative.argmax() + 1),
        "pass 6": float(relative[5]),
        "pass 7": float(relative[6]),
    }
    holds = relative.argmax() == 6 and relative[6] >= MUCH_LARGER
    return ClaimResult(value=float(relative[6]), holds=bool(holds), numbers=numbers)


def vanishing_and_reduced(s: PaperSignals) -> ClaimResult:
    """Return the rest of P5: an amplitude almost vanishes near 180 deg, and passes 8 and 9 are reduced."""
    relative = _relative_amplitudes(s)
    healthy = float(np.ptp(s.healthy) / 2)
    about, angle = measures.least_amplitude(s.losses[0.5], s.teeth, 180, 180 / s.teeth)
    wide, wide_angle = measures.least_amplitude(s.losses[0.5], s.teeth, 180, 360 / s.teeth)
    numbers = {
        "least amplitude within 15 deg of 180 deg": about / healthy,
        "its angle [deg]": angle,
        "least amplitude within 30 deg of 180 deg": wide / healthy,
        "its angle, too [deg]": wide_angle,
        "pass 8": float(relative[7]),
        "pass 9": float(relative[8]),
    }
    holds = about / healthy <= VANISHES and relative[7] < 1 and relative[8] < 1
    return ClaimResult(value=about / healthy, holds=bool(holds), numbers=numbers)


def _cross(W: FloatArray, teeth: int) -> dict[str, float]:
    """Return the arms of a cross at the damaged tooth's pass, relative to the ridge and to the median of all passes."""
    arms = measures.arms(W, teeth)
    return {
        "arms in pass 6": float(arms[TOOTH - 1]),
        "arms in pass 6 / median": float(arms[TOOTH - 1] / np.median(arms)),
        "pass with the greatest arms": float(arms.argmax() + 1),
        "least of the ridge": measures.continuity(W, teeth),
    }


def _is_cross(numbers: dict[str, float]) -> bool:
    return numbers["arms in pass 6"] >= SEEN_DISTRIBUTION and numbers["arms in pass 6 / median"] >= STANDS_OUT


def cross_of_the_loss(s: PaperSignals) -> ClaimResult:
    """Return P6: at 50 % loss low orders are higher, and the distribution has a cross in pass 6."""
    mesh = measures.line(s.healthy, s.teeth)
    below = [measures.below_mesh(s.losses[loss], s.teeth) / mesh for loss in LOSSES]
    numbers = {f"below mesh order, loss {loss:g}": ratio for loss, ratio in zip(LOSSES, below, strict=True)}
    numbers |= _cross(measures.distribution(s.losses[0.5]), s.teeth)
    higher = below[1] >= max(SEEN_LINE, MORE_THAN_BEFORE * below[0])
    holds = higher and _is_cross(numbers) and numbers["least of the ridge"] >= UNBROKEN
    return ClaimResult(value=numbers["arms in pass 6 / median"], holds=bool(holds), numbers=numbers)


def single_pitted_tooth(s: PaperSignals) -> ClaimResult:
    """Return P7: the numbers of a single pitted tooth, which the paper gives no means to check."""
    numbers = {
        "sidebands / mesh": measures.sidebands(s.pitted, s.teeth) / measures.line(s.pitted, s.teeth),
        "below mesh order": measures.below_mesh(s.pitted, s.teeth) / measures.line(s.pitted, s.teeth),
        "change in pass 6": float(measures.changes(s.pitted, s.healthy, s.teeth)[TOOTH - 1]),
    } | _cross(measures.distribution(s.pitted), s.teeth)
    return ClaimResult(value=numbers["sidebands / mesh"], holds=None, numbers=numbers)


def large_cross(s: PaperSignals) -> ClaimResult:
    """Return P8: a broken tooth between two pitted ones gives a large cross in pass 6."""
    numbers = _cross(measures.distribution(s.broken), s.teeth)
    pitted = _cross(measures.distribution(s.pitted), s.teeth)["arms in pass 6"]
    holds = _is_cross(numbers) and numbers["arms in pass 6"] >= STANDS_OUT * pitted
    return ClaimResult(
        value=numbers["arms in pass 6 / median"],
        holds=bool(holds),
        numbers=numbers | {"arms in pass 6, single pitted tooth": pitted},
    )


def no_order_fourteen(s: PaperSignals) -> ClaimResult:
    """Return P9: the model has neither order 14 nor a modulation in passes 4 and 5."""
    lines = {order: measures.line(s.broken, order) for order in (13, 14, 15)}
    alone = lines[14] / max(lines[13], lines[15])
    change = measures.changes(s.broken, s.healthy, s.teeth)
    numbers = {
        "order 14 / greater neighbour": alone,
        "change in pass 4": float(change[3]),
        "change in pass 5": float(change[4]),
    }
    holds = alone <= 1 and max(change[3], change[4]) < SEEN_SIGNAL
    return ClaimResult(value=alone, holds=bool(holds), numbers=numbers)
