"""Verification: killed at random instants, a sweep goes on to the undisturbed database; readers see whole parts."""

import importlib.util
from pathlib import Path

_SPEC = importlib.util.spec_from_file_location("crashes", Path(__file__).with_name("crashes.py"))
crashes = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(crashes)


def test_a_sweep_that_is_killed_again_and_again(tmp_path):
    """A worker and a parent; tests/sweep/work/crashes.py does the same for longer, and to whole groups."""
    said = crashes.crash(tmp_path, kills=2, seed=1, pause=1.0)
    assert said.startswith("2 kills")
