"""What the paper shows, as numbers on signals: one function a claim, with its threshold and why it is that.

The definitions say what the paper's words say, and were written down before the rig's answers were looked at. A claim
that does not hold is told as such; neither rig nor threshold is tuned.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from sigdb.paper import measures
from sigdb.paper.signals import LOSSES, SHIFTS, TOOTH, PaperSignals

SEEN_SIGNAL = 0.2
"""A change by a fifth of the signal's rms is seen at a glance."""
SEEN_MODULATION = 0.05, 5.0
"""A modulation by 5 % of the amplitude, or by 5 deg of mesh phase, is seen in its curve."""
SEEN_LINE = 0.1
"""A line a tenth as high as the mesh order's is seen in a spectrum with a linear scale."""
SEEN_DISTRIBUTION = 0.02
"""A tenth of where the pictures' colours saturate, which is a fifth of the greatest value."""
UNBROKEN = 0.1
"""A ridge that stays above a tenth of its level is coloured all along."""
STANDS_OUT = 2.0
"""What stands out somewhere is twice as large there as elsewhere."""
MORE_THAN_BEFORE = 1.5
"""Twice the loss gives about twice the change; more than half as much again is growth."""
MUCH_LARGER = 1.5
"""A much larger amplitude is half as large again at least."""
VANISHES = 0.25
"""Of an amplitude that almost vanishes a quarter is left at most."""


