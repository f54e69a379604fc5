"""Disturbances: what may differ between a measurement and the law that a model was trained on.

They are drawn anew, from exact changes of rigs and averages, and share nothing with the modes of nuisances.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TypeAlias

import numpy as np

from sigdb.core import FloatArray, InputError, validated
from sigdb.transmission import Range, ToothDamage, Transmission, built_in_transmissions, load_transmission

Stream: TypeAlias = np.random.Generator
DamagedTeeth: TypeAlias = Mapping[int, ToothDamage]

RigChange: TypeAlias = Callable[[Transmission, str, Stream], Transmission]
"""Changes a rig, given the averaged gear."""

AverageChange: TypeAlias = Callable[[FloatArray, int, Stream], FloatArray]
"""Changes clean averages (rows, n) of so many teeth."""

StatedNuisance: TypeAlias = Callable[[int], Mapping[str, float]]
"""Numbers of a section ``[nuisance]``, given the tooth count."""

Noise: TypeAlias = Callable[[Stream, int, int, int], FloatArray]
"""Draws the mean over revolutions of white noise, times the root of their number: (rows, n) for so many revolutions."""

NoiseColour: TypeAlias = Callable[[int, int], FloatArray]
"""Deviation of noise at each order (n / 2 + 1,) over that of white noise of the same variance, given n and teeth."""

DamageChange: TypeAlias = Callable[[DamagedTeeth, int], DamagedTeeth]
"""Changes the damage of a gear of so many teeth."""


def path(x: FloatArray, teeth: int, stream: Stream, *, db: float, deg: float, orders: float) -> FloatArray:
    """Filter averages by random paths: gain in dB and phase are smooth over a distance of orders, 0 for a mesh order.

    Each is a sum of sixteen waves over the order, of random phase and of wave numbers that make it Gaussian.
    """
    k, width = np.arange(x.shape[1] // 2 + 1), orders or float(teeth)

    def smooth() -> FloatArray:
        number = stream.standard_normal((len(x), 16, 1)) / width
        phase = stream.uniform(0, 2 * np.pi, (len(x), 16, 1))
        return np.asarray(np.cos(number * k + phase).sum(axis=1) * np.sqrt(2 / 16))

    gain = 10 ** (db * smooth() / 20) * np.exp(1j * np.radians(deg) * smooth())
    return np.fft.irfft(np.fft.rfft(x, axis=1) * gain, x.shape[1], axis=1)


def gain(x: FloatArray, teeth: int, stream: Stream, *, db: float) -> FloatArray:
    """Multiply averages by a gain."""
    return x * 10 ** (db / 20)


def late_mark(x: FloatArray, teeth: int, stream: Stream, *, passes: float) -> FloatArray:
    """Delay averages by a part of a tooth pass."""
    k = np.arange(x.shape[1] // 2 + 1)
    return np.fft.irfft(np.fft.rfft(x, axis=1) * np.exp(-2j * np.pi * passes / teeth * k), x.shape[1], axis=1)


def modulation(x: FloatArray, teeth: int, stream: Stream, *, depth: float) -> FloatArray:
    """Modulate the amplitude of averages once a revolution, with random phases."""
    angle = 2 * np.pi * np.arange(x.shape[1]) / x.shape[1]
    return x * (1 + depth * np.cos(angle + stream.uniform(0, 2 * np.pi, (len(x), 1))))


def ghost(x: FloatArray, teeth: int, stream: Stream, *, share: float) -> FloatArray:
    """Add an order of the gear's making, between one and two and a half mesh orders, of a share of the deviation."""
    others = [k for k in range(teeth + 2, 5 * teeth // 2) if k % teeth]
    order = stream.choice(others, (len(x), 1))
    angle = 2 * np.pi * np.arange(x.shape[1]) / x.shape[1]
    wave = np.cos(order * angle + stream.uniform(0, 2 * np.pi, (len(x), 1)))
    return x + np.sqrt(2) * share * x.std(axis=1, keepdims=True) * wave


def lost_pulses(x: FloatArray, teeth: int, stream: Stream, *, share: float) -> FloatArray:
    """Average over revolutions of which some are two that were taken for one, since the pulse between is missing."""
    n = x.shape[1]
    twice = x[:, (2 * np.arange(n)) % n]
    weight = share / (1 - share)
    return (1 - weight) * x + weight * twice


def low_orders(samples: int, teeth: int) -> FloatArray:
    """Colour noise by a low-pass of first order whose corner is the mesh order."""
    k = np.arange(samples // 2 + 1)
    shape = 1 / np.sqrt(1 + (k / teeth) ** 2)
    power = np.r_[shape[:1] ** 2, 2 * shape[1:-1] ** 2, shape[-1:] ** 2].sum() / samples
    return np.asarray(shape / np.sqrt(power))


def gaussian(stream: Stream, rows: int, samples: int, revolutions: int) -> FloatArray:
    """Draw normal noise."""
    return stream.standard_normal((rows, samples))


def bursts(stream: Stream, rows: int, samples: int, revolutions: int) -> FloatArray:
    """Draw noise in bursts: Student's t with three degrees of freedom, of one variance."""
    noise = np.empty((rows, samples))
    for row in noise:
        drawn = stream.standard_t(3, (revolutions, samples))
        row[:] = drawn.mean(axis=0) * np.sqrt(revolutions) / drawn.std()
    return noise


def at_speed(rig: Transmission, gear: str, stream: Stream, *, share: float) -> Transmission:
    """Return the rig at another speed."""
    return rig.replace({"operating.speed_rpm": rig.operating.speed_rpm * (1 + share)})


def at_torque(rig: Transmission, gear: str, stream: Stream, *, share: float) -> Transmission:
    """Return the rig under another torque."""
    return rig.replace({"operating.torque": rig.operating.torque * (1 + share)})


def with_profile(rig: Transmission, gear: str, stream: Stream, *, amplitude: float) -> Transmission:
    """Return the rig with a profile deviation, m."""
    data = rig.model_dump()
    for name in rig.meshes_of(gear):
        data["meshes"][name]["profile_error"] = {"amplitude": amplitude}
    return validated(Transmission, data, owner=rig.name)


def another_rig(rig: Transmission, gear: str, stream: Stream, *, share: float) -> Transmission:
    """Return the rig with each assumed number changed by up to a share, inside its range."""
    values = rig.assumptions.values_of(rig)
    changed: dict[str, float | str] = {}
    for number in rig.assumptions.free:
        value, domain = values.get(number.path), number.domain
        if isinstance(domain, Range) and isinstance(value, float | int):
            changed[number.path] = min(max(value * stream.uniform(1 - share, 1 + share), domain.low), domain.high)
    return rig.with_assumed(changed) if changed else rig


def soft_form(rig: Transmission, gear: str, stream: Stream) -> Transmission:
    """Return the built-in rig of the same machine with softer supports, at the same operating point.

    Raises
    ------
    InputError
        If there is none.
    """
    name = f"{rig.name}-soft"
    if name not in built_in_transmissions():
        raise InputError(f"there is no built-in rig {name!r}")
    at = {f"operating.{key}": getattr(rig.operating, key) for key in ("speed_rpm", "torque")}
    return load_transmission(name).replace(at)


def apart(damage: DamagedTeeth, teeth: int) -> DamagedTeeth:
    """Damage the tooth across as well, where one is damaged."""
    return {**damage, **{1 + (tooth - 1 + teeth // 2) % teeth: each for tooth, each in list(damage.items())[:1]}}


def beyond_grid(damage: DamagedTeeth, teeth: int) -> DamagedTeeth:
    """Raise the stiffness loss of damaged teeth to 0.7."""
    return {tooth: each.model_copy(update={"stiffness_loss": 0.7}) for tooth, each in damage.items()}


def worn(damage: DamagedTeeth, teeth: int) -> DamagedTeeth:
    """Wear the dedendum of all teeth by 3 to 5 micrometres, evenly over them but for a wave."""
    depths = 4e-6 + 1e-6 * np.cos(2 * np.pi * np.arange(teeth) / teeth)
    changed = {}
    for tooth, depth in enumerate(depths.tolist(), 1):
        present = damage.get(tooth, ToothDamage())
        wear = {"flank_deviation": depth, "deviation_extent": 0.4, "deviation_place": 0.25}
        changed[tooth] = present.model_copy(update=wear)
    return changed


def no_nuisance(teeth: int) -> Mapping[str, float]:
    """Return no numbers."""
    return {}


def stated(**numbers: float) -> StatedNuisance:
    """Return numbers of a section ``[nuisance]`` whatever the tooth count."""
    return lambda teeth: numbers


def stated_path(db: float, deg: float, orders: float) -> StatedNuisance:
    """Return the numbers of a path that is smooth over some orders, 0 for a mesh order."""
    return lambda teeth: {"path_db": db, "path_deg": deg, "path_orders": orders or float(teeth)}


@dataclass(frozen=True, kw_only=True)
class Disturbance:
    """A difference between rows and the law of a model.

    Attributes
    ----------
    name, text
        Its name in tables, and a description.
    rig
        Change of the rig; None for none.
    rigs
        Number of different rigs that it draws.
    averages
        Changes of the clean averages, one after the other.
    noise
        Law of the noise.
    colour
        Its deviation by order; white for None.
    scatter
        Relative variance that it adds to the scatter between revolutions, per variance of the average, and not to the
        average.
    damage
        Change of the damage; None for none.
    index_error
        Factor of the index errors.
    nuisance
        Numbers of a section ``[nuisance]`` that state the disturbance, for a gear of so many teeth; none where no
        section states it.
    same_question
        Whether the damage is still one that the best possible answer is known for.
    """

    name: str
    text: str
    rig: RigChange | None = None
    rigs: int = 1
    averages: tuple[AverageChange, ...] = ()
    noise: Noise = gaussian
    colour: NoiseColour | None = None
    scatter: float = 0.0
    damage: DamageChange | None = None
    index_error: float = 1.0
    nuisance: StatedNuisance = no_nuisance
    same_question: bool = field(default=True)

    @property
    def is_stated(self) -> bool:
        """Whether the law of the best possible answer can have the disturbance."""
        return bool(self.nuisance(1)) or self.colour is not None or self.index_error != 1.0


NOTHING = Disturbance(name="nothing", text="rows of the law without nuisances")

_SMALL = Disturbance(
    name="all small",
    text="path 1 dB, 7 deg; gain 1 dB; speed 1 % high; load 3 % low; mark 0.03 of a pass late; modulation 5 %; assumed "
    "numbers 5 % off, all together",
    rig=lambda rig, gear, stream: at_torque(
        at_speed(another_rig(rig, gear, stream, share=0.05), gear, stream, share=0.01), gear, stream, share=-0.03
    ),
    rigs=4,
    averages=(
        partial(path, db=1.0, deg=7.0, orders=0.0),
        partial(gain, db=1.0),
        partial(late_mark, passes=0.03),
        partial(modulation, depth=0.05),
    ),
    nuisance=lambda teeth: {
        "path_db": 1.0,
        "path_deg": 7.0,
        "path_orders": float(teeth),
        "gain_db": 1.0,
        "speed": 0.01,
        "torque": 0.03,
        "mark": 0.03,
        "modulation": 0.05 / np.sqrt(2),
        "rig": 0.05,
    },
)

DISTURBANCES: tuple[Disturbance, ...] = (
    NOTHING,
    *(
        Disturbance(
            name=f"path {db:g} dB, {'mesh order' if not orders else f'{orders:g} orders'}",
            text=f"a path of {db:g} dB and {deg:g} deg, smooth over {'a mesh order' if not orders else '2 orders'}",
            averages=(partial(path, db=db, deg=deg, orders=orders),),
            nuisance=stated_path(db, deg, orders),
        )
        for db, deg in ((1.0, 7.0), (3.0, 20.0), (6.0, 45.0))
        for orders in (2.0, 0.0)
    ),
    Disturbance(
        name="gain 3 dB", text="a gain of 3 dB", averages=(partial(gain, db=3.0),), nuisance=stated(gain_db=3.0)
    ),
    Disturbance(
        name="speed", text="the speed 3 % high", rig=partial(at_speed, share=0.03), nuisance=stated(speed=0.03)
    ),
    Disturbance(name="load", text="the load 10 % low", rig=partial(at_torque, share=-0.1), nuisance=stated(torque=0.1)),
    *(
        Disturbance(
            name=f"mark {passes:g}",
            text=f"the mark {passes:g} of a tooth pass late",
            averages=(partial(late_mark, passes=passes),),
            nuisance=stated(mark=passes),
        )
        for passes in (0.1, 0.4)
    ),
    *(
        Disturbance(
            name=f"modulation {depth:.0%}",
            text=f"amplitude modulation by the shaft, {100 * depth:g} %",
            averages=(partial(modulation, depth=depth),),
            nuisance=stated(modulation=depth / np.sqrt(2)),
        )
        for depth in (0.05, 0.2)
    ),
    *(
        Disturbance(
            name=f"carrier {depth:.0%}",
            text=f"amplitude modulation by a carrier or the mate's shaft, {100 * depth:g} %, which averages out",
            scatter=depth**2 / 2,
        )
        for depth in (0.05, 0.2)
    ),
    *(
        Disturbance(
            name=f"profile {microns:g} um",
            text=f"a profile deviation of {microns:g} um",
            rig=partial(with_profile, amplitude=microns * 1e-6),
            nuisance=stated(profile=microns * 1e-6),
        )
        for microns in (1.0, 3.0)
    ),
    *(
        Disturbance(
            name=f"ghost {share:g}",
            text=f"a ghost order of {share:g} of the signal's deviation",
            averages=(partial(ghost, share=share),),
        )
        for share in (0.1, 0.3)
    ),
    Disturbance(
        name="pulses", text="5 % of the pulses missed", averages=(partial(lost_pulses, share=0.05),), scatter=0.1
    ),
    Disturbance(name="coloured noise", text="noise of the same scatter below the mesh order", colour=low_orders),
    Disturbance(name="bursts", text="noise of the same scatter after Student, three degrees of freedom", noise=bursts),
    Disturbance(name="index errors", text="index errors twice as large", index_error=2.0),
    Disturbance(
        name="rig 20 %",
        text="assumed numbers up to 20 % off",
        rig=partial(another_rig, share=0.2),
        rigs=8,
        nuisance=stated(rig=0.2),
    ),
    Disturbance(name="soft form", text="the soft form of the rig", rig=soft_form),
    Disturbance(name="two teeth", text="the tooth across damaged as well", damage=apart, same_question=False),
    Disturbance(name="beyond", text="a stiffness loss of 0.7", damage=beyond_grid, same_question=False),
    Disturbance(name="worn", text="a gear with worn dedenda", damage=worn, same_question=False),
    _SMALL,
)
"""The disturbances of the table of robustness, in its order."""
