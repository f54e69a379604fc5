"""MAT-files with objects, such as tables: of version 5 byte by byte, of version 7.3 by h5py."""

import itertools
import struct
import zlib

import h5py
import numpy as np

NUMBERS = itertools.count()
MARK = 0xDD000000
CLASSES = {"f8": 6, "f4": 7, "i1": 8, "u1": 9, "i2": 10, "u2": 11, "i4": 12, "u4": 13, "i8": 14, "u8": 15}
STORED = {"f8": 9, "f4": 7, "i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "i8": 12, "u8": 13}
NAMES = {"f8": "double", "f4": "single", "i1": "int8", "u1": "uint8", "i2": "int16", "u2": "uint16", "i4": "int32",
         "u4": "uint32", "i8": "int64", "u8": "uint64"}  # fmt: skip


class Objects:
    """Objects of a file: each has a class and properties, which a class may save in a way of its own."""

    def __init__(self):
        self.names, self.classes, self.objects, self.cells = [], [], [], []
        self.blocks = {True: [[]], False: [[]]}

    def name(self, text):
        if text not in self.names:
            self.names.append(text)
        return self.names.index(text) + 1

    def add(self, class_name, properties, *, saved=False):
        """The words that refer to a new object."""
        if class_name not in self.classes:
            self.classes.append(class_name)
        triples = []
        for key, value in properties.items():
            triples += [self.name(key), 1, len(self.cells)]
            self.cells.append(value)
        self.blocks[saved].append(triples)
        number = len(self.blocks[saved]) - 1
        class_number = self.classes.index(class_name) + 1
        self.objects.append([class_number, 0, 0, *((number, 0) if saved else (0, number)), len(self.objects) + 1])
        return Reference(class_name, [MARK, 2, 1, 1, len(self.objects), class_number])

    def metadata(self, version=4):
        class_rows = [[0] * 4, *([0, self.name(one), 0, 0] for one in self.classes)]
        blocks = {
            saved: np.concatenate([self._block(one) for one in made] if len(made) > 1 or not saved else [[]])
            for saved, made in self.blocks.items()
        }
        rows = [[0] * 6, *self.objects]
        lists = [np.ravel(class_rows), blocks[True], np.ravel(rows), blocks[False], [0, 0] * len(rows), [], [0, 0]]
        parts = [np.asarray(one, "<i4").tobytes() for one in lists]
        names = b"".join(one.encode() + b"\0" for one in self.names)
        names += bytes(-len(names) % 8)
        places = np.cumsum([40 + len(names), *map(len, parts)])
        return struct.pack("<10i", version, len(self.names), *places) + names + b"".join(parts)

    @staticmethod
    def _block(triples):
        words = [len(triples) // 3, *triples]
        return words + [0] * (len(words) % 2)

    def wrapped(self, version=4):
        """The cells of the file's part with objects."""
        shared = {2: [], 3: [[]], 4: [[], []]}[version]
        defaults = [{} for _ in range(len(self.classes) + 1)]
        first = np.frombuffer(self.metadata(version), np.uint8)[:, None]
        return [first, np.zeros((0, 0)), *self.cells, *shared, defaults]


class Reference:
    def __init__(self, class_name, words):
        self.class_name, self.words = class_name, np.array(words, np.uint32)[:, None]


def duration(objects, seconds):
    return objects.add("duration", {"millis": np.reshape(np.asarray(seconds, float) * 1000, (-1, 1)), "fmt": "s"})


def datetime(objects, milliseconds):
    return objects.add("datetime", {"tz": "", "data": np.reshape(milliseconds, (-1, 1)), "fmt": ""})


def string(objects, text):
    codes = text.encode("utf-16-le")
    words = [1, 2, 1, 1, len(codes) // 2, *np.frombuffer(codes + bytes(-len(codes) % 8), "<u8")]
    return objects.add("string", {"any": np.array([words], np.uint64)}, saved=True)


def _as_column(value):
    return np.reshape(value, (len(value), -1)) if isinstance(value, np.ndarray) else value


def table(objects, columns, *, units=(), rows=None):
    rows = len(next(iter(columns.values()))) if rows is None else rows
    props = {"versionSavedFrom": np.array([[4.0]]), "VariableUnits": list(units)}
    return objects.add("table", {
        "data": [_as_column(value) for value in columns.values()], "ndims": np.array([[2.0]]),
        "nrows": np.array([[float(rows)]]), "rownames": [], "nvars": np.array([[float(len(columns))]]),
        "varnames": list(columns), "props": props,
    })  # fmt: skip


def timetable(objects, columns, row_times, *, units=(), dimension="Time"):
    rows = len(next(iter(columns.values())))
    return objects.add("timetable", {"any": {
        "versionSavedFrom": np.array([[6.0]]), "data": [_as_column(value) for value in columns.values()],
        "numDims": np.array([[2.0]]), "dimNames": [dimension, "Variables"], "varNames": list(columns),
        "numRows": np.array([[float(rows)]]), "numVars": np.array([[float(len(columns))]]),
        "varUnits": list(units), "rowTimes": row_times,
    }}, saved=True)  # fmt: skip


def regular(origin, step, rate=None):
    """Row times by a rate in Hz, or by a step if there is none."""
    return {
        "origin": origin, "specifiedAsRate": np.array([[int(rate is not None)]], np.uint8), "stepSize": step,
        "sampleRate": np.array([[np.nan if rate is None else rate]]),
    }  # fmt: skip


def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def matrix(value, name="", *, top=True):
    """A matrix element; objects within others are arrays of words."""
    label = element(1, name.encode())
    if isinstance(value, Reference) and top:
        words = matrix(value.words)
        head = b"".join(element(1, part.encode()) for part in (name, "MCOS", value.class_name))
        return element(14, element(6, struct.pack("<II", 17, 0)) + head + words)
    if isinstance(value, Reference):
        value = value.words
    if isinstance(value, str):
        codes = np.frombuffer(value.encode("utf-16-le"), "<u2")
        return _matrix(4, (1 if value else 0, codes.size), label, element(17, codes.tobytes()))
    if isinstance(value, list):
        return _matrix(1, (1, len(value)), label, b"".join(matrix(part, top=False) for part in value))
    if isinstance(value, dict):
        keys = b"".join(key.encode().ljust(64, b"\0") for key in value)
        parts = b"".join(matrix(part, top=False) for part in value.values())
        return _matrix(2, (1, 1), label, element(5, struct.pack("<I", 64)) + element(1, keys) + parts)
    real = value.real if value.dtype.kind == "c" else value
    kind = real.dtype.str[1:]
    numbers = element(STORED[kind], real.tobytes(order="F"))
    if value.dtype.kind == "c":
        numbers += element(STORED[kind], value.imag.tobytes(order="F"))
    return _matrix(CLASSES[kind] | (0x0800 if value.dtype.kind == "c" else 0), value.shape, label, numbers)


def _matrix(flags, shape, label, data):
    return element(14, element(6, struct.pack("<II", flags, 0)) + element(5, struct.pack("<2i", *shape)) + label + data)


def save_5(path, variables, objects, *, version=4, compressed=False):
    parts = [matrix(value, name) for name, value in variables.items()]
    names = b"".join(element(1, one) for one in (b"", b"MCOS", b"FileWrapper__"))
    wrapper = element(6, struct.pack("<II", 17, 0)) + names
    cells = objects.wrapped(version)
    wrapper = element(14, wrapper + matrix(cells))
    inner = struct.pack("<H2sI", 0x0100, b"IM", 0)
    keys = element(5, struct.pack("<I", 5)) + element(1, b"MCOS\0")
    inner += _matrix(2, (1, 1), element(1, b""), keys + wrapper)
    parts.append(matrix(np.frombuffer(inner, np.uint8)[None, :]))
    if compressed:
        packed = [zlib.compress(part) for part in parts]
        parts = [struct.pack("<II", 15, len(part)) + part for part in packed]
    head = b"MATLAB 5.0 MAT-file".ljust(116) + struct.pack("<Q", 128 + sum(map(len, parts[:-1]))) + b"\x00\x01IM"
    path.write_bytes(head + b"".join(parts))


def save_73(path, variables, objects, *, version=4):
    with h5py.File(path, "w", userblock_size=512) as file:
        refs = file.create_group("#refs#")
        for name, value in variables.items():
            _put(file, refs, name, value)
        system = file.create_group("#subsystem#")
        wrapped = _put(system, refs, "MCOS", objects.wrapped(version))
        wrapped.attrs["MATLAB_class"] = np.bytes_("FileWrapper__")
        wrapped.attrs["MATLAB_object_decode"] = np.int32(3)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def _put(group, refs, name, value):
    if isinstance(value, dict):
        item = group.create_group(name)
        for key, part in value.items():
            _put(item, refs, key, part)
        kind = "struct"
    elif isinstance(value, list) and value:
        parts = [_put(refs, refs, f"r{next(NUMBERS)}", part).ref for part in value]
        item, kind = (
            group.create_dataset(name, data=np.array(parts, h5py.ref_dtype)[:, None], dtype=h5py.ref_dtype),
            "cell",
        )
    elif isinstance(value, str) and value:
        item, kind = group.create_dataset(name, data=np.frombuffer(value.encode("utf-16-le"), "<u2")[:, None]), "char"
    elif isinstance(value, Reference):
        item, kind = group.create_dataset(name, data=value.words.T), value.class_name
        item.attrs["MATLAB_object_decode"] = np.int32(3)
    elif isinstance(value, list | str) or not value.size:
        item, kind = (
            group.create_dataset(name, data=np.zeros(2, np.uint64)),
            "cell" if isinstance(value, list) else "char",
        )
        item.attrs["MATLAB_empty"] = np.uint8(1)
    else:
        kind = NAMES[(value.real if value.dtype.kind == "c" else value).dtype.str[1:]]
        if value.dtype.kind == "c":
            parts = np.zeros(value.shape, [("real", "<f8"), ("imag", "<f8")])
            parts["real"], parts["imag"], value = value.real, value.imag, parts
        item = group.create_dataset(name, data=value.T)
    item.attrs["MATLAB_class"] = np.bytes_(kind)
    return item


def _timetable_file(save, path, data):
    objects = Objects()
    times = regular(duration(objects, [0.0]), duration(objects, [1 / 12_800]), 12_800.0)
    save(path, {"run": timetable(objects, data, times, units=["g", "g"])}, objects)


def timetable_5(path, data):
    _timetable_file(save_5, path, data)


def timetable_73(path, data):
    _timetable_file(save_73, path, data)


MAKERS = {"timetable.mat": timetable_5, "timetable73.mat": timetable_73}
