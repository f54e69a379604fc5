"""The learners: two behind a shared-tooth scorer of pooled features, linear and boosted, and a bank of templates."""

from sklearn.base import BaseEstimator
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import HistGradientBoostingClassifier, HistGradientBoostingRegressor
from sklearn.feature_selection import VarianceThreshold
from sklearn.linear_model import RidgeCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from sigdb.core.errors import InputError

LEARNERS = {
    "lda": "shrinkage linear discriminant analysis",
    "boosting": "gradient boosting of histograms",
    "templates": "likelihoods of a bank of templates, calibrated",
}
"""Learners by name."""

POOLED = ("lda", "boosting")
"""Those that look at pooled Wigner-Ville features."""


def tooth_scorer(learner: str, random_state: int) -> BaseEstimator:
    """An unfitted binary classifier with a ``decision_function``.

    Raises
    ------
    InputError
        If there is no such learner.
    """
    _check(learner)
    if learner == "lda":
        return LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto")
    return HistGradientBoostingClassifier(max_iter=100, early_stopping=False, random_state=random_state)


def severity_regressor(learner: str, random_state: int) -> BaseEstimator:
    """An unfitted regressor: the linear partner of LDA, or boosting."""
    _check(learner)
    if learner == "lda":
        # Columns that do not vary, such as the speed of one operating point, have no scale.
        return make_pipeline(VarianceThreshold(), StandardScaler(), RidgeCV(alphas=(1.0, 10.0, 100.0, 1000.0)))
    return HistGradientBoostingRegressor(max_iter=100, early_stopping=False, random_state=random_state)


def _check(learner: str) -> None:
    if learner not in POOLED:
        raise InputError(f"learner = {learner!r} is not known; choose one of {', '.join(POOLED)}")
