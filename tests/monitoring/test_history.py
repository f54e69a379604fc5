"""Validation: what has changed is named, from looks whose change is known; a kept result is not computed again."""

import json
from dataclasses import replace

import numpy as np
import pytest

from sigdb.core import InputError
from sigdb.monitoring import MonitorSettings, gear_history
from sigdb.monitoring.kept_results import KeptResults
from sigdb.report import monitor_text

CHANGES = {
    "nothing": ({}, "no change", 0),
    "tooth": ({"event": 0.8}, "one tooth", 1),
    "gear": ({"gear": 3}, "gear changed", 1),
    "sensor": ({"gain": 2.0}, "level changed", 0),
}


@pytest.fixture(scope="module")
def kept():
    return KeptResults()


@pytest.mark.parametrize("name", CHANGES)
def test_what_has_changed_is_named_with_its_instant(look, healthy, kept, name):
    options, kind, code = CHANGES[name]
    looks = [*healthy, *(look(100 + 10 * len(name) + number, **options) for number in range(3))]
    found = gear_history(looks, MonitorSettings(looks_a_year=365.0, severity_limit_db=40.0), kept=kept)
    assert (found.answer.kind, found.answer.exit_code) == (kind, code)
    assert found.looks["alarm"].tolist() == [False] * 14 + [code == 1] * 3
    assert found.tooth_map.shape == (17, 12)
    assert found.healthy_looks == 12
    if code:
        assert (found.change.low, found.change.look, found.change.high) == (14, 14, 14)
    else:
        assert found.change is None
        assert "would have been seen at any tooth with probability 0.95" in found.answer.sentence
    if name == "tooth":
        assert found.answer.sentence == "One tooth stands out: 5 ± 2."
        assert found.tooth_map[-1].argmax() in (3, 4, 5)
    if name == "tooth":
        text = monitor_text([found])
        assert f"at tooth {found.growth.tooth} with a probability of" in text
        assert f"Remaining life: {found.growth.life.median:.3g} days (90 %: " in text
        assert monitor_text([found] * 11).count("NB4*") == 11
    if not code:
        assert monitor_text([found] * 10).count("NB4*") == 10
        many = monitor_text([found] * 11)
        assert (many.count("NB4*"), many.count(found.answer.sentence)) == (0, 11)
        assert "The looks of 11 gears without an alarm are not shown; --out and --format json have them." in many
    if name == "sensor":
        assert found.looks["level_db"].iloc[-1] == pytest.approx(20 * np.log10(2), abs=0.2)
    facts = json.loads(json.dumps(found.as_json()))
    assert (facts["kind"], len(facts["looks"]), len(facts["tooth_map"][0])) == (kind, 17, 12)


def test_results_that_are_kept_are_not_computed_again(look, healthy, kept):
    gear_history(healthy, kept=kept)

    def none():
        raise AssertionError("read again")

    looks = [replace(each, read=none) if each.health == "unknown" else each for each in healthy] + [look(50)]
    assert len(gear_history(looks, kept=kept).looks) == 15


@pytest.mark.parametrize(("gear", "kind"), [(1, "level changed"), (3, "cannot be judged")])
def test_a_load_that_explains_the_change_is_no_alarm(look, healthy, gear, kind):
    """Twice the vibration at a torque that the healthy looks did not have, and other errors of the teeth or not."""
    loaded = [replace(each, torque=50.0 + number % 2) for number, each in enumerate(healthy)]
    found = gear_history(
        [*loaded, replace(look(60, gain=2.0, gear=gear), torque=80.0)], MonitorSettings(looks_a_year=365.0)
    )
    assert (found.answer.kind, found.level.cause) == (kind, "load")


@pytest.mark.parametrize("load", [0.7, 1.3, 1.6])
def test_a_load_that_nobody_states_may_have_changed(look, healthy, kept, load):
    """All mesh harmonics change by 2 dB and more, and the errors of the teeth with them: no tooth, and no alarm."""
    looks = [*healthy, *(look(200 + number, load=load) for number in range(3))]
    found = gear_history(looks, MonitorSettings(looks_a_year=365.0), kept=kept)
    assert (found.looks["health_indicator"] > found.limit).tolist() == [False] * 14 + [True] * 3
    assert found.looks["doubt"].tolist() == [""] * 14 + ["load or sensor"] * 3
    assert not found.looks["alarm"].any()
    assert (found.answer.kind, found.answer.exit_code) == ("cannot be judged", 3)
    assert "load or sensor may have changed" in found.answer.sentence
    assert "tooth" not in found.answer.sentence


@pytest.mark.parametrize(
    ("torque", "speed_rpm", "doubt"),
    [(51.0, 1500.0, ""), (80.0, 1500.0, "load"), (30.0, 1500.0, "load"), (51.0, 1560.0, "speed")],
)
def test_a_stated_load_or_a_speed_outside_those_of_the_healthy_looks_is_a_doubt(
    look, healthy, torque, speed_rpm, doubt
):
    loaded = [replace(each, torque=50.0 + number % 2) for number, each in enumerate(healthy)]
    new = replace(look(80, gear=3, load=1.4, speed_rpm=speed_rpm), torque=torque)
    found = gear_history([*loaded, new], MonitorSettings(looks_a_year=365.0))
    assert found.looks["doubt"].iloc[-1] == doubt
    assert found.looks["alarm"].iloc[-1] == (not doubt)
    assert found.answer.exit_code == (3 if doubt else 1)


