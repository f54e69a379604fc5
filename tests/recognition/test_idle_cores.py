"""Unit: trees are trained on the cores that are idle."""

import os

import pytest

from sigdb.recognition.idle_cores import idle_cores


@pytest.mark.parametrize(("load", "threads"), [(0.3, 8), (1.2, 8), (5.0, 4), (30.0, 1)])
def test_trees_are_trained_on_the_cores_that_are_idle(monkeypatch, load, threads):
    """The load counts the process itself."""
    monkeypatch.setattr(os, "cpu_count", lambda: 8)
    monkeypatch.setattr(os, "getloadavg", lambda: (load, 0.0, 0.0))
    with idle_cores() as number:
        assert number == threads


def test_trees_are_trained_on_half_of_the_cores_where_the_load_is_unknown(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 8)
    monkeypatch.delattr(os, "getloadavg")
    with idle_cores() as number:
        assert number == 4
