"""The law of an average: against the normal density written out, turned signals, draws, and the rows of a database."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy.special import logsumexp
from scipy.stats import chi2, multivariate_normal

from sigdb.core.errors import InputError
from sigdb.core.streams import specimen_stream
from sigdb.database import Template
from sigdb.measurement import (
    NuisanceMixture,
    NuisancePart,
    index_error_covariance,
    index_errors,
    late,
    noise_deviation,
    shape_of,
)
from sigdb.recognition import Hypotheses, Nuisances
from sigdb.recognition.noise.noise_shape import whitened
from sigdb.transmission import Transmission

TEETH, STEP, MATE = 4, 6, 10
N = TEETH * STEP


def template(stream, number, *, tooth, orders=(), size=1.0):
    return Template(
        case={"template": number, "tooth": tooth},
        signals=size * stream.standard_normal((1, N)),
        specimen_response=1e5 * stream.standard_normal((1, N, TEETH)),
        harmonic_response=0.3 * stream.standard_normal((1, N, len(orders), 2)),
        orders=np.array(orders, float),
        reference_variance=np.ones(1),
    )


@pytest.fixture
def stored():
    stream = np.random.default_rng(3)
    return [template(stream, i, tooth=min(i, 1), orders=(1.0, 3.0)) for i in range(4)]


def law(one, turn, noise, index_error):
    """Mean and covariance of an average with the damage `turn` teeth later, written out in the row's own frame."""
    angle = one.orders * turn * 2 * np.pi / TEETH
    phases = np.stack([np.cos(angle), np.sin(angle)], axis=1).ravel()
    mean = np.roll(one.signals[0] + one.harmonic_response[0].reshape(N, -1) @ phases, turn * STEP)
    turned = np.roll(np.eye(TEETH), -turn, axis=0)  # e turned back: the error of tooth j + turn at j
    response = np.roll(one.specimen_response[0], turn * STEP, axis=0) @ turned
    return mean, noise**2 * np.eye(N) + index_error**2 * response @ index_error_covariance(TEETH, MATE) @ response.T


def test_it_is_the_normal_density_of_every_template_at_every_tooth(stored):
    hypotheses = Hypotheses.from_templates(stored, teeth=TEETH, mate_teeth=MATE)
    x = np.random.default_rng(4).standard_normal((5, N))
    noise, index_error = np.array([0.5, 0.7, 0.1, 1.0, 0.3]), np.array([2e-6, 1e-6, 3e-6, 0.0, 1e-5])
    found = hypotheses.log_likelihood(x, noise=noise, index_error=index_error)
    assert found.shape == (5, 4, TEETH)
    for row in range(5):
        for k, one in enumerate(stored):
            for t in range(TEETH):
                turn = t if one.case["tooth"] else 0
                expected = multivariate_normal.logpdf(x[row], *law(one, turn, noise[row], index_error[row]))
                assert_allclose(found[row, k, t], expected, rtol=1e-10)


def test_the_squared_residual_is_that_of_the_normal_law_written_out(stored):
    """``r' S^-1 r``, which the law of chi-square of N degrees has for its own draws."""
    hypotheses = Hypotheses.from_templates(stored, teeth=TEETH, mate_teeth=MATE)
    x = np.random.default_rng(14).standard_normal((3, N))
    noise, index_error = np.array([0.5, 0.7, 0.1]), np.array([2e-6, 0.0, 3e-6])
    likelihood = hypotheses.log_likelihood(x, noise=noise, index_error=index_error)
    squares = hypotheses.chi2(likelihood, noise=noise, index_error=index_error)
    for row, (k, t) in enumerate([(1, 0), (2, 3), (0, 0)]):
        mean, covariance = law(stored[k], t, noise[row], index_error[row])
        residual = x[row] - mean
        assert_allclose(squares[row, k, t], residual @ np.linalg.solve(covariance, residual), rtol=1e-9)


def test_nuisances_add_their_covariance(stored):
    stream = np.random.default_rng(8)
    some = [replace(one, nuisance_modes=stream.standard_normal((1, N, 2 + one.tooth))) for one in stored]
    hypotheses = Hypotheses.from_templates(some, teeth=TEETH, mate_teeth=MATE)
    x, noise, index_error = stream.standard_normal((3, N)), np.array([0.5, 0.7, 0.1]), np.array([2e-6, 0.0, 2e-6])
    found = hypotheses.log_likelihood(x, noise=noise, index_error=index_error)
    for row in range(3):
        for k, one in enumerate(some):
            turn = 2 * one.tooth
            mean, covariance = law(one, turn, noise[row], index_error[row])
            turned = np.roll(one.nuisance_modes[0], turn * STEP, axis=0)
            covariance += turned @ turned.T
            assert_allclose(found[row, k, turn], multivariate_normal.logpdf(x[row], mean, covariance), rtol=1e-9)


