"""The mixture of nuisances: its probabilities, and what is drawn from it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core.errors import InputError
from sigdb.measurement import NuisanceMixture, NuisancePart, NuisanceSettings
from sigdb.measurement.nuisance_mixture import LARGE, SIZES

THREE = NuisanceSettings(gain_db=1.0, path_db=1.0, path_orders=(2.0, 12.0), mark=0.1, none=0.4, together=0.2)


def test_each_nuisance_stands_alone_and_a_path_for_each_distance():
    gain, near, far = THREE.each
    assert (gain.gain_db, gain.path_db, gain.mark) == (1.0, 0.0, 0.0)
    assert (near.path_orders, far.path_orders) == ((2.0,), (12.0,))
    assert NuisanceSettings(mark=0.1).each == ()


def test_the_parts_share_what_none_and_all_leave():
    mixture = NuisanceMixture.of(THREE)
    assert_allclose(sum(part.weight for part in mixture.parts), 1.0)
    assert mixture.parts[:2] == (NuisancePart(0.4), NuisancePart(pytest.approx(0.1), late=True))
    alone = [part for part in mixture.parts if len(part.nuisances) == 1]
    assert {part.nuisances for part in alone} == {(0,), (1,), (2,)}
    assert_allclose([part.weight for part in alone], 0.05)
    assert_allclose([part.weight for part in mixture.parts if len(part.nuisances) == 3], 0.1)
    assert all(part.late for part in mixture.parts[1:])


def test_a_nuisance_may_be_twice_as_large_as_stated():
    mixture = NuisanceMixture.of(THREE.model_copy(update={"twice": 0.2}))
    of_sizes = [[part.weight for part in mixture.parts if part.size == size and part.nuisances] for size in SIZES]
    large = [part for part in mixture.parts if part.size == LARGE]
    assert_allclose(sum(part.weight for part in large), 0.2 * (1 - 0.4 - 0.1))
    assert [part.nuisances for part in large] == [(0,), (1,), (2,), (0, 1, 2)]
    assert_allclose([sum(weights) for weights in of_sizes], 0.4 * (1 - 0.4 - 0.1))
    assert_allclose(sum(part.weight for part in mixture.parts), 1.0)
    assert "twice" not in THREE.model_dump()


def test_a_factor_is_the_size_of_the_part_for_the_modes_of_its_nuisances():
    parts = (NuisancePart(0.5), NuisancePart(0.25, (1,), 0.5), NuisancePart(0.25, (0, 1)))
    assert_allclose(NuisanceMixture(parts=parts).factors([2, 1]), [[0, 0, 0], [0, 0, 0.5], [1, 1, 1]])


def test_machines_are_drawn_with_the_probabilities_and_only_some_marks_are_late():
    mixture = NuisanceMixture.of(THREE)
    part, passes = mixture.draw(np.random.default_rng(1), 40_000)
    share = np.bincount(part, minlength=len(mixture.parts)) / len(part)
    assert_allclose(share, [each.weight for each in mixture.parts], atol=5 * 0.5 / np.sqrt(len(part)))
    assert not passes[part == 0].any()
    assert abs(passes[part > 0].std() / 0.1 - 1) < 0.02


def test_probabilities_above_one_are_refused():
    with pytest.raises(InputError, match=r"none = 0\.8 and together = 0\.3 add up to more than 1"):
        NuisanceSettings(none=0.8, together=0.3)