@dataclass(frozen=True, kw_only=True)
class ClaimResult:
    """What a claim comes to on a rig.

    Attributes
    ----------
    value
        The claim's leading number.
    holds
        Whether the claim holds; None where there is nothing to judge it by.
    numbers
        All its numbers by what they are.
    """

    value: float
    holds: bool | None
    numbers: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One thing that the paper shows.

    Attributes
    ----------
    id, figure
        Its id, and the paper's figure.
    kind
        ``check`` where the rig is expected to show it, ``report`` where it is only told what comes out.
    shows
        What the paper shows.
    leading
        What the leading number is.
    rule
        When it holds.
    find
        Its numbers on signals.
    """

    id: str
    figure: str
    kind: Literal["check", "report"]
    shows: str
    leading: str
    rule: str
    find: Callable[[PaperSignals], ClaimResult]


def modulation_rises(s: PaperSignals) -> ClaimResult:
    """P1."""
    amplitude, phase = np.transpose([measures.rises(s.shifts[shift], s.teeth, TOOTH) for shift in SHIFTS])
    seen = amplitude[-1] >= SEEN_MODULATION[0] and phase[-1] >= SEEN_MODULATION[1]
    grows = all(one[0] > 0 and np.all(np.diff(one) > 0) for one in (amplitude, phase))
    numbers = {f"amplitude, {shift} deg": float(a) for shift, a in zip(SHIFTS, amplitude, strict=True)}
    numbers |= {f"phase, {shift} deg [deg]": float(b) for shift, b in zip(SHIFTS, phase, strict=True)}
    numbers |= {
        f"highest amplitude in pass 6, {shift} deg": measures.highest(s.shifts[shift], s.teeth, TOOTH)
        for shift in SHIFTS
    }
    return ClaimResult(value=float(amplitude[-1]), holds=bool(seen and grows), numbers=numbers)


def sidebands_grow(s: PaperSignals) -> ClaimResult:
    """P2."""
    mesh = measures.line(s.healthy, s.teeth)
    sums = [measures.sidebands(tsa, s.teeth) / mesh for tsa in (s.healthy, *s.shifts.values())]
    here, there = (np.abs(np.fft.rfft(tsa)) for tsa in (s.shifts[SHIFTS[-1]], s.elsewhere))
    blind = float(np.abs(here - there)[1:].max() / here[1:].max())
    numbers = {f"sidebands / mesh, {shift} deg": one for shift, one in zip((0.0, *SHIFTS), sums, strict=True)}
    numbers["difference of the spectra at teeth 6 and 9"] = blind
    return ClaimResult(value=sums[-1], holds=bool(np.all(np.diff(sums) > 0) and blind < 1e-3), numbers=numbers)


def _low_orders(s: PaperSignals, orders: tuple[int, ...]) -> tuple[dict[str, float], bool]:
    """Components at low orders in passes 6 and 7 of the greatest shift, and whether all are there."""
    W = measures.distribution(s.shifts[SHIFTS[-1]])
    numbers: dict[str, float] = {}
    there = True
    for order in orders:
        here, elsewhere = measures.component(W, order, s.teeth, (TOOTH, TOOTH + 1))
        numbers |= {f"order {order}, passes 6 and 7": here, f"order {order}, elsewhere": elsewhere}
        there &= here >= max(SEEN_DISTRIBUTION, STANDS_OUT * elsewhere)
    return numbers, there


def mesh_order_and_low_orders(s: PaperSignals) -> ClaimResult:
    """P3, orders 8 and 4."""
    unbroken = measures.continuity(measures.distribution(s.shifts[SHIFTS[-1]]), s.teeth)
    numbers, there = _low_orders(s, (8, 4))
    value = min(one for name, one in numbers.items() if name.endswith("7"))
    return ClaimResult(
        value=value, holds=bool(there and unbroken >= UNBROKEN), numbers={"least of the ridge": unbroken} | numbers
    )


def order_one(s: PaperSignals) -> ClaimResult:
    """P3, order 1."""
    numbers, there = _low_orders(s, (1,))
    return ClaimResult(value=numbers["order 1, passes 6 and 7"], holds=bool(there), numbers=numbers)


def marked_change(s: PaperSignals) -> ClaimResult:
    """P4."""
    found = {loss: measures.changes(s.losses[loss], s.healthy, s.teeth) for loss in LOSSES}
    at = [float(found[loss][TOOTH - 1]) for loss in LOSSES]
    before = [float(found[loss][TOOTH - 2]) for loss in LOSSES]
    begins = all(one >= STANDS_OUT * other for one, other in zip(at, before, strict=True))
    numbers = {f"pass 6, loss {loss:g}": one for loss, one in zip(LOSSES, at, strict=True)}
    numbers |= {f"pass 5, loss {loss:g}": one for loss, one in zip(LOSSES, before, strict=True)}
    return ClaimResult(value=at[-1], holds=bool(at[1] > at[0] >= SEEN_SIGNAL and begins), numbers=numbers)


def _relative_amplitudes(s: PaperSignals) -> np.ndarray:
    return measures.amplitudes(s.losses[0.5], s.teeth) / measures.amplitudes(s.healthy, s.teeth)


def pass_seven_largest(s: PaperSignals) -> ClaimResult:
    """P5, pass 7."""
    relative = _relative_amplitudes(s)
    numbers = {
        "greatest pass": float(relative.argmax() + 1),
        "pass 6": float(relative[5]),
        "pass 7": float(relative[6]),
    }
    holds = relative.argmax() == 6 and relative[6] >= MUCH_LARGER
    return ClaimResult(value=float(relative[6]), holds=bool(holds), numbers=numbers)


def vanishing_and_reduced(s: PaperSignals) -> ClaimResult:
    """P5, the rest."""
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


def _cross(W: np.ndarray, teeth: int) -> dict[str, float]:
    """The arms of a cross at the damaged tooth's pass, relative to the ridge, and to their median over the passes."""
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
    """P6."""
    mesh = measures.line(s.healthy, s.teeth)
    below = [measures.below_mesh(s.losses[loss], s.teeth) / mesh for loss in LOSSES]
    numbers = {f"below mesh order, loss {loss:g}": one for loss, one in zip(LOSSES, below, strict=True)}
    numbers |= _cross(measures.distribution(s.losses[0.5]), s.teeth)
    higher = below[1] >= max(SEEN_LINE, MORE_THAN_BEFORE * below[0])
    holds = higher and _is_cross(numbers) and numbers["least of the ridge"] >= UNBROKEN
    return ClaimResult(value=numbers["arms in pass 6 / median"], holds=bool(holds), numbers=numbers)


def single_pitted_tooth(s: PaperSignals) -> ClaimResult:
    """P7."""
    numbers = {
        "sidebands / mesh": measures.sidebands(s.pitted, s.teeth) / measures.line(s.pitted, s.teeth),
        "below mesh order": measures.below_mesh(s.pitted, s.teeth) / measures.line(s.pitted, s.teeth),
        "change in pass 6": float(measures.changes(s.pitted, s.healthy, s.teeth)[TOOTH - 1]),
    } | _cross(measures.distribution(s.pitted), s.teeth)
    return ClaimResult(value=numbers["sidebands / mesh"], holds=None, numbers=numbers)


def large_cross(s: PaperSignals) -> ClaimResult:
    """P8."""
    numbers = _cross(measures.distribution(s.broken), s.teeth)
    pitted = _cross(measures.distribution(s.pitted), s.teeth)["arms in pass 6"]
    holds = _is_cross(numbers) and numbers["arms in pass 6"] >= STANDS_OUT * pitted
    return ClaimResult(
        value=numbers["arms in pass 6 / median"],
        holds=bool(holds),
        numbers=numbers | {"arms in pass 6, single pitted tooth": pitted},
    )


def no_order_fourteen(s: PaperSignals) -> ClaimResult:
    """P9."""
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


