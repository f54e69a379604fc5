"""Stiffness of one tooth pair along its contact, as a rig file describes it: one class a kind.

Every class offers:

- ``contact_ratio``, the length of a pair's contact in tooth passes, from first touch to last;
- ``pitch_point``, its place in passes after first contact;
- ``mean_stiffness``, N/m, or None where only the shape is known;
- ``pair_stiffness(x)`` for a mesh of unit mean stiffness: the sum over pairs, a pass apart, has mean 1;
- ``separation(x)``, m, by which the flanks of a pair with damaged geometry are apart where sound ones touch.
"""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import SerializerFunctionWrapHandler, Strict, model_serializer, model_validator

from sigdb.core import FloatArray, InputError, quantity, without_defaults
from sigdb.transmission.damage import ToothDamage
from sigdb.transmission.parts.described import Described


def raised_cosine(x: FloatArray) -> FloatArray:
    """From 0 at x <= 0 to 1 at x >= 1.

    Examples
    --------
    >>> import numpy as np
    >>> raised_cosine(np.array([-1.0, 0.5, 2.0])).round(3).tolist()
    [0.0, 0.5, 1.0]
    """
    return (1 - np.cos(np.pi * np.clip(x, 0, 1))) / 2


Values = Annotated[tuple[float, ...], Strict(False)]
MOST_PASSES = 16
"""A pair's contact is shorter than this, in passes."""


class Profile(Described):
    """Base of every kind of profile."""

    @property
    def mean_stiffness(self) -> float | None:
        """Mean mesh stiffness that follows from the profile, N/m."""
        return None

    @property
    def profile_shifts(self) -> tuple[float, float]:
        """Profile shifts of the driving and the driven gear that the profile knows, in normal modules."""
        return 0.0, 0.0

    def separation(self, x: FloatArray) -> FloatArray:
        """Deviation of the flanks of a pair from contact at x passes after first contact, along the normal, m.

        It is that of damage of the geometry, and 0 for sound pairs.
        """
        return np.zeros_like(x)

    def damaged(self, damage: ToothDamage, teeth: int, driving: bool | None) -> Self:
        """The profile of a pair of which a tooth's geometry is damaged, on the gear of that many teeth.

        Where both gears have as many, ``driving`` says which of them.

        Raises
        ------
        InputError
            If the profile knows no geometry, or the damage does not fit it.
        """
        name = damage.flaws[0]
        raise InputError(
            f"{name} = {getattr(damage, name)} needs the geometry of the teeth; give the mesh a profile of "
            "kind = 'energy-method', as sigdb new-rig --energy-method writes it, or say with stiffness_loss what the "
            "damage does"
        )


