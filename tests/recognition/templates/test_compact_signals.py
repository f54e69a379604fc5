"""Unit and verification: signals in little room are as near to their own as is asked, and so are scores from them."""

import io
import zipfile

import numpy as np
import pandas as pd
import pytest
import skops.io
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.recognition import TemplateBank
from sigdb.recognition.estimators.registry import trusted_types
from sigdb.recognition.templates.bank import PointTemplates
from sigdb.recognition.templates.compact_signals import CompactSignals
from sigdb.recognition.templates.hypotheses import Hypotheses


def mixtures(stream, *, components=5, n=60):
    """Two groups of mixtures of a few patterns, which become weaker by factors of ten."""
    patterns = stream.standard_normal((components, n)) * 10.0 ** -np.arange(components)[:, None]
    return [stream.standard_normal(shape) @ patterns for shape in ((7, 3, components), (2, components))]


@pytest.mark.parametrize("tolerance", [3.0, 0.1, 1e-3, 1e-5])
def test_no_signal_is_further_from_its_own_than_is_allowed(tolerance):
    groups = mixtures(np.random.default_rng(1))
    stored = CompactSignals.of(groups, tolerance=tolerance)
    for one, group in zip(stored, groups, strict=True):
        assert one.expanded().shape == group.shape
        assert np.linalg.norm(one.expanded() - group, axis=-1).max() <= tolerance
        assert one.basis is stored[0].basis


def test_as_many_components_are_kept_as_are_needed():
    groups = mixtures(np.random.default_rng(2))
    ranks = [len(CompactSignals.of(groups, tolerance=tolerance)[0].basis) for tolerance in (1e9, 2.0, 1e-1, 1e-3)]
    assert ranks[0] == 1
    assert ranks == sorted(ranks)
    assert ranks[-1] == 5
    basis = CompactSignals.of(groups, tolerance=1e-3)[0].basis
    assert_allclose(basis @ basis.T, np.eye(5), atol=1e-6)


def test_no_tolerance_is_float32s_precision():
    groups = mixtures(np.random.default_rng(3))
    greatest = max(np.linalg.norm(one, axis=-1).max() for one in groups)
    for one, group in zip(CompactSignals.of(groups, tolerance=0.0), groups, strict=True):
        assert np.linalg.norm(one.expanded() - group, axis=-1).max() <= 4 * 2**-23 * greatest


def test_silence_stays_silent():
    (one,) = CompactSignals.of([np.zeros((3, 8))], tolerance=0.0)
    assert_array_equal(one.expanded(), np.zeros((3, 8)))


@pytest.fixture(scope="module")
def bank(database):
    return TemplateBank.of(database)


def test_likelihoods_are_those_of_the_templates_themselves(database, bank, rows):
    """Within 0.01 nat where a template is within 100 nats of the best, and elsewhere to a share.

    All rows have the noise that the precision refers to.
    """
    (point,) = bank.points
    exact = Hypotheses.of(database, speed_rpm=point.speed_rpm, torque=point.torque, teeth=point.teeth)
    some = rows.iloc[::9]
    x, noise = np.stack(some["tsa"].to_list()).astype(float), some["scatter"] / np.sqrt(some["averages"])
    for index_error in (0.0, bank.index_error):
        law = {"noise": noise.to_numpy(), "index_error": index_error}
        expected, found = exact.log_likelihood(x, **law), point.hypotheses.log_likelihood(x, **law)
        assert np.ptp(expected) > 1000
        plausible = expected > expected.max(axis=(1, 2), keepdims=True) - 100
        assert_allclose(found[plausible], expected[plausible], rtol=0, atol=0.01)
        assert_allclose(found, expected, rtol=0, atol=2e-4 * np.ptp(expected))


def test_harmonic_excitations_are_kept():
    stream = np.random.default_rng(4)
    n, teeth, r, h = 24, 4, 3, 2
    modes = np.linalg.qr(stream.standard_normal((2, n, r)))[0]
    gains, signal, harmonic = stream.random((2, r)), stream.standard_normal((2, n)), stream.standard_normal((2, n, h))
    laws = _laws(teeth, signal, modes, gains, harmonic, stream.standard_normal((2, h, teeth)))
    (point,) = PointTemplates.of([laws], [np.ones(2)], points=[(1.0, 1.0)], index_error=0.3)
    x = stream.standard_normal((5, n))
    law = {"noise": 0.2, "index_error": 0.3}
    assert_allclose(point.hypotheses.log_likelihood(x, **law), laws.log_likelihood(x, **law), rtol=1e-4)


def _laws(teeth, signal, modes, gains, harmonic, phases):
    cases = pd.DataFrame({"tooth": [1, 1], "stiffness_loss": 0.0, "phase_shift_deg": 0.0, "damaged_teeth": 0})
    return Hypotheses(
        teeth=teeth,
        cases=cases,
        signal=signal,
        modes=modes,
        gains=gains,
        harmonic=harmonic,
        phases=phases,
        reference_variance=np.ones(2),
    )


def test_a_stored_bank_is_small_and_the_same(database, bank):
    content = skops.io.dumps(bank, compression=zipfile.ZIP_DEFLATED)
    again = skops.io.loads(content, trusted=trusted_types())
    for one, other in zip(bank.points, again.points, strict=True):
        assert_array_equal(one.signals.levels, other.signals.levels)
        assert_array_equal(one.hypotheses.modes, other.hypotheses.modes)
        assert_array_equal(one.log_prior, other.log_prior)
    # In float32 the nine templates take 9 x 12 x 768 x 4 bytes.
    assert len(content) < 9 * 12 * 768 * 4 / 3
    bases = [one for one in zipfile.ZipFile(io.BytesIO(content)).infolist() if one.file_size > 20_000]
    assert len(bases) <= 2