def test_a_mixture_adds_the_densities_of_its_parts(stored):
    stream = np.random.default_rng(11)
    some = [
        replace(one, nuisance_modes=stream.standard_normal((1, N, 3)), nuisance_counts=np.array([2, 1]))
        for one in stored
    ]
    parts = (NuisancePart(0.5), NuisancePart(0.2, (0,), 0.5), NuisancePart(0.3, (0, 1)))
    certain = Hypotheses.from_templates(some, teeth=TEETH, mate_teeth=MATE)
    hypotheses = replace(certain, nuisances=replace(certain.nuisances, mixture=NuisanceMixture(parts=parts)))
    x = stream.standard_normal((2, N))
    found = hypotheses.log_likelihood(x, noise=0.5, index_error=2e-6)
    for k, one in enumerate(some):
        turn = 2 * one.tooth
        mean, covariance = law(one, turn, 0.5, 2e-6)
        turned = np.roll(one.nuisance_modes[0], turn * STEP, axis=0)
        first, every = 0.25 * turned[:, :2] @ turned[:, :2].T, turned @ turned.T
        expected = sum(
            part.weight * multivariate_normal.pdf(x, mean, covariance + added)
            for part, added in zip(parts, (0.0, first, every), strict=True)
        )
        assert_allclose(found[:, k, turn], np.log(expected), rtol=1e-9)


def test_a_late_mark_costs_a_law_little(stored):
    """The likelihood of an average whose mark is late is the integral over its lateness."""
    stream, sigma, teeth = np.random.default_rng(12), 0.2, TEETH
    certain = Hypotheses.from_templates(stored, teeth=TEETH, mate_teeth=MATE)
    nothing = Nuisances(modes=np.zeros((len(stored), N, 0)), counts=(), mixture=NuisanceMixture.certain(0, mark=sigma))
    signal = 0.3 * certain.signal + 20 * np.cos(2 * np.pi * teeth * np.arange(N) / N)
    certain = replace(certain, signal=signal)
    hypotheses = replace(certain, nuisances=nothing)
    rows = np.array([0, 1, 2])
    case = {"noise": 0.1, "index_error": 0.0}
    x = late(certain.draw(stream, rows, np.ones(3, int), **case), np.array([0.3, -0.25, 0.02]), teeth)
    found = hypotheses.log_likelihood(x, **case)
    places = np.linspace(-0.5, 0.5, 8001)
    for row in range(3):
        each = certain.log_likelihood(late(np.repeat(x[row : row + 1], len(places), 0), -places, teeth), **case)
        expected = logsumexp(
            each[:, row, 0]
            - (places / sigma) ** 2 / 2
            - np.log(sigma * np.sqrt(2 * np.pi))
            + np.log(places[1] - places[0])
        )
        assert_allclose(found[row, row, 0], expected, atol=0.15)  # of first order, and by Laplace


def test_draws_have_the_covariance_of_the_nuisances(stored):
    modes = np.random.default_rng(9).standard_normal((1, N, 3))
    hypotheses = Hypotheses.from_templates([replace(stored[1], nuisance_modes=modes)], teeth=TEETH, mate_teeth=MATE)
    rows = np.zeros(20_000, int)
    x = hypotheses.draw(np.random.default_rng(10), rows, rows + 1, noise=0.1, index_error=0.0)
    expected = 0.01 * np.eye(N) + modes[0] @ modes[0].T
    assert_allclose(np.cov(x.T), expected, atol=5 * np.abs(expected).max() / np.sqrt(10_000))


def test_parts_of_the_hypotheses_and_of_the_rows_give_the_same(stored):
    hypotheses = Hypotheses.from_templates(stored, teeth=TEETH, mate_teeth=MATE)
    x = np.random.default_rng(5).standard_normal((300, N))
    whole = hypotheses.log_likelihood(x, noise=0.4, index_error=2e-6)
    assert_allclose(
        hypotheses.only(np.array([3, 0])).log_likelihood(x[290:], noise=0.4, index_error=2e-6),
        whole[290:, [3, 0]],
        rtol=1e-12,
    )


