"""Arrays for public functions: other types, shapes and values in the place of good ones."""

import functools

import numpy as np
from outcomes import READ, FaultError, answered

import sigdb
from sigdb import signature
from sigdb.recording import Channel, Recording, recorded_signature, recording_from

TEETH, N = 12, 12 * 16
RATE = 12_800.0


def _average(rows=None):
    random = np.random.default_rng(3)
    wave = np.cos(2 * np.pi * TEETH * np.arange(N) / N)
    return wave + 0.2 * random.standard_normal((N,) if rows is None else (rows, N))


X = np.tile(_average(), 12)
PULSES = np.arange(13) * N / RATE

FUNCTIONS = {
    **{
        name: (getattr(signature, name), {"tsa": _average()})
        for name in ("rms", "peak_to_peak", "crest_factor", "kurtosis", "energy_operator", "order_spectrum")
    },
    **{
        name: (getattr(signature, name), {"tsa": _average(), "teeth": TEETH})
        for name in (
            *("regular_signal", "residual_signal", "difference_signal", "fm0", "sideband_index", "indicators"),
            *("sideband_level_factor", "sideband_energy_ratio", "demodulate", "features"),
        )
    },
    **{name: (getattr(signature, name), {"difference": _average()}) for name in ("fm4", "m6a", "m8a")},
    "energy_ratio": (signature.energy_ratio, {"difference": _average(), "regular": 2 * _average()}),
    "na4": (signature.na4, {"residuals": _average(5)}),
    "na4_star": (signature.na4_star, {"residuals": _average(5), "baseline": 2}),
    "nb4": (signature.nb4, {"averages": _average(5), "teeth": TEETH}),
    "nb4_star": (signature.nb4_star, {"averages": _average(5), "teeth": TEETH, "baseline": 2}),
    "wigner_ville": (signature.wigner_ville, {"x": _average(), "n_bins": 128}),
    "pooled_wigner_ville": (
        signature.pooled_wigner_ville,
        {"x": _average(), "teeth": TEETH, "bands": signature.mesh_bands(TEETH)},
    ),
    "mesh_bands": (signature.mesh_bands, {"teeth": TEETH, "per_mesh_order": 4, "mesh_orders": 2}),
    "synchronous_average": (
        signature.synchronous_average,
        {"x": X, "fs": RATE, "pulse_times": PULSES, "samples_per_rev": 96, "pulses_per_rev": 1, "ratio": 1.0,
         "revolutions": 4},
    ),
    "tacho_pulses": (
        signature.tacho_pulses,
        {"waveform": 5.0 * (np.arange(2000) % 100 < 20), "fs": RATE, "threshold": 2.5, "hysteresis": 0.5},
    ),
    "mesh_pulses": (
        signature.mesh_pulses, {"x": X, "fs": RATE, "teeth": TEETH, "mesh_frequency": TEETH * RATE / N}
    ),
}  # fmt: skip
"""Functions of arrays with good arguments."""


def _recording(samples, sampling_rate, start, tacho):
    channels = (
        Channel(name="a", samples=samples, sampling_rate=sampling_rate, start=start),
        Channel(name="tacho", samples=tacho, sampling_rate=sampling_rate, start=start),
    )
    return recorded_signature(Recording(source="made", channels=channels, tacho="tacho"), teeth=TEETH).tsa


def _from_python(data, sampling_rate, unit):
    return [channel.samples for channel in recording_from(data, sampling_rate=sampling_rate, units=unit).channels]


TACHO = np.tile(np.where(np.arange(N) < 20, 5.0, 0.0), 12)
FUNCTIONS |= {
    "Recording": (_recording, {"samples": X, "sampling_rate": RATE, "start": 0.0, "tacho": TACHO}),
    "recording_from": (_from_python, {"data": {"a": X, "b": TACHO}, "sampling_rate": RATE, "unit": "g"}),
}


@functools.cache
def _model():
    model = sigdb.load_model("nasa-location")
    return model.assess


@functools.cache
def functions():
    """All functions with good arguments, and a model's answers to plain arrays."""
    row = {"tsa": np.tile(_average(), (2, 1)), "speed_rpm": 19820.0, "torque": 250.0, "averages": 36, "scatter": 1.0}
    return FUNCTIONS | {"assess": (lambda **row: _model()(**row).to_dict("list"), row)}


def _same_numbers(x, random):
    """The same numbers in another type or layout."""
    x = np.asarray(x)
    match int(random.integers(6)):
        case 0:
            return x.tolist()
        case 1:
            return x.astype(x.dtype.newbyteorder(">"))
        case 2:
            wide = np.zeros((*x.shape, 2), x.dtype)
            wide[..., 0] = x
            return wide[..., 0]
        case 3:
            x = x.copy()
            x.flags.writeable = False
            return x
        case 4:
            return np.ma.masked_array(x)
    return np.asfortranarray(x)


