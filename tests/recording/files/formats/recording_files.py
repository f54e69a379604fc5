"""Files of recordings in every format, written by other libraries than those that read them where there are any."""

import gzip
import struct
import warnings
import zipfile
import zlib

import h5py
import numpy as np
import pyarrow as pa
import pyuff
from pyarrow import parquet
from scipy.io import savemat, wavfile

RATE = 12_800.0


def channels(n=400, seed=0):
    """Two signals that single precision and 16 bits hold exactly."""
    x = np.random.default_rng(seed).integers(-32_000, 32_000, (2, n)) / 32_768
    return {"a1": x[0], "a2": x[1]}


def csv(path, data):
    rows = "".join(",".join(f"{value:.9g}" for value in row) + "\n" for row in zip(*data.values(), strict=True))
    text = (",".join(data) + "\n" + rows).encode()
    path.write_bytes(gzip.compress(text) if path.suffix == ".gz" else text)


def semicolons(path, data):
    t = np.arange(len(next(iter(data.values())))) / RATE
    rows = zip(t, *data.values(), strict=True)
    text = "".join(";".join(f"{value:.10f}".replace(".", ",") for value in row) + "\n" for row in rows)
    path.write_text("Zeit [s];" + ";".join(data) + "\n" + text, encoding="utf-8")


def mat5(path, data):
    savemat(path, {**data, "fs": RATE, "about": "a run"}, do_compression=True)


def mat4(path, data):
    savemat(path, {**data, "fs": RATE, "about": "a run"}, format="4")


def mat5_struct(path, data):
    savemat(path, {"run": {"data": dict(data), "dt": 1 / RATE, "list": [1.0, "x"]}})


