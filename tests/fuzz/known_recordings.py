"""Recordings whose channels, rate and units are known, and what a file of one of them must be read as."""

from dataclasses import dataclass, field

import numpy as np

CHOICES = {
    "names": ("plain", "words", "german", "instrument", "numbers", "axes", "chinese", "signs", "short"),
    "units": ("metric", "gravity", "square", "imperial", "electric", "mixed", "micro"),
    "count": (3, 2, 1, 5),
    "rate": (2000.0, 1000.0, 2048.0, 12_800.0, 25_600.0, 51_200.0, 44_100.0, 97_656.25, 500.0),
    "n": (240, 64, 1200),
    "scale": (1.0, 1e-4, 3e4),
}
"""Properties of a recording; the first of each is the plain one."""

NAMES = {
    "plain": ("a1", "a2", "tacho", "a3", "a4"),
    "words": ("Bearing housing", "Motor drive end", "Tacho pulse", "Gearbox top", "Base plate"),
    "german": ("Getriebegehäuse", "Lagerbock außen", "Drehgeber", "Träger", "Füße"),
    "instrument": ("CH1", "CH2", "CH3", "CH4", "CH5"),
    "numbers": ("101", "102", "103", "104", "105"),
    "axes": ("X", "Y", "Z", "RX", "RY"),
    "chinese": ("振动1", "振动2", "转速", "轴承", "电机"),
    "signs": ("a.1", "a-2", "a+3", "a#4", "a&5"),
    "short": ("T", "t1", "N", "i", "S"),
}

UNITS = {
    "metric": ("m/s^2", "m/s^2", "V", "mm/s", "Pa"),
    "gravity": ("g", "g", "V", "g", "g"),
    "square": ("m/s²", "m/s²", "V", "m/s²", "m/s²"),
    "imperial": ("ips", "in/s", "counts", "g", "psi"),
    "electric": ("mV", "mV", "V", "V", "A"),
    "mixed": ("g", "mm/s", "V", "degC", "N"),
    "micro": ("µm", "µm", "V", "µm", "µm"),
}


@dataclass(frozen=True, kw_only=True, eq=False)
class KnownRecording:
    """Channels (count, n) with names and units, sampled at ``rate`` Hz."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    samples: np.ndarray
    rate: float

    @property
    def times(self):
        return np.arange(self.samples.shape[1]) / self.rate


@dataclass(frozen=True, kw_only=True, eq=False)
class Expected:
    """What reading a file gives, unless it is refused.

    Attributes
    ----------
    names, units, samples, rate
        Those of the channels; a unit is empty where the file states none. Samples are nan where the file holds none.
        A rate may be that of all channels or one for each.
    options
        Options of the reading.
    tolerance
        Largest deviation of a sample, over the largest of its channel.
    rate_tolerance
        Largest relative deviation of the rate.
    starts
        Times of the first samples in s, up to a constant, if the channels do not begin together.
    shorter
        Number of samples at the end that may be missing.
    whole_names
        Whether a name may keep its unit, in place of the unit.
    loose_names
        Whether names may be lost with their line, where a note counts the lines that were left out.
    extra
        Names of channels that hold something else and may be there.
    doubts
        Codes of notes that state a doubt, with which a difference is no fault.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    samples: tuple[np.ndarray, ...]
    rate: float | tuple[float, ...]
    options: dict = field(default_factory=dict)
    tolerance: float = 1e-6
    rate_tolerance: float = 1e-6
    starts: tuple[float, ...] | None = None
    shorter: int = 0
    whole_names: bool = False
    loose_names: bool = False
    extra: frozenset[str] = frozenset()
    doubts: frozenset[str] = frozenset()


def known_recording(seed, *, names, units, count, rate, n, scale):
    """Sines with noise, and pulses as the third channel; none of them rises evenly."""
    random = np.random.default_rng([7, *seed])
    t = np.arange(n) / rate
    waves = [np.sin(2 * np.pi * (3 + 4 * k) / n * rate * t + k) + 0.3 * random.standard_normal(n) for k in range(count)]
    if count > 2:
        waves[2] = 5.0 * (np.arange(n) % 16 < 3) + 0.01 * random.standard_normal(n)
    samples = np.round(np.stack(waves), 4) * scale
    return KnownRecording(names=NAMES[names][:count], units=UNITS[units][:count], samples=samples, rate=rate)


def drawn(choices, random, *, most=4):
    """Choices of which at most so many are not the plain ones; a layout is drawn always."""
    how = {name: values[0] for name, values in choices.items()}
    names = [name for name in how if name != "layout"]
    varied = random.choice(names, min(len(names), int(random.integers(0, most + 1))), replace=False)
    for name in (*varied, *(["layout"] if "layout" in how else [])):
        how[name] = choices[name][int(random.integers(len(choices[name])))]
    return how