def _other(x, random):
    """Something else in the place of an array."""
    x = np.array(x, float) if not isinstance(x, dict | str) else np.arange(8.0)
    at = tuple(int(random.integers(size)) for size in x.shape)
    special = (np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, 1e-200, 0.0, 1e150)[int(random.integers(9))]
    spoiled = x.copy()
    spoiled[at] = special
    others = (
        spoiled, spoiled, spoiled, np.full_like(x, special), spoiled[..., ::-1], x[..., :0], x[..., :1], x[..., :3],
        x[..., :-1], x.reshape(-1), x[None], x[None, None], x[..., None], np.zeros((0, *x.shape)), np.float64(3.0),
        x.astype(np.float16), x.astype(np.int8), x > 0, x.astype(complex), x * 1j, x.astype(str), x.astype(object),
        np.array([None, 1.0]), [[1.0], [1.0, 2.0]], "text", b"bytes", None, {}, {"a": 1}, {1, 2}, object(),
        np.datetime64("2024-01-01"), np.array(["2024"], "M8[Y]"), np.array([(1, 2.0)], dtype=[("a", int), ("b", "f")]),
        np.ma.masked_greater(x, 0.5), iter([1.0, 2.0]), range(N), memoryview(x.tobytes()), x.T, x.astype(np.longdouble),
        np.zeros_like(x), np.ones_like(x), [10**400] * 8, np.full(8, 2**63, dtype=np.uint64), True, 0, -1, 3, 10**18,
        2.5, float("nan"), [], (), [None], ["a", 1.0], np.copysign(special, x), x * 1e-200, x * 1e150,
    )  # fmt: skip
    return others[int(random.integers(len(others)))]


NUMBERS = (0, -1, 1, 2, 3, 5, 7, 11, 13, 10**6, 10**18, 10**400, -(10**18), 0.5, 2.5, 1e-300, 1e300, float("nan"),
           float("inf"), float("-inf"), True, False, None, "12", "", b"1", [12], [], np.array([12, 12]), np.int8(12),
           np.float32(12.0), np.array(12), 12j, {}, object(), np.datetime64("2024"), 12.0)  # fmt: skip


def arrays(folder, random, about):
    """Call a public function with good arguments but for one or two; or with the same numbers in another layout."""
    names = list(functions())
    name = names[int(random.integers(len(names)))]
    function, good = functions()[name]
    chosen = random.permutation(list(good))[: int(random.choice([1, 1, 2]))]
    if random.random() < 0.2:
        return _in_another_layout(name, random, about)
    arguments = dict(good)
    for key in map(str, chosen):
        is_array = np.ndim(good[key]) > 0 or isinstance(good[key], dict)
        arguments[key] = _other(good[key], random) if is_array else NUMBERS[int(random.integers(len(NUMBERS)))]
    about["function"] = name
    about["arguments"] = {key: repr(arguments[key])[:300] for key in map(str, chosen)}
    before = {
        key: value.copy() for key, value in arguments.items() if isinstance(value, np.ndarray) and value.size < 10**6
    }

    def call():
        function(**arguments)
        return READ

    outcome = answered(call, about, lines=name == "recording_from")  # a line for each setting
    for key, value in before.items():
        if value.dtype != object and value.tobytes() != arguments[key].tobytes():
            raise FaultError("changed", f"{key} of {name}")
    return outcome


def _in_another_layout(name, random, about):
    function, good = functions()[name]
    arguments = {
        key: _same_numbers(value, random) if isinstance(value, np.ndarray) else value for key, value in good.items()
    }
    about["function"], about["layout"] = name, {key: f"{type(value).__name__}" for key, value in arguments.items()}

    def call():
        got, right = function(**arguments), _right(name)
        for a, b in zip(_parts(got), _parts(right), strict=True):
            if a.dtype.kind in "fc" and not np.allclose(a, b, rtol=1e-9, atol=1e-12, equal_nan=True):
                raise FaultError("wrong numbers", f"{name} with {about['layout']}")
        return READ

    outcome = answered(call, about)
    if outcome != READ and name != "Recording":  # channels are arrays of float64
        raise FaultError("refused", f"{name} with {about['layout']}: {about['line']}")
    return outcome


@functools.cache
def _right(name):
    function, good = functions()[name]
    return function(**good)


def _parts(value):
    """Arrays of a result."""
    if isinstance(value, dict):
        return [part for item in value.values() for part in _parts(item)]
    if isinstance(value, tuple | list):
        return (
            [part for item in value for part in _parts(item)] if any(np.ndim(v) for v in value) else [np.asarray(value)]
        )
    return [np.asarray(value)]
