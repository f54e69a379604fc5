"""MiniRocket of averages with aeon: a peer of the models of sigdb.

A. Dempster, D. F. Schmidt, G. I. Webb, "MiniRocket: a very fast (almost) deterministic transform for time series
classification", KDD 2021, doi:10.1145/3447548.3467231.
"""

from typing import Self

import numpy as np
import pandas as pd
from aeon.transformations.collection.convolution_based import MiniRocket
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler


class Rocket(ClassifierMixin, BaseEstimator):
    """MiniRocket's features, and a logistic regression with a class for each tooth and one for none."""

    def __init__(self, kernels: int = 2000, seed: int = 0) -> None:
        self.kernels = kernels
        self.seed = seed

    def fit(self, X: pd.DataFrame, y: NDArray[np.int64]) -> Self:
        """Train on averages (rows, n) and first damaged teeth, 0 for none."""
        self._transform = MiniRocket(n_kernels=self.kernels, random_state=self.seed)
        features = self._transform.fit_transform(_series(X))
        self._regression = make_pipeline(StandardScaler(), LogisticRegression(C=1e-3, max_iter=300))
        self._regression.fit(features, y)
        self.classes_ = self._regression.classes_
        return self

    def predict_proba(self, X: pd.DataFrame) -> NDArray[np.float64]:
        """Return the probabilities of the classes."""
        return self._regression.predict_proba(self._transform.transform(_series(X)))

    def predict(self, X: pd.DataFrame) -> NDArray[np.int64]:
        """Return the most probable answers."""
        return self._regression.predict(self._transform.transform(_series(X)))


def _series(X: pd.DataFrame) -> NDArray[np.float32]:
    x = np.asarray(X, np.float32)
    return (x / x.std())[:, None, :]
