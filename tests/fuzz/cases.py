"""Cases of the fuzzer: each is determined by a seed and a number, and ends in an outcome or a fault."""

import json
import shutil
import sys
from pathlib import Path

import array_files
import instrument_files
import known_recordings
import numpy as np
import outcomes
import part_files
import text_files
import waveform_files
import workbook_files
from damages import damaged
from known_recordings import drawn, known_recording
from options import AVERAGING, arguments, drawn_options, side_file
from outcomes import FaultError

sys.path.append(str(Path(__file__).parents[1] / "recording/files/formats"))

import matlab_files
import recording_files

FORMATS = {
    "text": (text_files.CHOICES, text_files.text_file, ".csv"),
    "instrument": (instrument_files.CHOICES, instrument_files.instrument_file, ".csv"),
    "mat": (array_files.MAT, array_files.mat_file, ".mat"),
    "hdf5": (array_files.HDF5, array_files.hdf5_file, ".h5"),
    "npz": (array_files.NPZ, array_files.npz_file, ".npz"),
    "npy": (array_files.NPY, array_files.npy_file, ".npy"),
    "parquet": (array_files.PARQUET, array_files.parquet_file, ".parquet"),
    "tdms": (waveform_files.TDMS, waveform_files.tdms_file, ".tdms"),
    "uff": (waveform_files.UFF, waveform_files.uff_file, ".uff"),
    "parts": (part_files.CHOICES, part_files.part_files, ".zip"),
    "wav": (waveform_files.WAV, waveform_files.wav_file, ".wav"),
    "xlsx": (workbook_files.XLSX, workbook_files.xlsx_file, ".xlsx"),
    "mdf": (workbook_files.MDF, workbook_files.mdf_file, ".mf4"),
}
"""Choices, writer and suffix by format."""

MAKERS = {**recording_files.MAKERS, **matlab_files.MAKERS}
"""Writers of plain files by name, in every format that is read."""

ORDER = ("text", "instrument", "mat", "text", "hdf5", "damage", "npz", "xlsx", "npy", "damage", "parquet", "text",
         "tdms", "options", "uff", "damage", "mdf", "wav", "parts", "instrument")  # fmt: skip
"""Kinds of cases, in turn."""


def run_case(folder, seed, number, *, shrink=True):
    """Run a case in a folder; return its kind, its outcome, what it did and its fault, if there is one."""
    kind = ORDER[number % len(ORDER)]
    random = np.random.default_rng([seed, number])
    if kind == "damage":
        return kind, *_run(lambda about: _damage_case(folder, random, about))
    if kind == "options":
        return kind, *_run(lambda about: _options_case(folder, random, about))
    how = drawn(FORMATS[kind][0], random) | {f"known {key}": value for key, value in _known_choices(random).items()}
    outcome, about, fault = _meaning_case(folder, kind, how, (seed, number))
    if fault and shrink:
        how, fault = _shrunk(folder, kind, how, (seed, number), fault)
        about = _unlike_plain(kind, how)
        _meaning_case(folder, kind, how, (seed, number))  # leaves the least file in the folder
    return kind, outcome, about, fault


def _run(case):
    about = {}
    try:
        with outcomes.bounded():
            outcome = case(about)
    except FaultError as fault:
        return "fault", about, str(fault)
    return outcome, about, None


def _known_choices(random):
    return drawn(known_recordings.CHOICES, random, most=2)


def _plain(kind):
    choices = FORMATS[kind][0] | {f"known {key}": values for key, values in known_recordings.CHOICES.items()}
    return {key: values[0] for key, values in choices.items()}


def _unlike_plain(kind, how):
    """The choices that are not the plain ones."""
    return {key: value for key, value in how.items() if key == "layout" or value != _plain(kind)[key]}