def mat73(path, data):
    """As MATLAB writes it: 512 bytes of its own, column vectors turned, structures as groups."""
    with h5py.File(path, "w", userblock_size=512) as file:
        group = file.create_group("run")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, x in {**data, "fs": np.array([RATE])}.items():
            group.create_dataset(name, data=x[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
        file.create_dataset("note", data=np.array([[97], [98]], np.uint16)).attrs["MATLAB_class"] = np.bytes_("char")
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as file:
        file.write(header)


def hdf5(path, data):
    with h5py.File(path, "w") as file:
        file.attrs["sampling_rate"] = RATE
        for name, x in data.items():
            made = file.create_dataset(f"run/{name}", data=x, chunks=(64,), compression="gzip", shuffle=True)
            made.attrs["unit"] = "m/s^2"


def wav(path, data):
    wavfile.write(path, int(RATE), (np.stack(list(data.values()), 1) * 32_768).astype(np.int16))


def npz(path, data):
    np.savez_compressed(path, **data, fs=RATE)


def npy(path, data):
    np.save(path, np.stack(list(data.values()), 1))


def parquet_table(path, data):
    t = np.arange(len(next(iter(data.values())))) / RATE
    fields = [pa.field("time", pa.float64())]
    fields += [pa.field(name, pa.float64(), metadata={"unit": "g"}) for name in data]
    parquet.write_table(pa.table([t, *data.values()], schema=pa.schema(fields)), path)


def uff58(path, data, *, kind="58b", function=1):
    path.unlink(missing_ok=True)
    for name, x in data.items():
        about = pyuff.prepare_58(
            binary=int(kind == "58b"), func_type=function, id1=name, rsp_node=1, rsp_dir=3, ref_node=0, ref_dir=0,
            x=np.arange(x.size) / RATE, data=x, ord_data_type=4, num_pts=x.size, abscissa_spacing=1, abscissa_min=0.0,
            abscissa_inc=1 / RATE, z_axis_value=0.0, abscissa_spec_data_type=17, abscissa_len_unit_exp=0,
            abscissa_force_unit_exp=0, abscissa_temp_unit_exp=0, ordinate_spec_data_type=12, ordinate_len_unit_exp=0,
            ordinate_force_unit_exp=0, ordinate_temp_unit_exp=0, orddenom_spec_data_type=0, orddenom_len_unit_exp=0,
            orddenom_force_unit_exp=0, orddenom_temp_unit_exp=0, z_axis_axis_units_lab="NONE", id2="NONE", id3="NONE",
            id4="NONE", id5="NONE", ver_num=0, load_case_id=0, rsp_ent_name="NONE", ref_ent_name="NONE",
            abscissa_axis_units_lab="s",
            ordinate_axis_units_lab="m/s^2", orddenom_axis_units_lab="NONE",
            z_axis_spec_data_type=0, z_axis_len_unit_exp=0, z_axis_force_unit_exp=0, z_axis_temp_unit_exp=0,
        )  # fmt: skip
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)  # pyuff leaves a file open
            pyuff.UFF(str(path)).write_sets(about, "add")


def uff58_text(path, data):
    uff58(path, data, kind="58")


def _text(value):
    return struct.pack("<I", len(value.encode())) + value.encode()


def tdms(path, data, *, interleaved=False, segments=2):
    """Segments as National Instruments describes them: the second repeats the first one's list by a zero."""
    parts = []
    pieces = [np.array_split(x, segments) for x in data.values()]
    for i in range(segments):
        meta = struct.pack("<I", len(data) + 1) + _text("/'run'") + struct.pack("<II", 0xFFFFFFFF, 0)
        for name, x in zip(data, pieces, strict=True):
            meta += _text(f"/'run'/'{name}'")
            meta += struct.pack("<IIIQ", 20, 10, 1, x[i].size)
            meta += struct.pack("<I", 2) + _text("wf_increment") + struct.pack("<Id", 10, 1 / RATE)
            meta += _text("unit_string") + struct.pack("<I", 0x20) + _text("g")
        columns = [x[i] for x in pieces]
        raw = (np.stack(columns, 1) if interleaved else np.concatenate(columns)).astype("<f8").tobytes()
        contents = 2 | 4 | 8 | (32 if interleaved else 0)
        parts.append(b"TDSm" + struct.pack("<IIQQ", contents, 4713, len(meta) + len(raw), len(meta)) + meta + raw)
    path.write_bytes(b"".join(parts))


def mdf4(path, data):
    """A group of times and channels, transposed and compressed; blocks stand after those to which they link."""
    file = bytearray(168)

    def block(kind, links, body=b""):
        start = len(file)
        length = 24 + 8 * len(links) + len(body)
        file.extend(kind + struct.pack(f"<4xQQ{len(links)}q", length, len(links), *links) + body)
        file.extend(bytes(-len(file) % 8))
        return start

    def channel(after, name, byte, kind):
        unit = block(b"##TX", (), b"s\0" if kind else b"g\0")
        links = (after, 0, block(b"##TX", (), name.encode() + b"\0"), 0, 0, 0, unit, 0)
        return block(b"##CN", links, struct.pack("<4B4I", kind, kind // 2, 4, 0, byte, 64, 0, 0) + bytes(52))

    t = np.arange(len(next(iter(data.values())))) / RATE
    table = np.stack([t, *data.values()], 1).astype("<f8")
    size = 8 * table.shape[1]
    raw = table.view(np.uint8).reshape(-1, size).T.tobytes()
    packed = zlib.compress(raw)
    records = block(b"##DZ", (), b"DT" + struct.pack("<BBIQQ", 1, 0, size, len(raw), len(packed)) + packed)
    after = 0
    for i, name in reversed(list(enumerate(data))):
        after = channel(after, name, 8 * (i + 1), 0)
    cycles = struct.pack("<QQHHIII", 0, len(t), 0, 46, 0, size, 0)
    group = block(b"##CG", (0, channel(after, "t", 0, 2), 0, 0, 0, 0), cycles)
    groups = block(b"##DG", (0, group, records, 0), bytes(8))
    file[:64] = b"MDF     4.10    test".ljust(64, b"\0")
    file[64:168] = (b"##HD" + struct.pack("<4xQQ6q", 104, 6, groups, 0, 0, 0, 0, 0)).ljust(104, b"\0")
    path.write_bytes(bytes(file))


def zip_of(path, members):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, data)


MAKERS = {
    "plain.csv": csv, "packed.csv.gz": csv, "german.txt": semicolons, "four.mat": mat4, "five.mat": mat5,
    "struct.mat": mat5_struct, "seven.mat": mat73, "run.h5": hdf5, "run.wav": wav, "run.npz": npz, "run.npy": npy,
    "run.parquet": parquet_table, "binary.uff": uff58, "text.uff": uff58_text, "run.tdms": tdms,
    "run.mf4": mdf4,
}  # fmt: skip
