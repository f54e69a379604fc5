"""Presence of a gear in a recording: does its mesh stand out of the noise, and does it repeat each revolution?"""

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray, IntArray, NotApplicableError
from sigdb.recording.evidence.order_combs import ALARM, HARMONICS, OTHERS, ROUNDING, OrderCombs, combined
from sigdb.recording.lines import hann_power

_LIKE_NEIGHBOURS = 0.5
"""Probability above which the mesh orders are no higher than the orders about them."""
_RIVAL = 1.25, 15.0
"""Evidence of another comb of orders, as a multiple of that of the mesh and a sum, above which it is another gear."""
_LINE = 1e-6
"""Probability below which a single order is a line."""
_MOST_PARTS, _LEAST_LINES = 12, 4
"""Parts of a mesh order, and multiples of one, that are tested for another part's lines."""
_SIDEBANDS = 3
"""Pairs of sidebands about each harmonic, and shaft orders, that are tested."""
_ABOUT, _LEAST_BINS, _GUARD = 0.15, 6, 2
"""Reach of a line's surroundings: in orders, at least these bins, without those of the line's own lobe."""
_HANN = 1.94
"""Bins of a Hann window in one independent bin: 1 + 2 (2/3)^4 + 2 (1/6)^4, squared correlations of neighbours."""
_USED = 0.9
"""Share of the highest order below which the record is flat."""
_MOST = 2048
"""Largest number of revolutions that are tested."""
_PRIMES = (2, 3, 5, 7)
_LEAST_P = 1e-99
"""Probability below which only the bound is printed."""


class NoMeshError(NotApplicableError):
    """A recording gives no angle of the shaft by the phase of a mesh: no mesh of that gear stands out of it."""


@dataclass(frozen=True, kw_only=True)
class MeshPresence:
    """Answer to the question whether a gear is to be seen in a recording, with its statistics.

    Attributes
    ----------
    present
        Whether the gear is to be seen. Without it, indicators of the average would be those of noise.
    reason
        Finding in words, for people.
    unverified
        Whether harmonics of one mesh stand out though nothing repeats once a revolution, by the phase of the mesh.
        Only another recording of the gear at that speed can then show that they are of this gear.
    p_value
        Probability that noise alone gives as much: ``p_mesh`` by a tacho, ``p_revolution`` by the phase of the mesh.
    p_mesh
        Probability that noise alone gives such lines at the mesh harmonics. By the phase of the mesh it is no evidence,
        since the phase was fitted to one of them.
    p_revolution
        Probability that noise alone gives such lines at sidebands and shaft orders, which repeat once a revolution.
    p_neighbours
        Probability that mesh orders of the same level as the orders about them are as high.
    spacing
        Greatest common divisor of the whole orders with a line; 0 without lines. It is 1 where the average repeats once
        a revolution, and the tooth count Z for a mesh without sidebands.
    kept_by_noise
        Share of its rms that noise alone keeps in the average: one over the root of the averages.
    """

    present: bool
    reason: str
    p_value: float
    p_mesh: float = math.nan
    p_revolution: float = math.nan
    p_neighbours: float = math.nan
    spacing: int = 0
    kept_by_noise: float = math.nan
    unverified: bool = False