@pytest.mark.parametrize("j", [1, 3])
def test_turning_the_average_turns_the_answer(j):
    stream = np.random.default_rng(6)
    hypotheses = Hypotheses.from_templates(
        [template(stream, i, tooth=1) for i in range(3)], teeth=TEETH, mate_teeth=MATE
    )
    x = stream.standard_normal((7, N))
    case = {"noise": 0.5, "index_error": 2e-6}
    turned = hypotheses.log_likelihood(np.roll(x, j * STEP, axis=1), **case)
    assert_allclose(turned, np.roll(hypotheses.log_likelihood(x, **case), j, axis=2), rtol=1e-12)


def test_little_noise_does_not_drown_the_differences_in_rounding():
    """At 90 dB squares of 10^10 cancel to tens; the residual itself, squared, has no such digits to lose."""
    stream = np.random.default_rng(7)
    stored = [template(stream, i, tooth=1) for i in range(3)]
    noise, index_error = 3e-5, 1e-10
    mean, covariance = law(stored[1], 2, noise, index_error)
    x = mean + noise * stream.standard_normal(N)
    near = np.array([multivariate_normal.logpdf(x, mean, covariance)])
    found = Hypotheses.from_templates(stored, teeth=TEETH, mate_teeth=MATE).log_likelihood(
        x[None], noise=noise, index_error=index_error
    )
    assert_allclose(found[0, 1, 2], near, atol=1e-3)
    assert found[0].argmax() == np.ravel_multi_index((1, 2), (3, TEETH))


def test_draws_follow_the_law(stored):
    """Mean and covariance of 40 000 draws, each entry within five of its standard errors."""
    hypotheses, draws = Hypotheses.from_templates(stored, teeth=TEETH, mate_teeth=MATE), 40_000
    place, tooth = np.full(draws, 2), np.full(draws, 4)
    x = hypotheses.draw(np.random.default_rng(8), place, tooth, noise=0.5, index_error=3e-6)
    mean, covariance = law(stored[2], 3, 0.5, 3e-6)
    deviation = np.sqrt(np.diag(covariance))
    assert (np.abs(x.mean(axis=0) - mean) < 5 * deviation / math.sqrt(draws)).all()
    error = np.sqrt((covariance**2 + np.outer(deviation, deviation) ** 2) / draws)
    assert (np.abs(np.cov(x.T) - covariance) < 5 * error).all()


def test_draws_of_a_healthy_gear_have_no_turn(stored):
    hypotheses = Hypotheses.from_templates(stored, teeth=TEETH, mate_teeth=MATE)
    x = hypotheses.draw(np.random.default_rng(9), np.zeros(6, int), np.arange(6) % 5, noise=1e-9, index_error=0.0)
    assert_allclose(x, np.tile(law(stored[0], 0, 1.0, 0.0)[0], (6, 1)), atol=1e-7)


def at_the_point(database, teeth):
    rows = database.cases(f"teeth = {teeth}")
    point = {name: rows[name].iloc[0].item() for name in ("speed_rpm", "torque", "teeth")}
    return rows, Hypotheses.of(database, **point)


