"""Margins of the paper's rules on a rig: continuous numbers that are at most 0 where a rule holds.

Each claim of :mod:`sigdb.paper.claims` holds where all its margins are at most 0. Rules about the shifts of 1.5 and
4.5 deg and the loss of 50 % are targets of the identification; the others are held out.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sigdb.core import FloatArray
from sigdb.paper import claim_results as rules
from sigdb.paper import measures
from sigdb.paper.signals import LOSSES, SHIFTS, TOOTH, PaperSignals
from sigdb.transmission import ToothDamage

TARGET_SHIFTS, TARGET_LOSS = (SHIFTS[0], SHIFTS[-1]), LOSSES[-1]
"""Shifts and loss that the identification may use."""
TARGET_CASES: tuple[dict[int, ToothDamage], ...] = (
    {},
    *({TOOTH: ToothDamage(phase_shift_deg=shift)} for shift in TARGET_SHIFTS),
    {TOOTH: ToothDamage(stiffness_loss=TARGET_LOSS)},
)
"""The cases of the targets: healthy, both shifts, and the loss."""
HELD_OUT = ("P1, 3 deg", "P2, 3 deg", "P4, 25 %", "P6, 25 %", "P8", "P9")
"""Claims, or parts of claims, that the identification must not use."""


@dataclass(frozen=True, kw_only=True)
class Margin:
    """How far a rule is from its threshold.

    Attributes
    ----------
    claim
        Id of the claim; a part that is held out has the case in its id too.
    rule
        The quantity.
    value
        At most 0 where the rule holds: the distance from the threshold as a fraction of it, or that of two numbers
        which should be in some order as a fraction of the greater.
    """

    claim: str
    rule: str
    value: float


def target_margins(s: PaperSignals) -> list[Margin]:
    """Return the margins of the rules that the identification may use; only its cases are read."""
    return [
        Margin(claim=claim, rule=rule, value=float(value))
        for part in (_modulation, _sidebands, _shifted, _changed, _passes, _crossed)
        for claim, rule, value in part(s)
    ]


def pass_margins(s: PaperSignals) -> list[Margin]:
    """Return the margins of P5 alone, which read the healthy case and the loss of 50 %."""
    return [Margin(claim=claim, rule=rule, value=float(value)) for claim, rule, value in _passes(s)]


def held_out_margins(s: PaperSignals) -> list[Margin]:
    """Return the margins of the rules that are held out."""
    return [
        Margin(claim=claim, rule=rule, value=float(value))
        for part in (_between, _less_loss, _broken)
        for claim, rule, value in part(s)
    ]


def worst(margins: list[Margin]) -> dict[str, float]:
    """Return the greatest margin of each claim."""
    by_claim: dict[str, float] = {}
    for margin in margins:
        by_claim[margin.claim] = max(margin.value, by_claim.get(margin.claim, -np.inf))
    return by_claim


Rules = Iterator[tuple[str, str, float]]


def _at_least(value: float, threshold: float) -> float:
    return (threshold - value) / threshold


def _at_most(value: float, threshold: float) -> float:
    return (value - threshold) / threshold


def _less(greater: float, lesser: float) -> float:
    """Return the margin of two numbers that should be in this order, from -2 to 2."""
    return (lesser - greater) / max(abs(greater), abs(lesser), np.finfo(float).tiny)


def _departures(tsa: FloatArray, teeth: int) -> list[tuple[float, float]]:
    """Return the greatest departures up and down in pass 6, of amplitude and of phase in degrees of mesh phase."""
    return [measures.departures(values, teeth, TOOTH) for values in measures.modulations(tsa, teeth)]


def _modulation(s: PaperSignals) -> Rules:
    first, last = (_departures(s.shifts[shift], s.teeth) for shift in TARGET_SHIFTS)
    for name, seen, before, after in zip(("amplitude", "phase"), rules.SEEN_MODULATION, first, last, strict=True):
        for shift, (up, down) in zip(TARGET_SHIFTS, (before, after), strict=True):
            yield "P1", f"{name} departs upwards at {shift:g} deg", _less(up, down)
        yield "P1", f"rise of the {name} at {TARGET_SHIFTS[-1]:g} deg", _at_least(after[0], seen)
        yield "P1", f"rise of the {name} grows", _less(after[0], before[0])


def _sidebands(s: PaperSignals) -> Rules:
    signals = (s.healthy, *(s.shifts[shift] for shift in TARGET_SHIFTS))
    sums = [measures.sidebands(tsa, s.teeth) / measures.line(s.healthy, s.teeth) for tsa in signals]
    for before, after in pairwise(sums):
        yield "P2", "sidebands grow", _at_least(after, before) if before > 0 else -1.0


def _shifted(s: PaperSignals) -> Rules:
    W = measures.distribution(s.shifts[TARGET_SHIFTS[-1]])
    yield "P3", "least of the ridge", _at_least(measures.continuity(W, s.teeth), rules.UNBROKEN)
    for order in (8, 4, 1):
        claim = "P3" if order > 1 else "P3, order 1"
        here, elsewhere = measures.component(W, order, s.teeth, (TOOTH, TOOTH + 1))
        yield claim, f"order {order}, passes 6 and 7", _at_least(here, rules.SEEN_DISTRIBUTION)
        yield claim, f"order {order} stands out", _less(here, rules.STANDS_OUT * elsewhere)


def _changed(s: PaperSignals) -> Rules:
    change = measures.changes(s.losses[TARGET_LOSS], s.healthy, s.teeth)
    yield "P4", "change in pass 6", _at_least(change[TOOTH - 1], rules.SEEN_SIGNAL)
    yield "P4", "begins in pass 6", _at_most(rules.STANDS_OUT * change[TOOTH - 2], change[TOOTH - 1])


def _passes(s: PaperSignals) -> Rules:
    tsa = s.losses[TARGET_LOSS]
    relative = measures.amplitudes(tsa, s.teeth) / measures.amplitudes(s.healthy, s.teeth)
    yield "P5", "pass 7", _at_least(relative[TOOTH], rules.MUCH_LARGER)
    yield "P5", "pass 7 is the largest", _at_most(float(np.delete(relative, TOOTH).max()), relative[TOOTH])
    about, _ = measures.least_amplitude(tsa, s.teeth, 180, 180 / s.teeth)
    yield "P5, the rest", "amplitude near 180 deg", _at_most(float(2 * about / np.ptp(s.healthy)), rules.VANISHES)
    for number in (8, 9):
        yield "P5, the rest", f"pass {number}", _at_most(relative[number - 1], 1.0)


def _crossed(s: PaperSignals) -> Rules:
    below = measures.below_mesh(s.losses[TARGET_LOSS], s.teeth) / measures.line(s.healthy, s.teeth)
    W = measures.distribution(s.losses[TARGET_LOSS])
    yield "P6", "below the mesh order", _at_least(below, rules.SEEN_LINE)
    yield "P6", "least of the ridge", _at_least(measures.continuity(W, s.teeth), rules.UNBROKEN)
    yield from (("P6", rule, value) for rule, value in _cross(measures.arms(W, s.teeth)))


def _cross(arms: FloatArray) -> Iterator[tuple[str, float]]:
    yield "arms in pass 6", _at_least(arms[TOOTH - 1], rules.SEEN_DISTRIBUTION)
    yield "arms in pass 6 / median", _at_least(arms[TOOTH - 1] / np.median(arms), rules.STANDS_OUT)


def _between(s: PaperSignals) -> Rules:
    rises = np.transpose([measures.rises(s.shifts[shift], s.teeth, TOOTH) for shift in SHIFTS])
    for name, seen, (first, middle, last) in zip(("amplitude", "phase"), rules.SEEN_MODULATION, rises, strict=True):
        yield "P1, 3 deg", f"rise of the {name} between the others'", max(first - middle, middle - last, -middle) / seen
    sums = [measures.sidebands(s.shifts[shift], s.teeth) for shift in SHIFTS]
    yield "P2, 3 deg", "sidebands between the others'", max(_at_least(sums[1], sums[0]), _at_most(sums[1], sums[2]))


def _less_loss(s: PaperSignals) -> Rules:
    less, more = (measures.changes(s.losses[loss], s.healthy, s.teeth) for loss in LOSSES)
    yield "P4, 25 %", "change in pass 6", _at_least(less[TOOTH - 1], rules.SEEN_SIGNAL)
    yield "P4, 25 %", "begins in pass 6", _at_most(rules.STANDS_OUT * less[TOOTH - 2], less[TOOTH - 1])
    yield "P4, 25 %", "less than at 50 %", _at_most(less[TOOTH - 1], more[TOOTH - 1])
    half, full = (measures.below_mesh(s.losses[loss], s.teeth) for loss in LOSSES)
    yield "P6, 25 %", "below the mesh order, 50 % to 25 %", _at_least(full / half, rules.MORE_THAN_BEFORE)


def _broken(s: PaperSignals) -> Rules:
    arms, pitted = (measures.arms(measures.distribution(tsa), s.teeth) for tsa in (s.broken, s.pitted))
    yield from (("P8", rule, value) for rule, value in _cross(arms))
    yield "P8", "arms, three teeth to one", _at_least(arms[TOOTH - 1] / pitted[TOOTH - 1], rules.STANDS_OUT)
    lines = [measures.line(s.broken, order) for order in (13, 14, 15)]
    yield "P9", "order 14", _at_most(lines[1], max(lines[0], lines[2]))
    change = measures.changes(s.broken, s.healthy, s.teeth)
    yield "P9", "change in passes 4 and 5", _at_most(max(change[TOOTH - 3], change[TOOTH - 2]), rules.SEEN_SIGNAL)