def _meaning_case(folder, kind, how, seed):
    """Write a known recording, read it, and compare."""
    _, write, suffix = FORMATS[kind]
    _cleared(folder)
    known = known_recording(seed, **{key[6:]: value for key, value in how.items() if key.startswith("known ")})
    local = {key: value for key, value in how.items() if not key.startswith("known ")}
    path = folder / f"run{local.get('suffix', suffix)}{'.gz' if local.get('gzip') else ''}"
    expected = write(path, known, np.random.default_rng([11, *seed]), **local)

    def case(about):
        got = outcomes.read(path, expected.options)
        if isinstance(got, str):
            about["line"] = got
            return outcomes.REFUSED
        outcomes.compare(expected, got)
        return outcomes.READ

    outcome, about, fault = _run(case)
    _describe(folder, options=expected.options, how=_unlike_plain(kind, how))
    return outcome, _unlike_plain(kind, how) | about, fault


def _shrunk(folder, kind, how, seed, fault):
    """Return the fewest choices unlike the plain ones that keep the kind of the fault, and its text."""
    plain = _plain(kind)
    for _ in range(2):
        for key in how:
            if how[key] == plain[key] or key == "layout":
                continue
            _, _, other = _meaning_case(folder, kind, how | {key: plain[key]}, seed)
            if other and other.split(":")[0] == fault.split(":")[0]:
                how, fault = how | {key: plain[key]}, other
    return how, fault


def _any_file(folder, random):
    """A file of any format in a folder, and the options with which it is read."""
    if random.random() < 0.5:
        name = list(MAKERS)[int(random.integers(len(MAKERS)))]
        MAKERS[name](folder / name, recording_files.channels())
        return folder / name, {"sampling_rate": recording_files.RATE} if random.random() < 0.6 else {}
    kind = list(FORMATS)[int(random.integers(len(FORMATS)))]
    choices, write, suffix = FORMATS[kind]
    local = drawn(choices, random, most=2)
    path = folder / f"run{local.get('suffix', suffix)}{'.gz' if local.get('gzip') else ''}"
    known = known_recording((0, int(random.integers(100))), **drawn(known_recordings.CHOICES, random, most=2))
    return path, write(path, known, random, **local).options


def _damage_case(folder, random, about):
    _cleared(folder)
    path, options = _any_file(folder, random)
    if path.is_dir():  # one of its files
        path = max(path.iterdir())
    data = path.read_bytes()
    is_text = b"\0" not in data[:200] and data[:2] != b"\x1f\x8b"
    data, about["damages"] = damaged(data, random, text=is_text)
    if random.random() < 0.1:
        suffixes = (".csv", ".mat", ".h5", ".wav", ".tdms", ".uff", ".npz", ".npy", ".parquet", ".csv.gz", "", ".lvm")
        path = path.rename(path.with_name("renamed" + suffixes[int(random.integers(len(suffixes)))]))
    path.write_bytes(data)
    about["file"] = path.name
    _describe(folder, options=options, how=about)
    return _read_and_average(path, options, random)


def _options_case(folder, random, about):
    _cleared(folder)
    path, options = _any_file(folder, random)
    options = options | drawn_options(random)
    if random.random() < 0.5:
        stem = path.name.split(".")[0]
        (folder / f"{stem}.toml").write_bytes(side_file(random))
        options = options if random.random() < 0.3 else {}
    about["file"], about["options"] = path.name, repr(options)[:2000]
    _describe(folder, options=options, how=about)
    return _read_and_average(path, options, random)


def _read_and_average(path, options, random):
    got = outcomes.read(path, options)
    if random.random() < 0.12:
        outcomes.command(path, arguments(random))
    if isinstance(got, str):
        return outcomes.REFUSED
    averaging = {"teeth": 8, "mesh_phase": got.tacho is None} if random.random() < 0.7 else {}
    if random.random() < 0.5:
        averaging |= drawn_options(random, AVERAGING)
    outcomes.average(got, averaging)
    return outcomes.READ


def _cleared(folder):
    for path in folder.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()


def _describe(folder, **about):
    (folder / "case.json").write_text(json.dumps(about, default=repr, ensure_ascii=True, indent=1)[:20_000])