def mesh_presence(
    x: FloatArray,
    *,
    samples_per_rev: int,
    teeth: int,
    highest: float,
    others: Collection[int] = (),
    mates: Collection[float] = (),
    mesh_phase: bool = False,
    power: FloatArray | None = None,
) -> MeshPresence:
    r"""Test whether the mesh of a gear stands out of a record.

    Let X be the spectrum of M whole revolutions under a Hann window, and q(k) the power at order k over the mean power
    of the N independent bins within 0.15 orders of it, without the line's own lobe. An average keeps what is at whole
    orders; what is between them is the scatter between its revolutions. Noise gives q the F distribution with 2 and 2N
    degrees of freedom, whatever its colour [1]_, and the probabilities of several orders are combined by [2]_ ::

        p(k) = (1 + q(k) / N)^(-N),        p = P(chi^2_{2K} > -2 sum_{k=1}^K ln p(k)).

    - ``p_mesh``: K orders h Z, h = 1..8, within nine tenths of the record's range.
    - ``p_revolution``: sidebands h Z + s and shaft orders s, s = 1, 2, 3 to both sides. The phase of the mesh follows
      no sideband, so this holds where angle and speed were fitted to the record too. Tones that repeat d times a
      revolution are no proof: the greatest p of the orders that are no multiples of d = 2, 3, 5, 7 counts. A single
      line is none either: p of sidebands and mesh harmonics together, without the two smallest p(k), counts too. Orders
      m and h Z +- m of a mate's shaft between whole orders are tested likewise, and twice the smaller p counts.
    - ``p_neighbours``: q is the power of the average at h Z over the median of its whole orders about it. The median is
      worth 0.48 of as many means.

    The gear is present where ``p_value`` is at most 0.001 and all of these hold: ``p_neighbours`` is at most 0.5, no
    comb ``h Z + s``, ``|s| > 2``, and no mesh of another tooth count has 1.25 E + 15 of evidence, where E, a sum of
    -ln p like p_neighbours', is the evidence of this one. Orders of a half or a third of the teeth have at most
    E + 10, and no more than a tenth of the mesh's power or ten times that of all others. The lines have no common
    spacing of another gear, or the sidebands between them stand out, with a p of at most 0.01 for all of them together
    or the strongest of them. Spaced by 2, they are an oval gear's where none is farther than that from a mesh harmonic.
    Harmonics that are no multiples of 2, or 3, stand out as well, with a combined p of at most 0.01; else the gear has
    twice or three times as many teeth. It has d times as many where the multiples of harmonic d are higher than the
    orders about them, with a p of at most 0.001, and the other harmonics are not, with one above 0.01, or have less
    than a hundredth of their power. A single line is a gear's only where no line between the whole orders is stronger.
    By the phase of the mesh, fewer than half of the multiples of Z / n that are no whole orders are lines, for n of 3
    to 12 that are no mate's: a bearing's impacts are no mesh.

    Parameters
    ----------
    x
        (M * samples_per_rev,) record in equal steps of angle.
    samples_per_rev
        Samples of a revolution.
    teeth
        Tooth count Z.
    highest
        Highest order of the record.
    others
        Tooth counts of other gears on the shaft.
    mates
        Orders of the shafts that the gear meshes with.
    mesh_phase
        Whether the angle was taken from the phase of the mesh.
    power
        :func:`sigdb.recording.lines.hann_power` of the record's first 2048 revolutions, where it is known.

    Returns
    -------
    MeshPresence

    References
    ----------
    .. [1] Thomson, "Spectrum estimation and harmonic analysis", Proceedings of the IEEE 70(9), 1982,
       doi:10.1109/PROC.1982.12433: the F test of a line against the noise about it.
    .. [2] Fisher, Statistical Methods for Research Workers, 4th edition, 1932, section 21.1.

    Examples
    --------
    >>> stream, theta = np.random.default_rng(0), 2 * np.pi * np.arange(50 * 256) / 256
    >>> noise = stream.normal(size=theta.size)
    >>> mesh_presence(noise, samples_per_rev=256, teeth=12, highest=128).present
    False
    >>> mesh_presence(0.2 * np.cos(12 * theta) + noise, samples_per_rev=256, teeth=12, highest=128).present
    True
    """
    n, Z = samples_per_rev, teeth
    M = min(len(x) // n, _MOST)
    top = int(min(_USED * highest, n // 2 - 1, (HARMONICS + 0.5) * Z))
    orders: IntArray = np.arange(1, max(top, 0) + 1)
    spectrum = _Spectrum(hann_power(x[: M * n]) if power is None else power, M)
    line = np.concatenate([[0.0], spectrum.log_p(orders)])
    mesh = orders[orders % Z == 0]
    about = np.minimum(orders % Z, -orders % Z)
    side = orders[(about > 0) & (about <= _SIDEBANDS)]
    combs = OrderCombs(np.abs(np.fft.rfft(x[: M * n].reshape(M, n).mean(axis=0))[: top + 1]) ** 2, Z)
    lines = np.flatnonzero(line < math.log(_LINE))
    spacing = int(np.gcd.reduce(lines, initial=0))
    oval = spacing == 2 and Z % 2 == 0 and np.all(np.minimum(lines % Z, -lines % Z) <= 2)
    if oval or (spacing > 1 and _any_lines(line[side[side % spacing > 0]]) <= OTHERS):
        spacing = 1  # Pitch errors of a low order are strong; the other orders are weak.
    p_mesh, p_revolution = combined(line[mesh]), _p_revolution(line, side, mesh)
    sums = [order for m in mates for order in (m, *(mesh - m), *(mesh + m))]
    between = np.array([order for order in sums if order < top and abs(order * M - round(order) * M) > _GUARD + 1])
    if len(between) >= 2:
        log_p = spectrum.log_p(between)
        by_mate = max(combined(log_p), combined(np.sort(np.concatenate([log_p, line[mesh]]))[2:]))
        p_revolution = min(1.0, 2 * min(p_revolution, by_mate))
    rival, evidence = combs.rival(others)
    values = {
        "p_value": p_revolution if mesh_phase else p_mesh,
        "p_mesh": p_mesh,
        "p_revolution": p_revolution,
        "p_neighbours": combined(combs.log_p(mesh)),
        "spacing": spacing,
        "mesh_lines": float(np.count_nonzero(lines % Z == 0)),
        "multiple": max(_multiple(line, mesh, Z), combs.multiple(mesh)),
    }
    rival = rival if evidence > _RIVAL[0] * combs.evidence(mesh) + _RIVAL[1] else ""
    strongest = int(mesh[np.argmin(line[mesh])]) if mesh.size else 0
    if combined(np.sort(line[np.concatenate([side, mesh])])[1:]) > ALARM and spectrum.stronger_between(strongest, top):
        rival = rival or "tones between the orders of the shaft"
    if mesh_phase and not rival:
        rival = _part_of_mesh(spectrum, Z, top, mates)
    doubt = _doubt(values, Z, rival, any_mesh=bool(mesh.size), mesh_phase=mesh_phase)
    if not doubt and (part := combs.part_of_teeth(mesh, others)):
        doubt = _doubt(values, Z, part, any_mesh=True, mesh_phase=mesh_phase)
    others_fit = not rival and values["multiple"] == 1 and values["spacing"] == Z
    unverified = bool(doubt) and mesh_phase and others_fit and combined(np.sort(line[mesh])[1:]) <= ALARM
    kept = {name: values[name] for name in ("p_value", "p_mesh", "p_revolution", "p_neighbours")}
    return MeshPresence(
        present=not doubt,
        reason=doubt or f"the mesh of {Z} teeth stands out: noise alone gives as much with {_p(values['p_value'])}",
        spacing=int(values["spacing"]),
        kept_by_noise=1 / math.sqrt(max(M, 1)),
        unverified=unverified,
        **kept,
    )


def _part_of_mesh(spectrum: "_Spectrum", Z: int, top: int, mates: Collection[float]) -> str:
    """Return the part of the mesh order at whose multiples lines lie between whole orders, in words; empty for none."""
    for n in range(_MOST_PARTS, 2, -1):
        orders = np.arange(1, int(top * n / Z)) * Z / n
        orders = orders[np.abs(orders - np.round(orders)) > 0.5 / n]
        if len(orders) < _LEAST_LINES or any(abs(mate - Z / n) < 1e-3 * mate for mate in mates):
            continue
        if np.mean(spectrum.log_p(orders) < math.log(_LINE)) >= 0.5:
            return f"multiples of order {Z / n:.3f}, as of a bearing's impacts,"
    return ""


def _any_lines(log_p: FloatArray) -> float:
    """Return the probability that noise alone gives such lines: together, or the strongest one, whichever is rarer."""
    if not log_p.size:
        return 1.0
    return min(1.0, 2 * min(combined(log_p), len(log_p) * math.exp(float(log_p.min()))))


def _p(p: float) -> str:
    return f"p = {p:.1g}" if p >= _LEAST_P else f"p below {_LEAST_P:g}"


def _doubt(values: dict[str, float], Z: int, rival: str, *, any_mesh: bool, mesh_phase: bool) -> str:
    """Return why the gear is not present; empty if it is."""
    none = f"no mesh of {Z} teeth stands out of this recording"
    pulses = "" if mesh_phase else ", pulses_per_rev and ratio"
    p, spacing, multiple = values["p_value"], int(values["spacing"]), int(values["multiple"])
    if not any_mesh:
        return f"{none}: its mesh lies above the record's range"
    if rival:
        check = f"check the tooth count{pulses}, or give the rig if the shaft has other gears"
        return f"{none}: {rival} stand out more; {check}"
    if not p <= ALARM:
        tones = mesh_phase and values["p_mesh"] <= ALARM and spacing > 0 and spacing % Z == 0
        what = (
            "tones lie at its mesh orders, but nothing repeats once a revolution"
            if tones
            else "nothing repeats once a revolution more than noise does"
            if mesh_phase
            else "the average keeps what noise keeps"
        )
        return f"{none}: {what} (p = {p:.2g})"
    if spacing > 1 and spacing != Z and values["mesh_lines"]:
        return f"{none}: all lines are at multiples of order {spacing}, as of another gear or of tones"
    if multiple > 1:
        return f"{none}: only multiples of its mesh harmonic {multiple} do, as of a gear of {multiple * Z} teeth"
    if not values["p_neighbours"] <= _LIKE_NEIGHBOURS:
        return f"{none}: its mesh orders are no higher than the orders about them"
    return ""


class _Spectrum:
    """Power of M whole revolutions under a Hann window, with bins 1/M apart."""

    def __init__(self, power: FloatArray, M: int) -> None:
        self._P = power
        self._M = M

    def log_p(self, orders: IntArray | FloatArray) -> FloatArray:
        """Return the logarithm of p(k) for each order, at its nearest bin."""
        P, M = self._P, self._M
        floor = max(float(P.max()) * ROUNDING, np.finfo(float).tiny)
        reach = max(round(_ABOUT * M), _LEAST_BINS)
        distance = np.arange(-reach, reach + 1)
        centres = np.round(orders * M).astype(int)
        bins = centres[:, None] + distance[np.abs(distance) > _GUARD]
        inside = (bins > _GUARD) & (bins < len(P))
        count = inside.sum(axis=1)
        level = np.where(inside, P[np.where(inside, bins, 0)], 0).sum(axis=1) / np.maximum(count, 1)
        N = count / _HANN
        return np.asarray(-N * np.log1p(P[centres] / np.maximum(level, floor) / np.maximum(N, 1)))

    def stronger_between(self, order: int, top: int) -> bool:
        """Return whether a line between the whole orders up to a highest one is stronger than a whole order.

        The greatest of B powers of noise exceeds ``ln(B / 0.001)`` times their mean with a probability of 0.001.
        """
        P, M = self._P[: top * self._M + 1], self._M
        bins = np.arange(len(P))
        between = (np.minimum(bins % M, -bins % M) > _GUARD) & (bins > M / 2)
        if not between.any():
            return False
        noise = float(np.median(P[between])) / math.log(2) * math.log(between.sum() / ALARM)
        return bool(P[between].max() > max(float(P[order * M]), noise))


def _p_revolution(line: FloatArray, side: IntArray, mesh: IntArray) -> float:
    """Return p of what repeats once a revolution, and no more often."""
    alone = [combined(line[side[side % d > 0]]) for d in _PRIMES]
    return max(combined(line[side]), *alone, combined(np.sort(line[np.concatenate([side, mesh])])[2:]))


def _multiple(line: FloatArray, mesh: IntArray, Z: int) -> int:
    """Return 2 or 3 where no other mesh harmonics stand out than its multiples; else 1."""
    h = mesh // Z
    return next((d for d in (3, 2) if combined(line[mesh[h % d > 0]]) > OTHERS), 1)
