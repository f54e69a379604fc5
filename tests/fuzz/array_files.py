"""MAT, HDF5, NPZ, NPY and Parquet files of known recordings, under other names, shapes, types and places of facts."""

import h5py
import numpy as np
import pyarrow as pa
from known_recordings import Expected
from pyarrow import parquet
from scipy.io import savemat

RATE_NAMES = ("fs", "Fs", "sampling_rate", "SampleRate", "SampFreq", "sampling_freq", "samp_rate", "f_sample", "sr",
              "Sampling_Frequency")  # fmt: skip
INTERVAL_NAMES = ("dt", "Ts", "deltaT", "delta_t", "Tinterval", "sample_interval", "time_step")

COMMON = {
    "rate_at": ("fs", *RATE_NAMES[1:], *INTERVAL_NAMES, "time", "time in ms", "time second", "option", "text", "array"),
    "type": ("f8", "f4", "big", "i2", "i4"),
    "arrays": ("columns", "matrix", "turned matrix", "rows"),
    "other": ("none", "index", "scalars", "short", "speed", "text", "other length", "spectrum"),
    "time_name": ("t", "time", "Time", "t_s", "time_vector", "Zeit", "tt"),
    "start": (0.0, 2.5),
}  # fmt: skip

NAMES = ("a1", "a2", "tacho", "a3", "a4")


def _stored(known, kind):
    """The samples as a type stores them, and their tolerance."""
    if kind in ("i2", "i4"):
        whole = np.round(known.samples / abs(known.samples).max() * 30_000)
        return whole.astype(kind), 0.0
    x = known.samples.astype({"f8": "<f8", "f4": "<f4", "big": ">f8"}[kind])
    return x, 1e-6 if kind == "f4" else 1e-12


