"""Features of an average: spectrum, indicators and pooled Wigner-Ville distribution, by one recipe.

A sweep stores these features. Recordings and :class:`sigdb.recognition.SignatureTransformer` compute them with the same
function, so that a feature means the same everywhere. :data:`FEATURES` describes the columns of a database.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sigdb.core import SIGNALS_AT_ONCE, InputError, blocks, suggestion
from sigdb.signature.checks import Float64Array, count, real_signal
from sigdb.signature.gear_orders import gear_orders
from sigdb.signature.indicators.indicator_table import INDICATORS, indicators_of
from sigdb.signature.indicators.moment_kernels import as_float
from sigdb.signature.spectrum import one_sided
from sigdb.signature.wigner_ville.lag_window import analytic_of
from sigdb.signature.wigner_ville.pooled import mesh_band_matrix, mesh_bands, pooled_products, three_bins

_MESH_ORDERS = 4
"""Default mesh order at which the last band is centred."""


@dataclass(frozen=True, kw_only=True)
class Feature:
    """A feature of an average, as columns of a database describe it.

    Attributes
    ----------
    name
        Key in the result of :func:`features`, and name of the column.
    unit
        ``"signal"`` for the unit of the average, ``"(signal)^2"`` for its square, ``"-"`` for none.
    axes
        Axes of the values of one average: none for a number, ``("order",)``, or ``("tooth", "band")``.
    help
        Description in one sentence.
    formula
        The definition in one line of text.
    """

    name: str
    unit: str
    axes: tuple[Literal["order", "tooth", "band"], ...] = ()
    help: str
    formula: str

    def shape(self, *, teeth: int, n: int, mesh_orders: int = _MESH_ORDERS) -> tuple[int, ...]:
        """Return the shape of the values of one average.

        Parameters
        ----------
        teeth : int
            Tooth count of the gear on the averaged shaft.
        n : int
            Samples a revolution.
        mesh_orders : int
            Mesh order at which the last band is centred.

        Returns
        -------
        tuple of int
            One length for each of ``axes``; ``()`` for a number.
        """
        lengths = {"order": n // 2 + 1, "tooth": teeth, "band": len(mesh_bands(1, mesh_orders=mesh_orders)) - 1}
        return tuple(lengths[axis] for axis in self.axes)


_TABLE = (
    Feature(
        name="spectrum",
        unit="signal",
        axes=("order",),
        help="Order spectrum, peak amplitudes at orders 0, 1, 2 ...",
        formula="|2/n FFT|, DC and Nyquist not doubled",
    ),
    *(
        Feature(name=indicator.name, unit=indicator.unit, help=indicator.help, formula=indicator.formula)
        for indicator in INDICATORS.values()
    ),
    Feature(
        name="wigner_ville",
        unit="(signal)^2",
        axes=("tooth", "band"),
        help="Pooled Wigner-Ville distribution: (tooth passes, bands a quarter mesh order wide).",
        formula="sum of W over tooth pass and band / (n_bins n / teeth)",
    ),
)

FEATURES: Mapping[str, Feature] = MappingProxyType({feature.name: feature for feature in _TABLE})
"""Every feature by its name, in the order of :func:`features`."""


def features(
    tsa: ArrayLike,
    *,
    teeth: int,
    names: Collection[str] | None = None,
    mesh_harmonics: int | None = None,
    shaft_harmonics: int = 2,
    sidebands: int = 1,
    mesh_orders: int = _MESH_ORDERS,
) -> dict[str, Float64Array]:
    """Compute the features of averages: the columns that a database holds.

    Parameters
    ----------
    tsa : array_like, (..., n)
        Real averages of one revolution, in any unit; sample 0 at the tacho mark.
    teeth : int
        Tooth count Z of the gear on the averaged shaft; below n/2.
    names : collection of str, optional
        Names of :data:`FEATURES` to compute; all by default.
    mesh_harmonics, shaft_harmonics, sidebands
        Options of the separation, as in :func:`indicators`.
    mesh_orders : int
        Mesh order at which the last band of ``wigner_ville`` is centred; the bands are a quarter of one apart.

    Returns
    -------
    dict of float64 arrays
        By name, in the order of :data:`FEATURES`. ``spectrum`` has the shape (..., n//2 + 1), ``wigner_ville``
        (..., Z, 4 ``mesh_orders`` + 1), an indicator (...), or a float for one average. An indicator without a
        denominator is nan.

    Raises
    ------
    InputError
        If ``tsa`` is empty, complex or not finite, a count is too small or not an integer, an order is not below n/2,
        or a name is unknown.

    Notes
    -----
    The pooled Wigner-Ville distribution has three bins in a band and a Hamming lag window of two tooth passes, at most
    half a revolution. It is divided by the count of bins and by the samples of a tooth pass. So a value means the same
    for any tooth count.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import features
    >>> x = np.cos(2 * np.pi * 12 * np.arange(768) / 768)
    >>> values = features(x, teeth=12)
    >>> values["spectrum"].shape, values["wigner_ville"].shape, round(values["peak_to_peak"], 3)
    ((385,), (12, 17), 2.0)
    """
    x, eps = real_signal("features", "tsa", tsa)
    wanted, n = _checked_names(names), x.shape[-1]
    signals = x.reshape(-1, n)
    computed: list[dict[str, Float64Array]] = []
    for some in blocks(max(len(signals), 1), SIGNALS_AT_ONCE):
        values: dict[str, Float64Array] = {}
        if not wanted.isdisjoint(INDICATORS):
            orders = gear_orders("features", n, teeth, mesh_harmonics, shaft_harmonics, sidebands, least_mesh=1)
            values |= indicators_of(signals[some], teeth, orders, eps)
        if not wanted.isdisjoint({"spectrum", "wigner_ville"}):
            X = np.fft.rfft(signals[some])
            values["spectrum"] = np.abs(X * one_sided(n))
        if "wigner_ville" in wanted:
            values["wigner_ville"] = _pooled(X, count("features", "teeth", teeth, least=1, most=n), n, mesh_orders)
        computed.append(values)
    shapes = {name: (*x.shape[:-1], *computed[0][name].shape[1:]) for name in FEATURES if name in wanted}
    every = {name: np.concatenate([some[name] for some in computed]).reshape(shape) for name, shape in shapes.items()}
    return {name: as_float(values) for name, values in every.items()}


def _checked_names(names: Collection[str] | None) -> set[str]:
    wanted = set(FEATURES if names is None else names)
    for name in sorted(wanted - set(FEATURES)):
        raise InputError(f"features: names has {name!r}{suggestion(name, list(FEATURES))}")
    return wanted


def _pooled(X: NDArray[np.complex128], teeth: int, n: int, mesh_orders: int) -> Float64Array:
    cells = pooled_products(analytic_of(X, n), teeth, mesh_band_matrix(n, teeth, mesh_orders))
    return cells / (three_bins(n, teeth) * n / teeth)
