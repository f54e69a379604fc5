"""Unit: the margins of the paper's rules are at most 0 exactly where the claims hold."""

import numpy as np
import pytest

from sigdb.paper import margins
from sigdb.paper.claims import CLAIMS
from sigdb.paper.signals import PaperSignals

TEETH, N = 12, 192
THETA = 2 * np.pi * np.arange(N) / N


def random_signals(seed):
    """All cases as a mesh order with bursts of random sizes about the 6th pass, as the paper's damage makes them."""
    rng = np.random.default_rng(seed)
    at = np.exp(-0.5 * ((THETA - rng.normal(3.1, 0.15)) / rng.uniform(0.15, 0.5)) ** 2)
    size, phase, grows = rng.uniform(0, 1), rng.uniform(-0.2, 0.6), rng.uniform(0.6, 1.4, 3)

    lows = rng.uniform(0, 0.6, 3)
    start = rng.uniform(0, 6)

    def case(scale, a=1.0, b=1.0, low=1.0):
        added = sum(c * np.cos(order * THETA + rng.uniform(0, 6)) for c, order in zip(lows, (1, 4, 8), strict=True))
        return (1 + a * scale * at) * np.cos(TEETH * THETA + start + b * scale * at) + low * scale * at * added

    mesh = case(0.0)
    shifts = {shift: case(shift / 4.5 * g, size, phase) for shift, g in zip((1.5, 3.0, 4.5), grows, strict=True)}
    deep = rng.uniform(-1.2, 2.0)
    losses = {loss: case(2 * loss * rng.uniform(0.6, 1.2), deep, phase, 1.5) for loss in (0.25, 0.5)}
    if seed % 3 == 0:  # nearly nothing about 180 deg, and less after it
        losses[0.5] = mesh * (1 - rng.uniform(0.5, 1) * (np.abs(THETA - 3) < 0.5) - 0.3 * (np.abs(THETA - 4.2) < 0.7))
    return PaperSignals(
        teeth=TEETH,
        healthy=mesh,
        shifts=shifts,
        elsewhere=np.roll(shifts[4.5], 3 * N // TEETH),
        losses=losses,
        pitted=case(rng.uniform(0, 0.5)),
        broken=case(rng.uniform(0, 3.0)),
        min_compression=0.5,
    )


def verdicts(s):
    """Claims, and whether all margins of each, held out or not, are at most 0."""
    worst = margins.worst([*margins.target_margins(s), *margins.held_out_margins(s)])
    parts = {
        claim.id: [claim.id, *(name for name in margins.HELD_OUT if name.startswith(f"{claim.id}, "))]
        for claim in CLAIMS
    }
    return {
        claim.id: (claim.find(s).holds, max(worst[name] for name in parts[claim.id] if name in worst) <= 0)
        for claim in CLAIMS
        if claim.id != "P7"
    }


def test_margins_and_claims_agree_on_random_signals():
    found = [verdicts(random_signals(seed)) for seed in range(24)]
    for of_signals in found:
        for claim, (holds, within) in of_signals.items():
            assert holds is within, claim
    # Both answers occur for each.
    assert all(len({of_signals[claim] for of_signals in found}) == 2 for claim in found[0])


def test_every_held_out_claim_has_margins_and_no_target_has_its_name():
    s = random_signals(0)
    assert {margin.claim for margin in margins.held_out_margins(s)} == set(margins.HELD_OUT)
    assert not {margin.claim for margin in margins.target_margins(s)} & set(margins.HELD_OUT)


@pytest.mark.parametrize("case", ["3 deg", "25 %", "elsewhere", "pitted", "broken"])
def test_targets_do_not_read_what_is_held_out(case):
    s = random_signals(1)
    unknown = np.full(N, np.nan)
    changed = {
        "3 deg": {"shifts": {**s.shifts, 3.0: unknown}},
        "25 %": {"losses": {**s.losses, 0.25: unknown}},
    }.get(case, {case: unknown})
    assert margins.target_margins(PaperSignals(**{**vars(s), **changed})) == margins.target_margins(s)
