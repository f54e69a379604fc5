"""Unit: threads share what is prepared of a rig; nothing that is frozen is written to."""

from collections import OrderedDict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sigdb.dynamics import prepare_periodic
from sigdb.dynamics.periodic.influences import Influences
from sigdb.transmission import ToothDamage, load_transmission


@pytest.fixture(scope="module")
def prepared():
    return prepare_periodic(load_transmission("nasa-spiral-bevel"), samples_per_tooth=32)


def cases():
    """More sets of damaged samples than are kept, with and without friction."""
    for tooth in (1, 4, 7, 10):
        yield {tooth: ToothDamage(stiffness_loss=0.3)}
        yield {tooth: ToothDamage(phase_shift_deg=2.0, friction=0.05)}


def test_threads_give_the_answers_of_one_thread(prepared):
    """Caches in dictionaries, cleared by one thread while another read them, failed here with a KeyError."""
    damages = list(cases()) * 4
    alone = {i: prepared.steady_state([damage])[0].signals for i, damage in enumerate(cases())}
    fresh = prepare_periodic(prepared.rig, samples_per_tooth=32)
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda damage: fresh.steady_state([damage])[0].signals, damages))
    for i, signals in enumerate(found):
        assert_array_equal(signals, alone[i % len(alone)])


def test_a_thread_gets_its_influence_though_another_has_displaced_it(prepared):
    """The caches were cleared between the write and the read of an entry: a KeyError."""

    class Displacing(OrderedDict):
        """A dictionary from which other threads take every entry at once."""

        def __setitem__(self, key, value):
            super().__setitem__(key, value)
            self.clear()

    influences = Influences(prepared.solver, len(prepared.meshes), prepared.period)
    influences._gathered = Displacing()
    samples = np.arange(40, 60)
    assert_array_equal(influences.at(samples, 0), prepared.influences.at(samples, 0))


def test_influences_are_kept_and_cannot_be_changed(prepared):
    samples = np.arange(40, 60)
    first = prepared.influences.at(samples, 0)
    assert prepared.influences.at(samples.copy(), 0) is first
    with pytest.raises(ValueError, match="read-only"):
        first[0, 0] = 0.0


def test_solving_a_case_leaves_the_prepared_rig_as_it_was(prepared):
    fields = {name: id(value) for name, value in vars(prepared).items()}
    prepared.steady_state(list(cases()))
    assert {name: id(value) for name, value in vars(prepared).items()} == fields
    with pytest.raises(FrozenInstanceError):
        prepared.error = 0.0
