"""Verification: cases of each kind hold, and what must not come of them is a fault."""

import importlib
from pathlib import Path

import pytest

import sigdb
from sigdb.core import InputError

CASES = {"recipes": 15, "rigs": 60, "sql": 30, "models": 15, "databases": 10, "arrays": 150}
"""Number of cases of each kind."""


@pytest.fixture
def fuzzing(monkeypatch):
    """The modules of the fuzzer."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    return importlib.import_module("targets.all_targets")


@pytest.mark.parametrize("kind", CASES)
def test_cases_of_every_kind_hold(fuzzing, tmp_path, kind):
    outcomes = []
    for number in range(CASES[kind]):
        outcome, about, fault = fuzzing.run_case(kind, tmp_path, 7, number)
        assert fault is None, (number, about, fault)
        outcomes.append(outcome)
    assert set(outcomes) == {"read", "refused"}


def test_every_kind_has_cases_here(fuzzing):
    assert set(CASES) == set(fuzzing.TARGETS)
    runner = importlib.import_module("fuzz")
    assert set(runner.KINDS) == {"recordings", *CASES}


def test_a_case_is_the_same_again(fuzzing, tmp_path):
    first, again = (fuzzing.run_case("recipes", tmp_path, 3, 5) for _ in range(2))
    assert first == again


@pytest.mark.parametrize(
    ("raised", "fault"),
    [
        (KeyError("deep in a library"), "escaped: KeyError"),
        (InputError("a tab\t"), "message"),
        (InputError("two\nlines"), "message"),
    ],
)
def test_what_escapes_is_a_fault(fuzzing, monkeypatch, tmp_path, raised, fault):
    def target(folder, random, about):
        def fail():
            raise raised

        return fuzzing.outcomes.answered(fail, about)

    monkeypatch.setitem(fuzzing.TARGETS, "arrays", target)
    assert fuzzing.run_case("arrays", tmp_path, 1, 1)[2].startswith(fault)


def test_wrong_numbers_of_a_damaged_database_are_a_fault(fuzzing, monkeypatch, tmp_path):
    """A reader that answers from a damaged file."""
    stored = importlib.import_module("targets.stored")
    right = stored.READS["cases"](sigdb.open(stored.small_database()))
    monkeypatch.setattr(stored, "READS", {"cases": lambda _: right.assign(tooth=99)})
    monkeypatch.setattr(stored, "_right", lambda way: right)
    faults = [fuzzing.run_case("databases", tmp_path, 7, number)[2] for number in range(3)]
    assert any(fault and fault.startswith("wrong numbers: cases") for fault in faults)
