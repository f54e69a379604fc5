"""Cost of an ingest: its time over that of reading a recording and resampling it once with NumPy, and its memory.

``python benchmarks/ingest.py`` writes synthetic recordings with one and with four channels. It reads each with
``read_recording`` and resamples all channels with ``numpy.interp``, and ingests the same files in one process, in turn.
The angle comes from the tacho, or from the phase of the mesh. The latter is also compared with a peer that searches
too: it scores speeds in spectra of frames, and demodulates three mesh harmonics twice each, with NumPy. The ratios of
processor times are printed by format, and the memory for few and for many recordings. A database that grows by one
small file at a time gives the processor time of an ingest by the number of those before. ``--json FILE`` writes them.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from measuring import environment
from numpy.typing import NDArray
from scipy.io import savemat, wavfile

import sigdb
from sigdb.ingest import IngestSettings, ingest
from sigdb.recording import AveragingSettings, read_recording

FS, TEETH, SAMPLES_PER_TOOTH, SECONDS = 25600.0, 32, 64, 20.0
FORMATS, CHANNELS = ("csv", "npz", "wav", "mat"), (1, 4)
RANGE_RPM = (1200.0, 1800.0)
FloatArray = NDArray[np.float64]


def record(seed: int, count: int) -> dict[str, FloatArray]:
    """Return channels of a mesh with uneven teeth, a slowly changing speed and noise, and a tacho."""
    stream, t = np.random.default_rng(seed), np.arange(int(FS * SECONDS)) / FS
    turns = np.cumsum(25 * (1 + 0.002 * np.sin(2 * np.pi * t / 3))) / FS
    errors = 1 + 0.1 * np.random.default_rng(1).normal(size=TEETH)
    mesh = np.cos(2 * np.pi * TEETH * turns) * errors[(turns * TEETH).astype(int) % TEETH]
    signals = {f"a{i + 1}": mesh / (i + 1) + 0.2 * stream.normal(size=t.size) for i in range(count)}
    return signals | {"tacho": 5.0 * (turns % 1 < 0.1)}


def write(folder: Path, suffix: str, files: int, count: int) -> list[Path]:
    """Write recordings of a format with so many channels, and return their paths."""
    paths = [folder / f"r{number:03d}.{suffix}" for number in range(files)]
    for number, path in enumerate(paths):
        content = record(number, count)
        columns = np.column_stack(list(content.values()))
        if suffix == "npz":
            np.savez(path, **content)
        elif suffix == "mat":
            savemat(path, content)
        elif suffix == "csv":
            np.savetxt(path, columns, delimiter=",", header=",".join(content), comments="", fmt="%.6g")
        else:
            wavfile.write(path, int(FS), (columns / 10).astype(np.float32))
    return paths


def reading(suffix: str, count: int) -> dict[str, Any]:
    """Return the options of reading a format; a WAV file states its rate and no names."""
    names = (*(f"a{i + 1}" for i in range(count)), "tacho")
    return {"tacho": "tacho"} | ({"names": names} if suffix == "wav" else {"sampling_rate": FS})


def read_and_resample(path: Path, options: dict[str, Any], *, mesh_phase: bool) -> float:
    """Read a recording and resample all its channels once with NumPy; return the processor time, s."""
    started = time.process_time()
    recording = read_recording(path, **options)
    tacho = recording.channel("tacho").samples
    edges = np.flatnonzero((tacho[1:] > tacho.max() / 2) & (tacho[:-1] <= tacho.max() / 2)).astype(float)
    signals = [signal.samples for signal in recording.signals]
    coarse = searched_speed(signals) if mesh_phase else None
    for x in signals:
        revolutions = mesh_revolutions(x, coarse) if coarse is not None else edges
        angle = np.arange((len(revolutions) - 1) * TEETH * SAMPLES_PER_TOOTH) / (TEETH * SAMPLES_PER_TOOTH)
        np.interp(np.interp(angle, np.arange(len(revolutions)), revolutions), np.arange(x.size), x)
    return time.process_time() - started


def searched_speed(signals: list[FloatArray]) -> FloatArray:
    """Return the speed of each sample, rev/s: the greatest score of mesh harmonics and sidebands in each frame."""
    low, high = RANGE_RPM[0] / 60, RANGE_RPM[1] / 60
    length = int(10 * FS / low)
    starts = np.arange(0, len(signals[0]) - length + 1, length // 2)
    orders = (TEETH * np.arange(1, 4)[:, None] + [-1, 0, 1]).ravel()
    step = FS / length / 2 / orders[-1]
    speeds = np.arange(low, high, step)
    bins = np.round(orders[:, None] * speeds * length / FS).astype(int)
    window, scores = np.hanning(length), np.zeros((len(starts), len(speeds)))
    for x in signals:
        power = np.array([np.abs(np.fft.rfft(window * x[start : start + length])) ** 2 for start in starts])
        level = np.median(np.lib.stride_tricks.sliding_window_view(power.mean(axis=0), 81), axis=1)
        outstanding = np.log(power[:, 40:-40] / level).clip(min=0)
        scores += sum(outstanding[:, row - 40] for row in bins)
    return np.interp(np.arange(len(signals[0])), starts + length / 2, speeds[scores.argmax(axis=1)])


def mesh_revolutions(x: FloatArray, speed: FloatArray) -> FloatArray:
    """Return the samples at which revolutions begin, by the most even phase of three harmonics, each followed twice."""
    window = np.blackman(2 * round(1.5 * FS / speed.mean()) + 1)
    size = 1 << int(np.ceil(np.log2(x.size + window.size)))
    filter_, half, found = np.fft.fft(window / window.sum(), size), window.size // 2, []
    for h in (1, 2, 3):
        psi = 2 * np.pi * h * TEETH * np.cumsum(speed) / FS
        for _ in range(2):
            smooth = np.fft.ifft(np.fft.fft(x * np.exp(-1j * psi), size) * filter_)[half : half + x.size]
            psi = psi + np.unwrap(np.angle(smooth))
        turns = psi[half:-half] / (2 * np.pi * h * TEETH)
        places = np.interp(np.arange(np.ceil(turns[0]), turns[-1]), turns, np.arange(half, x.size - half))
        found.append((np.diff(places, 2).std(), places))
    return min(found, key=lambda each: each[0])[1]


def ratio(suffix: str, count: int, *, mesh_phase: bool, files: int, rounds: int) -> dict[str, Any]:
    """Return the least processor times a recording of both ways, and their ratio."""
    options = reading(suffix, count)
    averaging = AveragingSettings(mesh_phase=mesh_phase, **({"speed_range_rpm": RANGE_RPM} if mesh_phase else {}))
    settings = IngestSettings(teeth=str(TEETH), reading=options, averaging=averaging, accept=("speed-doubt",))
    with tempfile.TemporaryDirectory() as place:
        paths = write(Path(place), suffix, files, count)
        plain, searched, whole = [], [], []
        for number in range(rounds + 1):  # the first round compiles
            plain.append(sum(read_and_resample(path, options, mesh_phase=False) for path in paths) / files)
            if mesh_phase:
                searched.append(sum(read_and_resample(path, options, mesh_phase=True) for path in paths) / files)
            started = time.process_time()
            ingest(place, Path(place) / f"db{number}", settings=settings, jobs=1)
            whole.append((time.process_time() - started) / files)
        rows = sigdb.open(Path(place) / "db0").cases()
        assert len(rows) == files * count, len(rows)
        assert (rows["status"] == "ok").all(), rows["status"].tolist()
    least = min(plain[1:]), min(whole[1:])
    result = {
        "format": suffix,
        "channels": count,
        "angle": "mesh phase" if mesh_phase else "tacho",
        "read_and_resample_s": least[0],
        "ingest_s": least[1],
        "ratio": least[1] / least[0],
    }
    if mesh_phase:
        peer = min(searched[1:])
        result |= {"read_search_and_resample_s": peer, "ratio_with_search": least[1] / peer}
    return result


def memory(files: int) -> float:
    """Return the greatest memory of a process that ingests so many recordings, MB."""
    with tempfile.TemporaryDirectory() as place:
        write(Path(place), "npz", files, 1)
        settings = IngestSettings(teeth=str(TEETH), reading=reading("npz", 1))
        ingest(place, Path(place) / "db", settings=settings, jobs=1)
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def grown(count: int) -> dict[str, float]:
    """Return processor times of single ingests and of opening, by the number of ingests, and the description's size."""
    settings = IngestSettings(teeth="8", averages_of="tsa", samples_per_tooth=16)
    stream, spent = np.random.default_rng(0), []
    with tempfile.TemporaryDirectory() as place:
        folder, database = Path(place) / "averages", Path(place) / "db"
        folder.mkdir()
        for number in range(count):
            np.savez(folder / f"r{number:05d}.npz", tsa=stream.normal(size=(1, 128)))
            started = time.process_time()
            ingest(folder, database, settings=settings, jobs=1)
            spent.append(time.process_time() - started)
        sigdb.open(database)
        started = time.process_time()
        sigdb.open(database)
        opened = time.process_time() - started
        size = (database / "sigdb.toml").stat().st_size
    tenth = count // 10
    early, late = (float(np.median(some)) for some in (spent[tenth : 2 * tenth], spent[-tenth:]))
    return {
        "ingests": count,
        "early_ingest_s": early,
        "late_ingest_s": late,
        "growth_per_ingest_s": (late - early) / (0.8 * count),
        "open_s": opened,
        "description_bytes": size,
    }