class Trapezoid(Profile):
    """Stiffness of one tooth pair along its contact: a rising flank, a plateau, a falling flank.

    The contact is ``contact_ratio`` tooth passes long, each flank ``flank`` passes; flanks are raised cosines,
    so that results converge with the time grid. The pitch point is taken to be at its middle.
    """

    kind: Literal["trapezoid"] = quantity("-", "Kind of profile.", default="trapezoid")
    contact_ratio: float = quantity("pass", "Length of one pair's contact, in tooth passes.", ge=1, lt=MOST_PASSES)
    flank: float = quantity("pass", "Length of each flank, in tooth passes.", gt=0)

    @model_validator(mode="after")
    def _flanks_fit(self) -> Self:
        if 2 * self.flank > self.contact_ratio:
            raise ValueError(f"flank = {self.flank} must be at most half of contact_ratio = {self.contact_ratio}")
        return self

    @model_serializer(mode="wrap")
    def _as_used(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return without_defaults(self, handler(self), ("kind",))

    @property
    def pitch_point(self) -> float:
        """Place of the pitch point, in passes after first contact."""
        return self.contact_ratio / 2

    def pair_stiffness(self, x: FloatArray) -> FloatArray:
        """Stiffness of a pair at x passes after first contact."""
        return trapezoid(x, self.contact_ratio, self.flank)


class HarmonicProfile(Profile):
    """Mesh stiffness by its harmonics: ``k = kbar (1 + sum_n amplitude_n cos(2 pi n u - phase_n))``, u in passes.

    A tooth's share of it is that of its own pass: a window of raised cosines, one pass and one flank long, whose sum
    over the teeth is 1. So the healthy mesh has these harmonics alone, and damage changes what is within the window.
    The pitch point is taken to be at the window's middle.
    """

    kind: Literal["harmonic"] = quantity("-", "Kind of profile.", default="harmonic")
    amplitudes: Values = quantity(
        "-", "Amplitude of each harmonic of the mesh frequency, as a fraction of the mean.", min_length=1
    )
    phases_deg: Values = quantity("deg", "Angle of the pass at which each is greatest; 0 if left out.", default=())
    flank: float = quantity("pass", "Length over which a tooth's pass gives way to the next.", gt=0, le=1, default=0.1)

    @model_validator(mode="after")
    def _positive(self) -> Self:
        if self.phases_deg and len(self.phases_deg) != len(self.amplitudes):
            raise ValueError(f"phases_deg has {len(self.phases_deg)} values and amplitudes {len(self.amplitudes)}")
        least = self._mesh(np.arange(4096) / 4096).min()
        if least <= 0:
            raise ValueError(
                f"amplitudes = {list(self.amplitudes)} take the mesh stiffness down to {least:.3g} of its mean; "
                "it must stay above 0"
            )
        return self

    @property
    def contact_ratio(self) -> float:
        """Length of a pair's window, in passes."""
        return 1 + self.flank

    @property
    def pitch_point(self) -> float:
        """Place of the pitch point, in passes after first contact."""
        return self.contact_ratio / 2

    def pair_stiffness(self, x: FloatArray) -> FloatArray:
        """Stiffness of a pair at x passes after first contact."""
        return trapezoid(x, self.contact_ratio, self.flank) * self._mesh(x)

    def _mesh(self, u: FloatArray) -> FloatArray:
        phases = np.deg2rad(self.phases_deg or (0.0,) * len(self.amplitudes))
        waves = (
            a * np.cos(2 * np.pi * n * u - phase)
            for n, (a, phase) in enumerate(zip(self.amplitudes, phases, strict=True), start=1)
        )
        return 1 + sum(waves, start=np.zeros_like(u))


class Table(Profile):
    """A curve of one pair's stiffness over its contact: shape-preserving cubic (PCHIP) between the given places.

    The contact begins and ends within a flank whose middle is at the ends of the curve. With the mesh's ``stiffness``
    given only the curve's shape counts, else its values do. The pitch point is taken to be at its middle.
    """

    kind: Literal["table"] = quantity("-", "Kind of profile.", default="table")
    places: Values = quantity("pass", "Places along the contact, ascending from 0 at its beginning.", min_length=2)
    pair_stiffnesses: Values = quantity("N/m", "Stiffness of the pair at each place.", min_length=2)
    flank: float = quantity("pass", "Length over which a pair takes up and gives up its load.", gt=0)

    @model_validator(mode="after")
    def _curve_fits(self) -> Self:
        if len(self.places) != len(self.pair_stiffnesses):
            raise ValueError(
                f"places has {len(self.places)} values and pair_stiffnesses {len(self.pair_stiffnesses)}; give as many"
            )
        if self.places[0] != 0 or min(np.diff(self.places)) <= 0:
            raise ValueError(f"places = {list(self.places)} must begin with 0 and ascend")
        if min(self.pair_stiffnesses) <= 0:
            raise ValueError(f"pair_stiffnesses = {list(self.pair_stiffnesses)} must be greater than 0")
        check_contact(self.places[-1], self.flank)
        return self

    @property
    def contact_ratio(self) -> float:
        """Length of a pair's contact, in passes: of the curve and half a flank at each end."""
        return self.places[-1] + self.flank

    @property
    def pitch_point(self) -> float:
        """Place of the pitch point, in passes after first contact."""
        return self.contact_ratio / 2

    @property
    def mean_stiffness(self) -> float:
        """The curve's area, N/m."""
        return _table_area(self.places, self.pair_stiffnesses, self.flank)

    def pair_stiffness(self, x: FloatArray) -> FloatArray:
        """Stiffness of a pair at x passes after first contact."""
        curve = _curve(self.places, self.pair_stiffnesses)
        return smooth_ends(curve, x, self.contact_ratio, self.flank) / self.mean_stiffness


def trapezoid(x: FloatArray, contact_ratio: float, flank: float) -> FloatArray:
    """A plateau between raised cosines, of area 1."""
    rise, fall = raised_cosine(x / flank), raised_cosine((contact_ratio - x) / flank)
    return rise * fall / (contact_ratio - flank)


def smooth_ends(
    curve: Callable[[FloatArray], FloatArray], x: FloatArray, contact_ratio: float, flank: float
) -> FloatArray:
    """A curve over a contact that begins and ends by raised cosines, centred at the curve's ends and held beyond."""
    within = np.clip(x - flank / 2, 0, contact_ratio - flank)
    return curve(within) * raised_cosine(x / flank) * raised_cosine((contact_ratio - x) / flank)


def area(curve: Callable[[FloatArray], FloatArray], contact_ratio: float, flank: float) -> float:
    """Integral of the smoothed curve over the contact."""
    x = np.linspace(0, contact_ratio, 8193)
    return float(np.trapezoid(smooth_ends(curve, x, contact_ratio, flank), x))


@lru_cache(maxsize=64)
def _table_area(places: tuple[float, ...], stiffnesses: tuple[float, ...], flank: float) -> float:
    return area(_curve(places, stiffnesses), places[-1] + flank, flank)


def check_contact(length: float, flank: float) -> None:
    """Refuse a contact that is shorter than one pass or longer than any, or flanks that meet.

    Raises
    ------
    ValueError
        If it is not.
    """
    if not 1 <= length < MOST_PASSES - flank:
        raise ValueError(f"the contact is {length:.4g} passes long; it must be 1 to {MOST_PASSES - flank:g}")
    if flank > length:
        raise ValueError(f"flank = {flank} must be at most the contact, {length:.4g} passes")


def kind(value: Any) -> str | None:
    """Which profile a table of a rig file describes; the trapezoid where it does not say."""
    if isinstance(value, Mapping):
        return value.get("kind", "trapezoid")
    return getattr(value, "kind", None)


def _curve(places: tuple[float, ...], stiffnesses: tuple[float, ...]) -> Callable[[FloatArray], FloatArray]:
    """A curve through the values of a table that rises and falls with them."""
    from scipy.interpolate import PchipInterpolator  # its import takes as long as the rest of scipy

    curve: Callable[[FloatArray], FloatArray] = PchipInterpolator(places, stiffnesses)
    return curve