def _parts(known, how):
    """Arrays and facts by name, the names of the channels, and options of the reading."""
    stored, tolerance = _stored(known, how["type"])
    names = NAMES[: len(stored)]
    facts, options, times = {}, {}, None
    rate_at, n = how["rate_at"], stored.shape[1]
    if rate_at in INTERVAL_NAMES:
        facts[rate_at] = 1 / known.rate
    elif rate_at in RATE_NAMES:
        facts[rate_at] = known.rate
    elif rate_at == "text":
        facts["fs"] = f"{known.rate:g}"
    elif rate_at == "array":
        facts["fs"] = np.array([[known.rate]])
    elif rate_at == "option":
        options["sampling_rate"] = known.rate
    else:
        times = known.times + how["start"]
        label = how["time_name"]
        if rate_at == "time in ms":
            times, label = times * 1000, f"{label.removesuffix('_s')}_ms"
        facts = {label: times}
    others = {
        "none": {}, "index": {"index": np.arange(n, dtype="i4")}, "scalars": {"load": 12.5, "gain": 100.0, "points": n},
        "short": {"limits": np.array([1.0, 2.0, 3.0])}, "speed": {"X097RPM": np.array([[1796.0]])},
        "text": {"about": "run 7", "sensor": "352C33"}, "other length": {"calibration": np.sin(np.arange(n // 2))},
        "spectrum": {"frequency": np.arange(n) * known.rate / n / 2},
    }[how["other"]]  # fmt: skip
    if how["arrays"] in ("matrix", "turned matrix"):
        matrix = stored.T if how["arrays"] == "matrix" else stored
        arrays = {"x": np.ascontiguousarray(matrix)}
        names = tuple(f"x{i + 1}" for i in range(len(stored))) if len(stored) > 1 else ("x",)
    else:
        shape = (-1, 1) if how["arrays"] == "columns" else (1, -1)
        arrays = {name: x.reshape(shape) for name, x in zip(names, stored, strict=True)}
    parts = {**facts, **arrays, **others} if rate_at != "time second" else {**arrays, **others, **facts}
    return parts, names, stored.astype(float), tolerance, options


def _expected(known, how, names, samples, tolerance, options):
    return Expected(
        names=tuple(names), units=("",) * len(names), samples=tuple(samples), rate=known.rate, tolerance=tolerance,
        options=options, extra=frozenset({"calibration", "run/calibration", "run.calibration"}),
    )  # fmt: skip


MAT = COMMON | {"version": ("5", "4", "compressed"), "struct": ("none", "run", "deep")}


def mat_file(path, known, random, **how):
    parts, names, samples, tolerance, options = _parts(known, how)
    prefix = ""
    if how["version"] != "4" and how["struct"] != "none":
        prefix = "run."
        parts = {"run": parts}
        if how["struct"] == "deep":
            prefix = "test.run."
            parts = {"test": {**parts, "number": 7.0}}
    savemat(
        path, parts, format="4" if how["version"] == "4" else "5", do_compression=how["version"] == "compressed",
        oned_as="row" if how["arrays"] == "rows" else "column",
    )  # fmt: skip
    return _expected(known, how, [prefix + name for name in names], samples, tolerance, options)


HDF5 = COMMON | {
    "group": ("", "run", "run/data"), "facts_in": ("attributes", "datasets", "channel attributes"),
    "unit": ("unit", "units", "Unit", "none", "variable"), "packed": (False, True), "maxshape": (False, True),
    "suffix": (".h5", ".hdf5", ".hdf"),
}  # fmt: skip


def hdf5_file(path, known, random, **how):
    parts, names, samples, tolerance, options = _parts(known, how)
    prefix = f"{how['group']}/" if how["group"] else ""
    with h5py.File(path, "w") as file:
        group = file.require_group(how["group"]) if how["group"] else file
        datasets = []
        for name, value in parts.items():
            if isinstance(value, str) or (np.size(value) == 1 and how["facts_in"] != "datasets"):
                continue
            x = np.squeeze(value)
            kwargs = {"compression": "gzip", "shuffle": True} if how["packed"] and x.size > 1 else {}
            if how["maxshape"] and x.ndim:
                kwargs["maxshape"] = (None, *x.shape[1:])
            item = group.create_dataset(name, data=x, **kwargs)
            if name in names or name == "x":
                datasets.append(item)
                if how["unit"] == "variable":
                    item.attrs["unit"] = known.units[0]
                elif how["unit"] != "none":
                    item.attrs[how["unit"]] = np.bytes_(known.units[0].encode())
        for name, value in parts.items():
            if isinstance(value, str) or (np.size(value) == 1 and how["facts_in"] != "datasets"):
                for item in datasets if how["facts_in"] == "channel attributes" else [group]:
                    item.attrs[name] = value
    unit = "" if how["unit"] == "none" else known.units[0]
    expected = _expected(known, how, [prefix + name for name in names], samples, tolerance, options)
    return Expected(**{**vars(expected), "units": (unit,) * len(names)})


NPZ = COMMON | {"packed": (True, False), "fortran": (False, True)}


def npz_file(path, known, random, **how):
    parts, names, samples, tolerance, options = _parts(known, how)
    if how["fortran"]:
        parts = {name: np.asfortranarray(x) if isinstance(x, np.ndarray) else x for name, x in parts.items()}
    (np.savez_compressed if how["packed"] else np.savez)(path, **parts)
    return _expected(known, how, names, samples, tolerance, options)


NPY = {
    "layout": ("matrix", "turned", "time first", "index first", "structured", "structured with time", "index and time"),
    "type": ("f8", "f4", "big", "i2"), "fortran": (False, True), "start": (0.0, 2.5),
}  # fmt: skip


def npy_file(path, known, random, **how):
    x, tolerance = _stored(known, how["type"])
    n, names, options = x.shape[1], (), {}
    times = known.times + how["start"]
    if how["layout"].startswith("structured"):
        timed = how["layout"] == "structured with time"
        names = NAMES[: len(x)]
        fields = ([("time", "f8")] if timed else []) + [(name, x.dtype) for name in names]
        table = np.zeros(n, fields)
        for name, values in zip(names, x, strict=True):
            table[name] = values
        if timed:
            table["time"] = times
        array = table
    else:
        first = {"time first": [times], "index first": [np.arange(n)], "index and time": [np.arange(n), times]}
        whole = np.stack([*first.get(how["layout"], []), *x]) if how["layout"] in first else x
        array = whole if how["layout"] == "turned" else np.ascontiguousarray(whole.T)
        array = np.asfortranarray(array) if how["fortran"] else array
    if "time" not in how["layout"]:
        options["sampling_rate"] = known.rate
    np.save(path, array)
    return Expected(
        names=names, units=("",) * len(x), samples=tuple(x.astype(float)), rate=known.rate, tolerance=tolerance,
        options=options,
    )  # fmt: skip


PARQUET = {
    "time_at": ("first", "last", "none"), "time_name": ("time", "Time", "t", "timestamp", "Zeit", "seconds", "t [s]"),
    "time_type": ("s", "ms in name", "stamps ns", "stamps ms", "duration", "time of day"),
    "type": ("f8", "f4", "i2", "half", "nullable"), "index": ("none", "pandas", "column"),
    "unit": ("metadata", "brackets", "none"), "compression": ("snappy", "gzip", "none"),
    "extra": ("none", "text", "flags", "constant"), "start": (0.0, 5.0), "suffix": (".parquet", ".pq"),
}  # fmt: skip


def parquet_file(path, known, random, **how):
    kind = how["type"] if how["type"] in ("f8", "f4", "i2") else "f8"
    x, tolerance = _stored(known, kind)
    if how["type"] == "half":
        x = x / abs(x).max()
    columns = []
    for name, unit, values in zip(known.names, known.units, x, strict=True):
        label = f"{name} [{unit}]" if how["unit"] == "brackets" else name
        about = {"unit": unit} if how["unit"] == "metadata" else None
        data = pa.array(values.astype(np.float16) if how["type"] == "half" else values)
        columns.append((pa.field(label, data.type, metadata=about), data))
    options, rate_tolerance = {}, 1e-6
    if how["time_at"] == "none":
        options["sampling_rate"] = known.rate
    else:
        name, times, step = _parquet_times(known, how)
        rate_tolerance += 1.5 * step * known.rate / x.shape[1]
        columns.insert(0 if how["time_at"] == "first" else len(columns), (pa.field(name, times.type), times))
    n = x.shape[1]
    if how["index"] != "none":
        label = "__index_level_0__" if how["index"] == "pandas" else "index"
        columns.append((pa.field(label, pa.int64()), pa.array(np.arange(n))))
    extra = {"text": pa.array(["ok"] * n), "flags": pa.array([True] * n), "constant": pa.array([1.0] * n)}
    if how["extra"] != "none":
        columns.append((pa.field("state", extra[how["extra"]].type), extra[how["extra"]]))
    schema = pa.schema([head for head, _ in columns])
    parquet.write_table(pa.table([data for _, data in columns], schema=schema), path, compression=how["compression"])
    return Expected(
        names=known.names, units=("",) * len(x) if how["unit"] == "none" else known.units,
        samples=tuple(x.astype(float)), rate=known.rate, options=options, rate_tolerance=rate_tolerance,
        tolerance=1e-3 if how["type"] == "half" else tolerance, extra=frozenset({"state"}),
    )  # fmt: skip


def _parquet_times(known, how):
    t, name = known.times + how["start"], how["time_name"]
    name = "time" if name in known.names else name
    step = 1e-9
    match how["time_type"]:
        case "s":
            return name, pa.array(t), 0.0
        case "ms in name":
            return f"{name.split(' ')[0]} [ms]", pa.array(t * 1000), 0.0
        case "stamps ms":
            step = 1e-3
            times = pa.array(np.round(t * 1e3).astype("i8") + 1_709_634_030_000).cast(pa.timestamp("ms"))
        case "stamps ns":
            times = pa.array(np.round(t * 1e9).astype("i8") + 1_709_634_030_000_000_000).cast(pa.timestamp("ns"))
        case "duration":
            times = pa.array(np.round(t * 1e9).astype("i8")).cast(pa.duration("ns"))
        case _:
            times = pa.array(np.round(t * 1e9).astype("i8") + 36_000_000_000_000).cast(pa.time64("ns"))
    return name.removesuffix(" [s]"), times, step
