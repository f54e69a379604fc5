"""Verification: an event at one place of the turn is seen; pitch errors, noise and disturbances are none."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sigdb.recording.evidence import repeatability as module
from sigdb.recording.evidence.presence import MeshPresence
from sigdb.recording.evidence.repeatability import repeatability

TEETH, S, R = 20, 24, 30
PASSES = np.arange(R * TEETH * S) / S
HIGHEST = 5.0 * TEETH
PRESENT = MeshPresence(present=True, reason="the mesh stands out", p_value=0.0)


def answer(x, *, presence=PRESENT, teeth=TEETH, revolutions=R):
    x = x[: revolutions * TEETH * S]
    return repeatability(x, samples_per_rev=TEETH * S, teeth=teeth, highest=HIGHEST, presence=presence)


def gear(seed=0, errors=0.1, noise=0.5):
    """Three mesh harmonics, whose amplitude differs from tooth to tooth, in noise."""
    stream = np.random.default_rng(seed)
    mesh = sum(np.cos(2 * np.pi * h * PASSES + h) for h in (1, 2, 3))
    each = 1 + errors * stream.standard_normal(TEETH)
    return each[PASSES.astype(int) % TEETH] * mesh + noise * stream.standard_normal(PASSES.size)


def burst(place, period=TEETH):
    u = (PASSES - place + period / 2) % period - period / 2
    return np.exp(-((u / 0.12) ** 2)) * np.cos(4 * np.pi * u)


@pytest.mark.parametrize("seed", range(6))
def test_nothing_stands_out_of_pitch_errors(seed):
    found = answer(gear(seed))
    assert found.kind == "nothing stands out"
    assert found.energy_ratio < found.limit
    assert 0 < found.least_event < 1
    assert f"{found.least_event:.2g} of the average's rms" in found.answer


@pytest.mark.parametrize("place", [0.0, 7.3, 19.8])
def test_an_event_is_seen_at_its_place(place):
    found = answer(gear() + 4.0 * burst(place))
    assert found.kind == "one event"
    assert abs((found.place - place + TEETH / 2) % TEETH - TEETH / 2) < 0.3
    assert (found.same_place, found.revolutions, found.halves_agree) == (R, R, True)
    assert f"in {R} of {R} revolutions: a damaged tooth, or another part" in found.answer
    assert found.power_ratio > 5
    assert found.odd_even_correlation > 0.8


def test_an_event_below_the_noise_of_a_revolution_is_seen_in_the_average():
    """In one revolution the noise is stronger, so that few of them have it at the same place."""
    found = answer(gear(errors=0.0, noise=3.0) + 9.0 * burst(4.0))
    assert found.kind == "one event"
    assert 2 * found.same_place_by_chance < found.same_place < R


def test_units_and_the_begin_of_the_turn_do_not_matter():
    x = gear() + 4.0 * burst(3.0)
    found, other = answer(x), answer(-1e-9 * np.roll(x, 5 * S))
    assert (found.place + 5) % TEETH == other.place
    for name in ("energy_ratio", "odd_even_correlation"):
        assert getattr(other, name) == pytest.approx(getattr(found, name), rel=0.01)


@pytest.mark.parametrize(
    ("disturbance", "reason"),
    [
        (120 * burst(104.0, period=R * TEETH), "as of a disturbance"),
        (8.0 * burst(12.0) * (PASSES > R * TEETH / 2), "as of a disturbance"),
    ],
)
def test_a_disturbance_is_no_event(disturbance, reason):
    """A single knock, and an event that begins in the middle of the record."""
    found = answer(gear() + disturbance)
    assert found.energy_ratio > found.limit
    assert not found.halves_agree
    assert (found.kind, reason in found.answer) == ("cannot be judged", True)


@pytest.mark.parametrize("more", [-1, 1])
def test_an_event_of_another_shaft_is_none_of_this_gear(more):
    assert answer(gear() + 4.0 * burst(4.0, period=TEETH + more)).kind != "one event"


def test_noise_repeats_as_noise_does():
    """The correlation lies within four deviations of 0, the power ratio near 1, and the places are spread."""
    found = [answer(gear(seed, errors=0.0, noise=1.0)) for seed in range(4)]
    assert all(abs(one.odd_even_correlation) < 4 * one.odd_even_by_noise for one in found)
    assert np.mean([one.power_ratio for one in found]) == pytest.approx(1, abs=0.3)
    assert np.mean([one.same_place for one in found]) < 3 * found[0].same_place_by_chance
    assert not any(one.kind == "one event" for one in found)


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"presence": replace(PRESENT, present=False, reason="no mesh of 20 teeth")}, "no mesh of 20 teeth"),
        ({"revolutions": 7}, "7 revolutions are fewer than 8"),
        ({"teeth": 8}, "8 teeth are fewer than 10"),
    ],
)
def test_what_cannot_be_judged_has_its_reason(options, reason):
    found = answer(gear(), **options)
    assert found.kind == "cannot be judged"
    assert found.answer.startswith("Cannot be judged: ")
    assert reason in found.answer


def test_a_record_without_a_band_cannot_be_judged():
    found = repeatability(gear(), samples_per_rev=TEETH * S, teeth=TEETH, highest=25.0, presence=PRESENT)
    assert (found.kind, "holds no band" in found.answer) == ("cannot be judged", True)


def test_a_record_with_nothing_but_the_mesh_holds_no_event():
    found = answer(gear(errors=0.0, noise=0.0))
    assert found.kind == "nothing stands out"
    assert found.least_event < 1.1e-3


def test_the_limit_is_the_counted_one():
    """The documentation holds the numbers of the benchmark that counted the healthy gears."""
    text = (Path(__file__).parents[3] / "docs/guide/repeatability.json").read_text(encoding="utf-8")
    counted = json.loads(text)["counted"]
    assert counted["limit"] <= module.LIMIT < counted["limit"] + 0.1
    assert (counted["false_alarm_rate"], counted["healthy_gears"]) == (module.FALSE_ALARM_RATE, module.HEALTHY_GEARS)
    assert 1 / (counted["of_each_kind"] + 1) <= module.FALSE_ALARM_RATE
    repeats = {row["of"]: row["0.95"] for row in json.loads(text)["tables"]["what repeats"]}
    stated = (module.SAME_PLACE, module.ODD_EVEN, module.POWER_RATIO)
    assert [float(f"{value:.3g}") for value in repeats.values()] == list(stated)