def main() -> None:
    """Print the results as JSON, or write them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=4, help="Recordings of each format.")
    parser.add_argument("--rounds", type=int, default=3, help="Rounds; the best one counts.")
    parser.add_argument("--formats", default=",".join(FORMATS), help="Formats, joined by commas.")
    parser.add_argument("--memory", type=int, help="Only print the memory for so many recordings, MB.")
    parser.add_argument("--single", type=int, default=200, help="Ingests of one small file each into one database.")
    parser.add_argument("--json", type=Path, help="File for the results.")
    options = parser.parse_args()
    if options.memory:
        print(memory(options.memory))
        return
    ratios = []
    for suffix in options.formats.split(","):
        for count in CHANNELS:
            for mesh_phase in (False, True):
                ratios.append(ratio(suffix, count, mesh_phase=mesh_phase, files=options.count, rounds=options.rounds))
                print(ratios[-1], flush=True)
    results: dict[str, Any] = {"machine": environment("numpy", "scipy"), "ratios": ratios}
    for files in (options.count, 8 * options.count):
        done = subprocess.run(
            [sys.executable, __file__, "--memory", str(files)], capture_output=True, text=True, check=True
        )
        results[f"memory_mb_{files}"] = float(done.stdout)
    results["single_ingests"] = grown(options.single)
    if options.json is None:
        print(json.dumps(results, indent=1))
    else:
        options.json.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
