"""Averaged signals to named features, as a step of a scikit-learn pipeline."""

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from sigdb.core import FloatArray, InputError, check_unmasked, suggestion
from sigdb.signature import INDICATORS, features, mesh_bands

FEATURES = ("indicators", "spectrum", "wigner_ville")
"""Kinds of features."""


class SignatureTransformer(TransformerMixin, BaseEstimator):
    """Transformer of averages of one revolution to indicators, spectrum and pooled Wigner-Ville distribution.

    There is nothing to learn: ``fit`` checks the options against the count of samples and names the features. They are
    those of :func:`sigdb.signature.features`, and mean the same as a database's columns of the same names.

    Parameters
    ----------
    teeth
        Tooth count of the gear on the averaged shaft.
    features
        Kinds of features, in the order of the output:

        - ``"indicators"``, those of :data:`sigdb.signature.INDICATORS` by their names;
        - ``"spectrum"``, the peak amplitudes of all orders, ``order_0``, ``order_1``, ...;
        - ``"wigner_ville"``, by tooth and by the centre of the band in mesh orders, ``wigner_ville_1_0``,
          ``wigner_ville_1_0.25``, ..., in the square of the unit of the averages.
    mesh_harmonics, shaft_harmonics, sidebands
        Options of the indicators, as in :func:`sigdb.signature.indicators`.
    mesh_orders
        Up to which mesh order the bands of ``"wigner_ville"`` are centred, a quarter of one apart.

    Attributes
    ----------
    n_features_in_
        Samples a revolution.
    feature_names_in_
        Names of the columns of X, where it has any.

    Notes
    -----
    Indicators without a denominator are nan (a signal without variance, a separation that leaves nothing); put an
    imputer behind this step where that can happen.

    Examples
    --------
    >>> import numpy as np
    >>> from sklearn.linear_model import LogisticRegression
    >>> from sklearn.pipeline import make_pipeline
    >>> from sklearn.preprocessing import StandardScaler
    >>> from sigdb.recognition import SignatureTransformer
    >>> stream, theta = np.random.default_rng(0), 2 * np.pi * np.arange(768) / 768
    >>> damaged = np.arange(40) % 2
    >>> mesh = (1 + 0.5 * damaged[:, None] * np.exp(-50 * (theta - 3) ** 2)) * np.cos(12 * theta)
    >>> X = mesh + 0.1 * stream.normal(size=mesh.shape)
    >>> model = make_pipeline(SignatureTransformer(teeth=12), StandardScaler(), LogisticRegression())
    >>> model.fit(X[:20], damaged[:20]).score(X[20:], damaged[20:])
    1.0
    """

    def __init__(
        self,
        teeth: int,
        *,
        features: Sequence[str] = ("indicators", "wigner_ville"),
        mesh_harmonics: int | None = None,
        shaft_harmonics: int = 2,
        sidebands: int = 1,
        mesh_orders: int = 4,
    ) -> None:
        self.teeth = teeth
        self.features = features
        self.mesh_harmonics = mesh_harmonics
        self.shaft_harmonics = shaft_harmonics
        self.sidebands = sidebands
        self.mesh_orders = mesh_orders

    def fit(self, X: ArrayLike, y: Any = None) -> Self:
        """Check the options and name the features.

        Parameters
        ----------
        X
            Averages, (signals, samples); sample 0 at the tacho mark.
        y
            Not used.
        """
        x = _checked(self, X, reset=True)
        self._names = [name for kind in self._kinds() for name in self._names_of(kind, x.shape[1])]
        self._features(x[:1])
        return self

    def transform(self, X: ArrayLike) -> FloatArray:
        """Compute the features of averages.

        Parameters
        ----------
        X
            Averages, (signals, samples), of as many samples as at ``fit``.

        Returns
        -------
        (signals, features) float64
            In the order of ``get_feature_names_out``.
        """
        check_is_fitted(self)
        return self._features(_checked(self, X, reset=False))

    def get_feature_names_out(self, input_features: ArrayLike | None = None) -> NDArray[np.object_]:
        """Return the names of the features.

        Parameters
        ----------
        input_features
            Names of the samples; they do not matter.
        """
        check_is_fitted(self)
        if input_features is not None and len(np.asarray(input_features)) != self.n_features_in_:
            raise InputError(
                f"input_features should have length equal to n_features_in_ = {self.n_features_in_}, the samples of a"
                " revolution; leave it out"
            )
        return np.array(self._names, dtype=object)

    def _kinds(self) -> list[str]:
        kinds = [self.features] if isinstance(self.features, str) else list(self.features)
        for kind in kinds:
            if kind not in FEATURES:
                raise InputError(f"SignatureTransformer: features has {kind!r}{suggestion(str(kind), FEATURES)}")
        if not kinds or len(set(kinds)) < len(kinds):
            raise InputError(f"SignatureTransformer: features = {kinds} must name at least one kind, each once")
        return kinds

    def _names_of(self, kind: str, n: int) -> list[str]:
        if kind == "indicators":
            return list(INDICATORS)
        if kind == "spectrum":
            return [f"order_{order}" for order in range(n // 2 + 1)]
        centres = np.arange(len(self._bands(n)) - 1) / 4
        return [f"wigner_ville_{tooth}_{centre:g}" for tooth in range(1, self.teeth + 1) for centre in centres]

    def _features(self, x: FloatArray) -> FloatArray:
        names = [name for kind in self._kinds() for name in _columns_of(kind)]
        if "wigner_ville" in names:
            self._bands(x.shape[1])
        values = features(
            x,
            teeth=self.teeth,
            names=names,
            mesh_harmonics=self.mesh_harmonics,
            shaft_harmonics=self.shaft_harmonics,
            sidebands=self.sidebands,
            mesh_orders=self.mesh_orders,
        )
        return np.concatenate([values[name].reshape(len(x), -1) for name in names], axis=1)

    def _bands(self, n: int) -> FloatArray:
        bands = mesh_bands(self.teeth, mesh_orders=self.mesh_orders)
        if bands[-1] > n / 2:
            raise InputError(
                f"SignatureTransformer: mesh_orders = {self.mesh_orders} needs bands up to order {bands[-1]:g}, but"
                f" {n} samples a revolution have orders up to {n / 2:g}; ask for fewer, or leave out 'wigner_ville'"
            )
        return bands


def _columns_of(kind: str) -> list[str]:
    return list(INDICATORS) if kind == "indicators" else [kind]


def _checked(transformer: SignatureTransformer, X: ArrayLike, *, reset: bool) -> FloatArray:
    """Samples as a finite array, by scikit-learn's own rules."""
    check_unmasked("SignatureTransformer", "X", X)
    return validate_data(transformer, X, dtype=[np.float64, np.float32], reset=reset)
