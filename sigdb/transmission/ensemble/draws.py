"""Draws from what is assumed of a rig, spread evenly over its unit cube."""

from collections.abc import Iterator

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.transmission.ensemble.assumption import Choice
from sigdb.transmission.rig import Transmission

Seed = int | np.random.SeedSequence | np.random.Generator | None
"""Anything that numpy makes a random generator of."""

_AT_ONCE = 64
"""Points that the sequence makes together: a power of 2, as it asks for."""


def draws(rig: Transmission, rng: Seed = None) -> Iterator[dict[str, Choice]]:
    """Yield values of a rig's free numbers without end, for :meth:`~sigdb.transmission.Transmission.with_assumed`.

    They are the points of a scrambled Sobol sequence [1]_, so the first ones do not depend on how many are drawn.

    Parameters
    ----------
    rig
        A rig with assumed numbers.
    rng
        Seed or generator that scrambles the sequence.

    Raises
    ------
    InputError
        If nothing of the rig is free.

    References
    ----------
    .. [1] A. B. Owen, "Scrambling Sobol' and Niederreiter-Xing points", Journal of Complexity 14 (1998) 466-489,
           doi:10.1006/jcom.1998.0487.

    Examples
    --------
    >>> import sigdb
    >>> rig = sigdb.load_transmission("nasa-spiral-bevel")
    >>> values = next(draws(rig, rng=1))
    >>> 0.025 <= values["damping_ratio"] <= 0.06
    True
    """
    assumptions = rig.assumptions
    if not assumptions.free:
        raise InputError(
            f"rig {rig.name!r} has no assumed number with a range or choices to draw from; give it some, for example "
            "assumed.damping_ratio = { low = 0.02, high = 0.05 }"
        )
    return (assumptions.from_unit(u) for u in _points(len(assumptions.free), rng))


def _points(dimensions: int, rng: Seed) -> Iterator[FloatArray]:
    from scipy.stats import qmc  # slow to load

    engine = qmc.Sobol(dimensions, rng=np.random.default_rng(rng))
    while True:
        yield from engine.random(_AT_ONCE)
