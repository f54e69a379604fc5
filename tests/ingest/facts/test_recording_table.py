"""Unit: facts of recordings by a table and by a pattern over names, and their mistakes."""

import pytest

from sigdb.core.errors import InputError
from sigdb.ingest.facts.damage_kinds import kind_of
from sigdb.ingest.facts.recording_facts import RecordingFacts
from sigdb.ingest.facts.recording_table import facts_by_pattern, read_table


def table(tmp_path, text, section=RecordingFacts, needed="file"):
    (tmp_path / "t.csv").write_text(text, encoding="utf-8")
    return read_table(tmp_path / "t.csv", section, needed=needed)


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_numbers_units_and_unknowns_of_a_table(tmp_path, separator):
    lines = ["file,torque,tooth,speed_rpm,_mine,date", "a.csv,2 kN m,unknown,25 Hz,x,2026-03-01 08:30", ",,,,,"]
    (facts,) = table(tmp_path, "\n".join(lines).replace(",", separator))
    assert (facts.torque, facts.tooth, facts.speed_rpm, facts.date) == (2000, None, 1500, "2026-03-01T08:30:00")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name\na.csv\n", "has no column file"),
        ("file,torqe\na.csv,1\n", r"column 'torqe' is no fact of a recording.*torque"),
        ("file,file\na.csv,b\n", "column 'file' stands twice"),
        ("file\na.csv,b\n", "line 2 has 2 values, the header has 1 columns"),
        ("file,tooth\na.csv,-1\n", "line 2: tooth"),
        ("file,tooth\na.csv,four\n", "line 2: tooth"),
        ("file,date\na.csv,01.03.2026\n", "is no date by ISO 8601"),
        ("file,kind\na.csv,piting\n", r"no kind of damage of ISO 10825:1995.*pitting"),
        ("file,state,tooth\na.csv,healthy,4\n", "contradict each other"),
        ("file,label_trust\na.csv,sure\n", "label_trust"),
        ('file\n"a.csv\n', "is no table with a header"),
        ("", "is empty; write a line with the names of the columns"),
    ],
)
def test_a_mistake_in_a_table_is_named(tmp_path, text, message):
    with pytest.raises(InputError, match=message):
        table(tmp_path, text)


def test_an_unknown_trust_is_no_empty_one(tmp_path):
    stated, unknown = table(tmp_path, "file,state,label_trust\na.csv,chipped,\nb.csv,chipped,unknown\n")
    assert [each.labels["label_trust"] for each in (stated, unknown)] == ["stated", "unknown"]


@pytest.mark.parametrize(
    ("pattern", "name", "facts"),
    [
        ("{state}_{load}Nm_{number}.csv", "chipped_12.5Nm_003.csv", {"state": "chipped", "load": 12.5}),
        ("{state}_{load}Nm_{number}.csv", "deep/chipped_12Nm_3.csv", {"state": "chipped", "load": 12}),
        ("{machine}/{date}/*.wav", "m1/2026-01-02/run.wav", {"machine": "m1", "date": "2026-01-02"}),
        ("{state}30hz{load}.csv.gz", "b30hz0.csv.gz", {"state": "b", "load": 0}),
        ("{torque}.csv", "a.csv.gz", None),
    ],
)
def test_facts_in_the_name_of_a_file(pattern, name, facts):
    expected = [] if facts is None else [RecordingFacts(file=name, **facts)]
    assert facts_by_pattern([name], pattern) == expected


@pytest.mark.parametrize(
    ("pattern", "message"),
    [("{stat}.csv", r"\{stat\} is no fact.*state"), ("{load}_{load}.csv", "stands twice"), ("{file}.csv", "no fact")],
)
def test_a_mistake_in_a_pattern_is_named(pattern, message):
    with pytest.raises(InputError, match=message):
        facts_by_pattern(["a.csv"], pattern)


def test_a_wrong_value_in_a_name_names_the_file():
    with pytest.raises(InputError, match=r"x_low\.csv by the pattern.*load"):
        facts_by_pattern(["x_low.csv"], "x_{load}.csv")


@pytest.mark.parametrize(
    ("word", "kind"),
    [
        ("Healthy", "none"),
        ("Chipped Tooth", "breakage"),
        ("missing_tooth", "breakage"),
        ("ROOT-crack", "crack"),
        ("fatigue crack", "fatigue crack"),
        ("spalling", "spalling"),
        ("scoring", "moderate scratching"),
        ("Semi-brittle fracture", "semi-brittle fracture"),
        ("b", "unknown"),
    ],
)
def test_words_for_states_have_the_names_of_iso_10825_1995(word, kind):
    assert kind_of(word) == kind