def true_residuals(database, rows, teeth):
    """Rows turned back, less the clean averages of their templates with their own specimens' index errors."""
    tsa = database.signals(rows["id"].to_numpy())["tsa"].astype(float)
    templates, residuals = database.templates().set_index("template"), []
    for x, row in zip(tsa, rows.itertuples(), strict=True):
        turn, one = max(row.tooth, 1) - 1, templates.loc[row.template]
        errors = row.index_error * index_errors(specimen_stream(database.manifest.seed, row.specimen), teeth, 36)
        clean = one["tsa"] + np.reshape(one["specimen_response"], (-1, teeth)) @ np.roll(errors, -turn)
        residuals.append(np.roll(x, -turn * len(x) // teeth) - clean)
    return np.array(residuals)


def squares(database, rows, hypotheses):
    """(rows,) -2 log p less its constant under the true hypothesis: chi-square of n degrees of freedom.

    Also five standard deviations of their sum. Rows of a specimen share its index errors: their part, of teeth - 1
    degrees, is the same in all.
    """
    x, index_error = database.signals(rows["id"].to_numpy())["tsa"], rows["index_error"].to_numpy()
    noise = noise_deviation(hypotheses.reference_variance[0], rows["snr_db"].to_numpy())
    noise = noise / np.sqrt(rows["averages"].to_numpy())
    place = pd.Index(hypotheses.cases["template"]).get_indexer(pd.Index(rows["template"]))
    found = hypotheses.log_likelihood(x, noise=noise, index_error=index_error)
    found = found[np.arange(len(rows)), place, rows["tooth"].to_numpy() - 1]
    d = (hypotheses.gains[place] * (index_error / noise)[:, None]) ** 2
    n, freedom = x.shape[1], hypotheses.teeth - 1
    specimens = rows["specimen"].nunique()
    variance = 2 * len(rows) * (n - freedom) + 2 * freedom * len(rows) ** 2 / specimens
    return -2 * found - n * np.log(2 * np.pi * noise**2) - np.log1p(d).sum(axis=1), 5 * math.sqrt(variance)


@pytest.mark.parametrize("teeth", [12, 13])
def test_rows_of_a_database_follow_the_law(mixed_teeth, teeth):
    rows, hypotheses = at_the_point(mixed_teeth, teeth)
    square, tolerance = squares(mixed_teeth, rows, hypotheses)
    n = hypotheses.signal.shape[1]
    assert tolerance < 0.05 * n * len(rows)
    assert abs(square.sum() - n * len(rows)) < tolerance


@pytest.mark.parametrize("teeth", [12, 13])
def test_what_the_law_leaves_of_rows_whose_specimen_is_known_is_their_noise(mixed_teeth, teeth):
    rows, hypotheses = at_the_point(mixed_teeth, teeth)
    noise = noise_deviation(hypotheses.reference_variance[0], rows["snr_db"].to_numpy())
    noise = noise / np.sqrt(rows["averages"].to_numpy())
    white = (true_residuals(mixed_teeth, rows, teeth) / noise[:, None]) ** 2
    assert 1e-6 < chi2.sf(white.sum(), white.size) < 1 - 1e-6


def test_rows_with_unbalance_follow_the_law(make_database):
    """Its phase is fixed to the shaft, so as seen from the damage it turns with the tooth."""
    grid = 'tooth = "all"\nstiffness_loss = 0.3\npinion.unbalance = 5e-5'
    unbalanced = make_database(seed=6, specimens=3, healthy=2, grid=grid, snr_db=20.0)
    rows, hypotheses = at_the_point(unbalanced, 12)
    assert (rows["status"] == "ok").all()
    assert np.abs(hypotheses.harmonic).max() > 0
    rows = rows[rows["template"].isin(hypotheses.cases["template"])]
    square, tolerance = squares(unbalanced, rows, hypotheses)
    assert abs(square.sum() - 768 * len(rows)) < tolerance
    wrong, _ = squares(unbalanced, rows, replace(hypotheses, phases=np.roll(hypotheses.phases, 1, axis=2)))
    assert wrong.sum() - 768 * len(rows) > 5 * tolerance


def test_covariance_is_that_of_a_mate_that_is_not_swept(database):
    hypotheses = at_the_point(database, 12)[1]
    response = np.reshape(database.templates()["specimen_response"].iloc[3].astype(float), (-1, 12))
    modes = hypotheses.modes[3] * hypotheses.gains[3]
    expected = response @ index_error_covariance(12, 36) @ response.T
    assert_allclose(modes @ modes.T, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize(("mate_teeth", "runout"), [(30, 0.0), (36, 3.8)])
def test_covariance_is_that_of_the_template_its_own_mate_and_the_runout(make_database, mate_teeth, runout):
    """The mate's tooth count is swept: 12 teeth meet 36 in twelve groups, 30 in six. The row has such errors."""
    grid = "tooth = 1\nstiffness_loss = 0.2\ngear.teeth = [30, 36]"
    specimens = f"1\nrunout = {runout}"
    swept = make_database(seed=5, specimens=specimens, healthy=1, grid=grid, averages=180, snr_db=60.0)
    hypotheses = at_the_point(swept, 12)[1]
    assert len(hypotheses.cases) == 4
    of_mate = np.flatnonzero((hypotheses.cases["gear.teeth"] == mate_teeth) & ~hypotheses.healthy)[0]
    number = hypotheses.cases["template"].iloc[of_mate]
    stored = swept.templates().set_index("template").loc[number, "specimen_response"]
    response = np.reshape(stored.astype(float), (-1, 12))
    modes = hypotheses.modes[of_mate] * hypotheses.gains[of_mate]
    expected = response @ index_error_covariance(12, mate_teeth, runout=runout) @ response.T
    assert_allclose(modes @ modes.T, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    row = swept.cases(f"template = {number}").iloc[0]
    errors = row["index_error"] * index_errors(specimen_stream(5, int(row["specimen"])), 12, mate_teeth, runout=runout)
    change = swept.signals([row["id"]])["tsa"][0] - hypotheses.signal[of_mate]
    assert_allclose(change, response @ errors, rtol=0, atol=0.01 * np.std(hypotheses.signal[of_mate]))


def test_the_true_hypothesis_is_the_most_likely_where_there_is_little_noise(database):
    rows, hypotheses = at_the_point(database, 12)
    noise = noise_deviation(hypotheses.reference_variance[0], rows["snr_db"].to_numpy())
    noise /= np.sqrt(rows["averages"].to_numpy())
    tsa = database.signals(rows["id"].to_numpy())["tsa"]
    found = hypotheses.log_likelihood(tsa, noise=noise, index_error=rows["index_error"].to_numpy())
    best = found.reshape(len(rows), -1).argmax(axis=1)
    template, tooth = hypotheses.cases["template"].to_numpy()[best // 12], best % 12 + 1
    healthy = rows["tooth"].to_numpy() == 0
    assert np.array_equal(template, rows["template"])
    assert np.array_equal(np.where(healthy, 0, tooth), rows["tooth"])


def test_some_templates_by_sql(database):
    rows, hypotheses = at_the_point(database, 12)
    some = Hypotheses.of(
        database, speed_rpm=14400.0, torque=rows["torque"].iloc[0].item(), teeth=12, where="damaged_teeth < 2"
    )
    assert set(some.cases["damaged_teeth"]) == {0, 1}
    assert len(hypotheses.cases) == 9
    assert some.healthy.tolist() == [True, *[False] * 4]


def test_an_operating_point_without_templates_is_refused(database):
    with pytest.raises(InputError, match=r"no template at speed_rpm = 9, torque = 9, teeth = 12 .* take an operating"):
        Hypotheses.of(database, speed_rpm=9.0, torque=9.0, teeth=12)


def test_a_rig_that_does_not_turn_exactly_is_refused(database, monkeypatch):
    monkeypatch.setattr(Transmission, "turns_exactly", lambda self, gear: False)
    with pytest.raises(InputError, match="templates that are turned are those of rigs with one mesh"):
        Hypotheses.of(database, speed_rpm=14400.0, torque=1.0, teeth=12)


def test_averages_of_another_length_or_without_noise_are_refused(stored):
    hypotheses = Hypotheses.from_templates(stored, teeth=TEETH, mate_teeth=MATE)
    with pytest.raises(InputError, match=r"x has the shape \(3, 23\); give rows of 24 samples"):
        hypotheses.log_likelihood(np.zeros((3, N - 1)), noise=1.0, index_error=0.0)
    with pytest.raises(InputError, match="noise = 0 must be above 0"):
        hypotheses.log_likelihood(np.zeros((3, N)), noise=[1.0, 0.0, 1.0], index_error=0.0)


def test_ratios_in_coloured_noise_are_those_of_the_normal_law_written_out(stored):
    hypotheses = Hypotheses.from_templates(stored, teeth=TEETH, mate_teeth=MATE)
    shape = shape_of(np.array([3, 0, -6]), N, TEETH)
    colour = np.fft.irfft(np.fft.rfft(np.eye(N), axis=1) * shape**2, N, axis=1)
    x = np.random.default_rng(22).standard_normal((2, N))
    laws = hypotheses.turned.whitened(shape)
    ratios = laws.log_likelihood(whitened(x, shape), noise=0.4, index_error=2e-6)
    for row in range(2):
        for k, t in ((1, 0), (2, 3), (3, 1)):
            densities = []
            for place, turn in ((k, t), (0, 0)):
                mean, covariance = law(stored[place], turn, 0.4, 2e-6)
                coloured = covariance + 0.4**2 * (colour - np.eye(N))
                densities.append(multivariate_normal.logpdf(x[row], mean, coloured))
            assert_allclose(ratios[row, k, t] - ratios[row, 0, 0], densities[0] - densities[1], rtol=1e-8)
