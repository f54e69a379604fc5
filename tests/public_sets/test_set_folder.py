"""Unit: a folder of a public set, by the names of its files: recordings with facts, what is missing, what differs."""

import pytest

from sigdb.core import InputError
from sigdb.public_sets import check_folder, load_public_set


@pytest.fixture
def check(tmp_path):
    def check_names(name, *files):
        for file in files:
            path = tmp_path / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("0", encoding="utf-8")
        return check_folder(name, load_public_set(name), tmp_path)

    return check_names


def facts(checked, file):
    (found,) = [each for each in checked.recordings if each.file == file]
    return found.model_dump(exclude_none=True, exclude={"file", "set", "machine"})


def test_labels_of_a_name(check):
    checked = check("spectraquest", "h30hz0.csv", "b30hz50.csv", "more/h30hz90.csv.gz", "readme.txt", ".DS_Store")
    assert facts(checked, "b30hz50.csv") == {
        "load": 50.0,
        "specimen": "spectraquest b",
        "state": "broken tooth",
        "kind": "breakage",
        "label_trust": "unknown",
    }
    assert facts(checked, "more/h30hz90.csv.gz")["load"] == 90
    assert checked.states == {"h30hz0.csv": "h", "b30hz50.csv": "b", "more/h30hz90.csv.gz": "h"}
    assert checked.unknown == ("readme.txt",)
    assert checked.missing == ("17 of 20 files {state}30hz{load}.csv*",)
    assert checked.changed == ("b30hz50.csv", "h30hz0.csv")


def test_folders_tell_gears_from_bearings(check):
    checked = check("seu", "gearset/Chipped_20_0.csv", "gearbox/gearset/health_30_2.csv", "bearingset/ball_20_0.csv")
    chipped = facts(checked, "gearset/Chipped_20_0.csv")
    assert (chipped["kind"], chipped["load"], chipped["label_trust"]) == ("crack", 0, "seeded")
    assert facts(checked, "bearingset/ball_20_0.csv")["kind"] == "none"
    assert facts(checked, "gearbox/gearset/health_30_2.csv")["load"] == 2
    assert len(checked.missing) == 4


def test_states_and_severities(check):
    checked = check(
        "mcc5-thu", "teeth_crack_M_speed_circulation_10Nm-2000rpm.csv", "health_torque_circulation_1000rpm_20Nm.csv"
    )
    crack = facts(checked, "teeth_crack_M_speed_circulation_10Nm-2000rpm.csv")
    assert (crack["kind"], crack["severity"], crack["load"]) == ("crack", "M", 10)
    assert facts(checked, "health_torque_circulation_1000rpm_20Nm.csv")["kind"] == "none"
    assert [text.split(" files")[0] for text in checked.missing] == ["119 of 120", "119 of 120"]


@pytest.mark.parametrize(
    ("word", "kind", "degrees"),
    [
        ("health", "none", False),
        ("gear_pitting", "pitting", True),
        ("gear_wear", "wear", True),
        ("teeth_crack", "crack", True),
        ("teeth_break", "breakage", True),
        ("miss_teeth", "breakage", False),
        ("teeth_break_and_bearing_inner", "breakage", True),
        ("teeth_break_and_bearing_outer", "breakage", True),
    ],
)
def test_the_states_of_mcc5_thu(word, kind, degrees, check):
    names = [f"{word}_{degree}" for degree in "LMH"] if degrees else [word]
    checked = check("mcc5-thu", *(f"{name}_torque_circulation_2000rpm_10Nm.csv" for name in names))
    for name in names:
        found = facts(checked, f"{name}_torque_circulation_2000rpm_10Nm.csv")
        assert (found["kind"], found["state"]) == (kind, name)
        assert found.get("severity") == (name[-1] if degrees else None)
        assert load_public_set("mcc5-thu").expected_of(name) == ("none" if kind == "none" else "damage")


def test_the_states_and_working_conditions_of_mcc5_thu_make_all_its_files():
    described = load_public_set("mcc5-thu")
    assert len(described.states) * 12 == sum(files.least for files in described.files) == 240


def test_a_state_that_no_page_lists_is_refused(check):
    with pytest.raises(InputError, match=r"'odd' is no state of MCC5-THU .*; known: health, gear_pitting_L"):
        check("mcc5-thu", "odd_speed_circulation_10Nm-2000rpm.csv")


def test_bearings_by_folder(check):
    checked = check("mfpt", "1 - Baseline/b1.mat", "3 - Outer/o1.mat", "4 - Inner/i1.mat", "6 - Real/r.mat")
    assert [(each.sampling_rate, each.state) for each in checked.recordings] == [
        (97656.0, "baseline"),
        (48828.0, "bearing, outer race"),
        (48828.0, "bearing, inner race"),
    ]
    assert {each.kind for each in checked.recordings} == {"none"}
    assert checked.unknown == ("6 - Real/r.mat",)


def test_files_that_are_no_recordings(check):
    checked = check("hums2023", "Day024_Hunting_SSA_20211216_142217.mat", "notes.pdf")
    assert (checked.recordings, checked.others) == ((), ("Day024_Hunting_SSA_20211216_142217.mat",))
    assert check("uconn").others == ("Day024_Hunting_SSA_20211216_142217.mat",)


def test_sensors_of_one_measurement(check):
    checked = check("gear0", "3027_217_Data_Chan7.mat")
    assert checked.recordings[0].sensor == "7"
    assert checked.changed == ("3027_217_Data_Chan7.mat",)


def test_a_folder_that_is_not_there_is_refused_with_where_to_get_the_set(tmp_path):
    with pytest.raises(InputError, match="absent: no such folder; PHM Society"):
        check_folder("phm2009", load_public_set("phm2009"), tmp_path / "absent")
