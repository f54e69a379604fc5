"""Probability that each tooth is damaged, where two teeth apart may be."""

import numpy as np
from scipy.special import softmax

from sigdb.core import FloatArray, InputError, IntArray
from sigdb.recognition.fusion.joint_law import AverageLaw

APART = 3
"""Least distance of two damaged teeth apart, in tooth passes: contacts are shorter, and damage nearer is a pattern."""


def damaged_tooth_probabilities(
    law: AverageLaw, x: FloatArray, *, noise: float, index_error: float, two_apart: float = 0.5
) -> FloatArray:
    """Return the probability that each tooth is the first of a damage, for averages with none, one or two damages.

    The change by two damages is taken to be the sum of both changes. Index errors act as on a sound gear. None and some
    damage are equally likely beforehand, and so are all templates and teeth.

    Parameters
    ----------
    law
        Law of the averages, with a healthy template.
    x
        (rows, n) averages from the tacho mark, in the unit of the signal.
    noise
        Standard deviation of the noise of an average.
    index_error
        Size of the index errors, m.
    two_apart
        Probability, given damage, that two teeth at least three passes apart are damaged. Gears of five teeth or fewer
        have no such two, so that all damage is of one tooth.

    Returns
    -------
    ndarray, (rows, teeth)
        They need not add up to 1.

    Raises
    ------
    InputError
        If the noise is not above 0, two_apart is not a probability, or averages have another length than the law.
    """
    if not 0 <= two_apart <= 1:
        raise InputError(f"two_apart = {two_apart:g} must be a probability, from 0 to 1")
    if not noise > 0:
        raise InputError(f"noise = {noise:g} must be above 0: without noise there is no density")
    if x.ndim != 2 or x.shape[1] != law.samples:
        raise InputError(f"x has the shape {x.shape}; give rows of {law.samples} samples")
    sound, changes, of_tooth = _changes(law)
    none = np.flatnonzero(law.healthy)[0]
    spread = law.response[none] * (index_error / noise)
    inner = np.linalg.inv(np.eye(spread.shape[1]) + spread.T @ spread)
    whitened = (changes - (changes @ spread) @ inner @ spread.T) / noise**2
    gram = whitened @ changes.T
    single = (x - sound) @ whitened.T - np.diag(gram) / 2
    distance = np.abs(np.subtract.outer(of_tooth, of_tooth))
    first, second = np.nonzero(np.triu(np.minimum(distance, law.teeth - distance) >= APART))
    double = single[:, first] + single[:, second] - gram[first, second]
    double_share = two_apart if len(first) else 0.0
    with np.errstate(divide="ignore"):
        prior = np.log([(1 - double_share) / len(changes), double_share / max(1, len(first))])
    parts = np.hstack([np.zeros((len(x), 1)), single + prior[0], double + prior[1]])
    share = softmax(parts, axis=1)
    ones, pairs = share[:, 1 : 1 + len(changes)], share[:, 1 + len(changes) :]
    probability = np.zeros((len(x), law.teeth))
    for teeth, shares in ((of_tooth, ones), (of_tooth[first], pairs), (of_tooth[second], pairs)):
        np.add.at(probability.T, teeth, shares.T)
    return probability


def _changes(law: AverageLaw) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the sound average (n,), the change by each template at each tooth (changes, n), and the teeth of these."""
    means = np.einsum("kbt,kbn->ktn", law.weights, law.carriers)
    damaged, step = np.flatnonzero(~law.healthy), law.samples // law.teeth
    sound = means[np.flatnonzero(law.healthy)[0], 0]
    turned = [np.roll(means[damaged, tooth], tooth * step, axis=1) for tooth in range(law.teeth)]
    return sound, np.concatenate(turned) - sound, np.repeat(np.arange(law.teeth), len(damaged))