@pytest.mark.parametrize(
    ("labelled", "settings", "kind", "codes"),
    [
        (12, {}, "no change", ["looks-assumed"]),
        (0, {}, "no change", ["healthy-assumed", "looks-assumed"]),
        (0, {"baseline": 6, "looks_a_year": 52.0}, "no change", []),
    ],
)
def test_what_is_assumed_is_noted(look, labelled, settings, kind, codes):
    looks = [look(n, health="healthy" if n < labelled else "unknown", dated=False) for n in range(14)]
    found = gear_history(looks, MonitorSettings(**settings))
    assert found.answer.kind == kind
    assert [note.code for note in found.notes] == codes


def test_too_few_healthy_looks_cannot_be_judged(look):
    found = gear_history([look(number, health="healthy") for number in range(4)])
    assert (found.answer.kind, found.answer.exit_code) == ("cannot be judged", 3)
    assert "4 looks are healthy, fewer than 5" in found.answer.sentence


def test_a_look_that_cannot_be_compared_is_left_out_with_a_note(look, healthy, kept):
    found = gear_history([*healthy, look(70, groups=3)], kept=kept)
    assert len(found.looks) == 14
    assert [note.code for note in found.notes] == ["look-left-out"]
    assert "revolutions are too few" in found.notes[0].text


def test_zones_are_those_that_are_stated(healthy, kept):
    """The rms of the averages is about 0.9 m/s, that of the records 1."""
    found = gear_history(healthy, MonitorSettings(zones=(500.0, 800.0, 2000.0)), kept=kept)
    assert set(found.looks["zone"]) == {"C"}


@pytest.mark.parametrize("wrong", [{"false_alarms_a_year": 0}, {"baseline": 3}, {"looks_a_year": -1}])
def test_wrong_settings_are_refused(wrong):
    with pytest.raises((InputError, ValueError)):
        MonitorSettings(**wrong)


def test_nothing_of_a_history_without_a_new_look_is_computed_again(healthy):
    fresh = KeptResults()
    before = gear_history(healthy, kept=fresh)
    unread = [replace(each, read=lambda: pytest.fail("a look was read again")) for each in healthy]
    again = gear_history(unread, kept=fresh)
    assert again.answer == before.answer
    assert again.level is before.level


def test_damage_that_comes_after_an_exchange_of_the_sensor_is_an_alarm(look, healthy):
    """Twice the gain from look 14 on, which nobody states, and an event from look 25 on: the first ten compare."""
    exchanged = [look(300 + number, gain=2.0) for number in range(11)]
    damaged = [look(320 + number, gain=2.0, event=0.8) for number in range(2)]
    fresh = KeptResults()
    found = gear_history([*healthy, *exchanged, *damaged], MonitorSettings(looks_a_year=365.0), kept=fresh)
    assert found.looks["alarm"].tolist() == [False] * 25 + [True] * 2
    assert (found.answer.kind, found.answer.sentence) == ("one tooth", "One tooth stands out: 5 ± 2.")
    assert (found.since.look, found.since.looks, found.since.answer) == (14, 10, found.answer)
    assert found.notes[-1].text.startswith("The level has changed at r300, and no load is stated.")
    assert found.as_json()["since"]["look"] == 14
    before = gear_history([*healthy, *exchanged], MonitorSettings(looks_a_year=365.0))
    assert (before.answer.kind, before.answer.exit_code) == ("level changed", 0)
    assert before.since.answer.exit_code != 1
    assert "Damage that these 10 have is not seen by that." in before.notes[-1].text


def test_results_against_looks_after_a_change_of_level_are_kept(look, healthy, tmp_path, monkeypatch):
    monkeypatch.setenv("SIGDB_CACHE", str(tmp_path / "cache"))
    looks = [*healthy, *(look(300 + number, gain=2.0) for number in range(12))]
    kept = KeptResults.read(tmp_path / "looks.arrow")
    before = gear_history(looks, kept=kept)
    kept.write()
    unread = [replace(each, read=lambda: pytest.fail("a look was read again")) for each in looks]
    again = gear_history(unread, kept=KeptResults.read(tmp_path / "looks.arrow"))
    assert again.as_json() == before.as_json()


def test_damage_that_comes_with_a_change_of_level_is_in_doubt(look, healthy):
    looks = [*healthy, *(look(300 + number, gain=2.0, event=0.8) for number in range(12))]
    found = gear_history(looks, MonitorSettings(looks_a_year=365.0))
    assert not found.looks["alarm"].any()
    assert (found.answer.kind, found.answer.exit_code) == ("cannot be judged", 3)
    labelled = [*looks[:20], replace(looks[20], health="damaged"), *looks[21:]]
    assert gear_history(labelled, MonitorSettings(looks_a_year=365.0)).since is None
