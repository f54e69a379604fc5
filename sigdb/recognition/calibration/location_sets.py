"""Conformal sets of teeth whose coverage holds for each severity, noise and operating point."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import log_softmax

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.recognition.calibration.cells import band_edges, band_thresholds, bands, cells_of
from sigdb.recognition.calibration.conformal import BY_CELL, OVER_ALL, greatest_quantile, specimen_quantile
from sigdb.recognition.calibration.probabilities import calibrate, specimen_folds_of, with_none


class LocationSets:
    """Sets of a location classifier, for estimators with the parameter ``coverage``.

    The set of a record holds an answer y, 'none' or a tooth, where ``-log p(y) <= q(y, noise)``, with p the calibrated
    probability. It always holds the most probable answer. 'None' and the teeth have separate thresholds q, set in each
    band of noise. A threshold is the greatest conformal quantile by specimen over severities and operating points
    (:func:`greatest_quantile`). If severity were part of the label, a tooth would be in the set where it is there with
    any severity. Since p(y) does not depend on severity, the greatest threshold gives the same set.

    Take a row of a further specimen, with a severity, operating point and band of noise of the training rows. Its set
    holds the truth with a probability of at least ``coverage``. This probability is an average over specimens and over
    the rows of the cell; it need not hold for each specimen. Severities and operating points between those of
    training, and other noise within a band, are covered as far as they resemble those of training. Coverage beyond the
    range of training is not claimed.

    With ``coverage_by = "all"`` there is one threshold, for all answers and all noise. Sets are smaller, and coverage
    is an average over all rows: plain damage is then always covered, and hidden damage more rarely.

    Attributes
    ----------
    set_edges_
        (bands - 1,) edges between bands of noise, dB.
    set_thresholds_
        (bands, 2) greatest -log probability within a set, of 'none' and of a tooth.
    """

    coverage: float
    coverage_by: str = BY_CELL
    set_edges_: FloatArray
    set_thresholds_: FloatArray

    def _fit_sets(
        self,
        strange: FloatArray,
        tooth: IntArray,
        severity: FloatArray,
        *,
        point: IntArray,
        noise: FloatArray,
        groups: IntArray,
    ) -> None:
        """Set the thresholds from -log probabilities of the truth (rows,) and severities (rows, k)."""
        if self.coverage_by == OVER_ALL:
            self.set_edges_ = np.array([])
            self.set_thresholds_ = np.full((1, 2), specimen_quantile(strange, groups, self.coverage))
            return
        self.set_edges_ = band_edges(noise, groups, self.coverage)
        band = bands(self.set_edges_, noise)
        cells = cells_of(point, severity)
        self.set_thresholds_ = np.array(
            [
                [
                    greatest_quantile(strange[some], cells[some], groups[some], self.coverage)
                    for some in ((band == number) & (tooth == 0), (band == number) & (tooth > 0))
                ]
                for number in range(len(self.set_edges_) + 1)
            ]
        )

    def _sets(self, scores: FloatArray, noise: FloatArray) -> BoolArray:
        """(rows, teeth + 1) the sets of rows with these scores of 'none' and of each tooth, and this noise."""
        limit = band_thresholds(self.set_thresholds_, self.set_edges_, noise)
        limit = limit[:, np.minimum(np.arange(scores.shape[1]), 1)]
        sets = np.asarray((-log_softmax(scores, axis=1) <= limit) & np.isfinite(scores))
        # A set is not empty: the most probable answer only adds to the coverage.
        sets[np.arange(len(sets)), scores.argmax(axis=1)] = True
        return sets


def strangeness(scores: FloatArray, tooth: IntArray, groups: IntArray, offset: ArrayLike = 0.0) -> FloatArray:
    """(rows,) -log probability of the truth, calibrated on other specimens; arguments as of :func:`calibrate`."""
    strange, offset = np.empty(len(tooth)), np.broadcast_to(offset, len(tooth))
    for inner, outer in specimen_folds_of(groups):
        slope, none = calibrate(scores[inner], tooth[inner], offset[inner])
        stacked = with_none(scores[outer], slope, none + offset[outer])
        strange[outer] = -log_softmax(stacked, axis=1)[np.arange(len(outer)), tooth[outer]]
    return strange