CLAIMS = (
    Claim(
        id="P1",
        figure="5",
        kind="check",
        shows="A phase shift of 1.5, 3, 4.5 deg at tooth 6 lets amplitude and phase rise at the 6th tooth pass, more "
        "with more shift.",
        leading="rise of the amplitude at 4.5 deg",
        rule="The greatest departures of amplitude and phase modulation from their medians in pass 6 are upwards, grow "
        "with the shift, and reach 0.05 and 5 deg of mesh phase at 4.5 deg.",
        find=modulation_rises,
    ),
    Claim(
        id="P2",
        figure="5",
        kind="check",
        shows="Sidebands grow with the shift, and the spectrum alone cannot tell when.",
        leading="sum of sidebands / mesh line at 4.5 deg",
        rule="The sum of the five pairs of sidebands grows from 0 to 4.5 deg, and the amplitude spectra with the "
        "damage at tooth 6 and at tooth 9 differ by less than 1e-3 of the highest line.",
        find=sidebands_grow,
    ),
    Claim(
        id="P3",
        figure="5",
        kind="check",
        shows="The distribution has the mesh order all around, and components at orders 8 and 4 in passes 6 and 7.",
        leading="lesser of orders 8 and 4 in passes 6 and 7 / ridge",
        rule="At 4.5 deg the ridge stays above 0.1 of its median, and at both orders the mean over passes 6 and 7 is "
        "at least 0.02 of the ridge and twice the mean magnitude elsewhere.",
        find=mesh_order_and_low_orders,
    ),
    Claim(
        id="P3, order 1",
        figure="5",
        kind="report",
        shows="There is a component at order 1, too, in passes 6 and 7.",
        leading="order 1 in passes 6 and 7 / ridge",
        rule="As orders 8 and 4.",
        find=order_one,
    ),
    Claim(
        id="P4",
        figure="6",
        kind="check",
        shows="A loss of 25 or 50 % at tooth 6 makes a marked change at the 6th tooth pass.",
        leading="change in pass 6 at 50 %",
        rule="The change's rms in pass 6 is at least 0.2 of the healthy rms at 25 %, more at 50 %, and twice that in "
        "pass 5.",
        find=marked_change,
    ),
    Claim(
        id="P5",
        figure="6",
        kind="check",
        shows="At 50 % the 7th tooth pass has a much larger amplitude.",
        leading="amplitude of pass 7 / healthy",
        rule="Pass 7 is the largest of all, and at least 1.5 times the healthy one.",
        find=pass_seven_largest,
    ),
    Claim(
        id="P5, the rest",
        figure="6",
        kind="report",
        shows="At 50 % the amplitude about 180 deg almost vanishes, and the 8th and 9th pass are reduced.",
        leading="least amplitude within 15 deg of 180 deg / healthy",
        rule="A stretch of a pass centred within 15 deg of 180 deg has at most 0.25 of the healthy amplitude, and "
        "passes 8 and 9 have less than the healthy one.",
        find=vanishing_and_reduced,
    ),
    Claim(
        id="P6",
        figure="6",
        kind="check",
        shows="At 50 % components below the mesh order are much higher; the distribution has a cross at the mesh order "
        "and the 6th tooth pass, and the mesh order all around.",
        leading="arms of the cross in pass 6 / median",
        rule="The orders below the mesh have 0.1 of its line and 1.5 times as much as at 25 %; the distribution beside "
        "the ridge in pass 6 is at least 0.02 of the ridge and twice its median; the ridge stays above 0.1.",
        find=cross_of_the_loss,
    ),
    Claim(
        id="P7",
        figure="8A, 9A",
        kind="report",
        shows="A single heavily pitted tooth with friction gives a spectrum and a distribution like those measured at "
        "12 h.",
        leading="sum of sidebands / mesh line",
        rule="The measured signal is not at hand: nothing to judge by.",
        find=single_pitted_tooth,
    ),
    Claim(
        id="P8",
        figure="8B, 9B",
        kind="report",
        shows="A broken tooth between two pitted ones gives a large cross at the 6th tooth pass, as measured at "
        "17.8 h.",
        leading="arms of the cross in pass 6 / median",
        rule="As the cross of P6, and its arms are twice those of the single pitted tooth.",
        find=large_cross,
    ),
    Claim(
        id="P9",
        figure="7B",
        kind="report",
        shows="The measured signal has order 14 and a small modulation in passes 4 and 5, which the model has not.",
        leading="order 14 / greater neighbour",
        rule="In the case of Figure 8B order 14 does not rise above both its neighbours, and the change in passes 4 "
        "and 5 is below 0.2 of the healthy rms.",
        find=no_order_fourteen,
    ),
)
"""What can be judged from signals; P10, on effort and accuracy, is in :mod:`sigdb.paper.sensitivity`."""
