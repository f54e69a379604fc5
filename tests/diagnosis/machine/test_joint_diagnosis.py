"""One answer from several channels and speeds of one machine, also where a channel is dead, inverted or contradicts."""

from dataclasses import replace

import numpy as np
import pytest

from sigdb.core import InputError
from sigdb.diagnosis import diagnose_jointly, joint_answer
from sigdb.diagnosis.change.change import PLACES
from sigdb.recording import Channel, Recording

TEETH, RATE, TOOTH = 24, 12_800.0, 7
CHANNELS = ("a1", "a2")


def recorded(seed, size=0.0, *, gains=(1.0, 0.6), speed=28.0, dead=False, mark=True):
    """A mesh with errors of its teeth and an event 1.1 passes after the contact of a tooth, by two sensors."""
    t = np.arange(int(2 * RATE)) / RATE
    passes = TEETH * (0.3 + 0.07 * seed + speed * t)
    trace = np.random.default_rng(TEETH).standard_normal(TEETH)[passes.astype(int) % TEETH]
    after = (passes - (TOOTH - 1) - 1.1 + TEETH / 2) % TEETH - TEETH / 2
    x = sum((1 + 0.1 * trace) * np.cos(2 * np.pi * h * passes + h) / h for h in (1, 2, 3, 4))
    x = x + size * np.exp(-3 * after**2) * np.cos(3 * np.pi * after)
    channels = []
    for number, gain in enumerate(gains):
        noise = 0.3 * np.random.default_rng([seed, number]).standard_normal(t.size)
        clean = np.zeros(t.size) if dead and number else gain * x
        channels.append(Channel(name=CHANNELS[number], samples=clean + noise, sampling_rate=RATE, unit="m/s^2"))
    tacho = Channel(name="tacho", samples=1.0 * (passes / TEETH % 1 < 0.1), sampling_rate=RATE)
    return Recording(source=f"recording {seed}", channels=(*channels, tacho), tacho="tacho" if mark else None)


@pytest.fixture(scope="module")
def healthy():
    return [recorded(10), recorded(11, speed=31.0)]


@pytest.fixture(scope="module")
def joint(healthy, few_tries):
    """Two channels at two speeds."""
    runs = [recorded(1, 0.5), recorded(2, 0.5, speed=31.0)]
    return diagnose_jointly(runs, teeth=TEETH, healthy=healthy, of_channels=CHANNELS)


def test_channels_and_speeds_have_one_answer(joint):
    assert (joint.kind, joint.exit_code) == ("one tooth", 1)
    assert TOOTH in joint.candidates
    assert [(part.channel, part.recordings) for part in joint.parts] == [
        ("a1", (0,)), ("a1", (1,)), ("a2", (0,)), ("a2", (1,)),
    ]  # fmt: skip
    assert all(part.contribution[TOOTH - 1] > 0 for part in joint.parts)
    assert not joint.notes
    facts = joint.as_json()
    assert facts["teeth"][TOOTH - 1] == max(facts["teeth"])
    assert len(facts["parts"]) == 4


def test_all_together_are_surer_than_each(joint):
    for part in joint.parts:
        assert joint_answer([part]).posterior.none >= joint.posterior.none


def test_an_average_that_shows_another_tooth_is_named(joint):
    *others, last = joint.parts
    finding = last.diagnosis.finding
    elsewhere = replace(finding, evidence=np.roll(finding.evidence, 10 * PLACES))
    parts = [*others, replace(last, diagnosis=replace(last.diagnosis, finding=elsewhere))]
    found = joint_answer(parts)
    assert TOOTH in found.candidates
    (note,) = found.notes
    assert note.code == "averages-contradict"
    assert note.values["average"].startswith("channel a2 at 18")
    assert f"alone shows tooth {TOOTH + 10}, all together tooth {TOOTH}." in note.text


def test_a_dead_channel_takes_no_part_and_an_inverted_one_does(healthy, few_tries):
    dead = diagnose_jointly(recorded(1, 0.5, dead=True), teeth=TEETH, healthy=healthy[:1], of_channels=CHANNELS)
    assert TOOTH in dead.candidates
    assert [part.contribution is None for part in dead.parts] == [False, True]
    assert [note.code for note in dead.notes] == ["average-left-out"]
    turned = diagnose_jointly(
        recorded(1, 0.5, gains=(1.0, -1.2)), teeth=TEETH, healthy=healthy[:1], of_channels=CHANNELS
    )
    assert TOOTH in turned.candidates
    assert turned.parts[1].contribution[TOOTH - 1] > 0


def test_no_damage_has_the_power_of_the_best_average(healthy, few_tries):
    found = diagnose_jointly(recorded(3), teeth=TEETH, healthy=healthy[:1], of_channels=CHANNELS)
    assert (found.kind, found.candidates) == ("no change", ())
    best = min(part.diagnosis.power.smallest for part in found.parts)
    assert f"an event of {best:.2g} of the average's rms or more would have been seen" in found.answer


def test_what_cannot_be_joined_is_refused(healthy):
    run = recorded(1)
    for options, text in (
        ({"of_channels": ("a1", "a1")}, "channel 'a1' is given twice"),
        ({"healthy": ()}, "several averages are joined to be compared with healthy recordings; give healthy"),
        ({"of_channels": ("a1", "a9")}, "a9"),
    ):
        with pytest.raises(InputError, match=text):
            diagnose_jointly(run, **{"teeth": TEETH, "healthy": healthy[:1], "of_channels": CHANNELS} | options)
    unmarked = [recorded(1, mark=False), recorded(2, speed=31.0, mark=False)]
    with pytest.raises(InputError, match="recordings at several speeds or loads are joined by the mark"):
        diagnose_jointly(unmarked, teeth=TEETH, healthy=healthy, mesh_phase=True, speed_range_rpm=(1500.0, 2000.0))
