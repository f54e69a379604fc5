"""Cost of an ingest: its time over that of reading a recording and resampling it once with NumPy, and its memory.

``python benchmarks/ingest.py`` writes synthetic recordings, reads and resamples each with ``read_recording`` and
``numpy.interp``, and ingests the same files in one process, in turn. It prints the ratio of the times by format, the
share of the rows that have a result, and the memory for few and for many recordings.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.io import wavfile

import sigdb
from sigdb.ingest import IngestSettings, ingest
from sigdb.recording import read_recording

FS, TEETH, SAMPLES_PER_TOOTH, SECONDS = 25600.0, 32, 64, 20.0
READING = {"sampling_rate": FS, "tacho": "tacho"}


def channels(seed: int) -> dict[str, np.ndarray]:
    """Return a channel of a mesh with uneven teeth, a slowly changing speed and noise, and a tacho."""
    stream, t = np.random.default_rng(seed), np.arange(int(FS * SECONDS)) / FS
    turns = np.cumsum(25 * (1 + 0.002 * np.sin(2 * np.pi * t / 3))) / FS
    errors = 1 + 0.1 * np.random.default_rng(1).normal(size=TEETH)
    mesh = np.cos(2 * np.pi * TEETH * turns) * errors[(turns * TEETH).astype(int) % TEETH]
    return {"a1": mesh + 0.2 * stream.normal(size=t.size), "tacho": 5.0 * (turns % 1 < 0.1)}


def write(folder: Path, suffix: str, count: int) -> list[Path]:
    """Write recordings of a format and return their paths."""
    paths = [folder / f"r{number:03d}.{suffix}" for number in range(count)]
    for number, path in enumerate(paths):
        record = channels(number)
        if suffix == "npz":
            np.savez(path, **record)
        elif suffix == "csv":
            np.savetxt(
                path, np.column_stack(list(record.values())), delimiter=",", header="a1,tacho", comments="", fmt="%.6g"
            )
        else:
            both = np.column_stack([record["a1"] / 10, record["tacho"] / 10]).astype(np.float32)
            wavfile.write(path, int(FS), both)
    return paths


def reading(suffix: str) -> dict[str, object]:
    """Return the options of reading a format; a WAV file states its rate and no names."""
    return READING if suffix != "wav" else {"names": ("a1", "tacho"), "tacho": "tacho"}


def read_and_resample(path: Path, options: dict[str, object]) -> float:
    """Read a recording and resample it once with NumPy; return the processor time, s."""
    started = time.process_time()
    recording = read_recording(path, **options)
    x = recording.channel("a1").samples
    pulses = np.flatnonzero(np.diff(recording.channel("tacho").samples > 2.5 * (recording.source[-3:] != "wav")) == 1)
    revolutions = len(pulses) // 2 - 1
    angle = np.arange(revolutions * TEETH * SAMPLES_PER_TOOTH) / (TEETH * SAMPLES_PER_TOOTH)
    times = np.interp(angle, np.arange(len(pulses[::2])), pulses[::2])
    np.interp(times, np.arange(x.size), x)
    return time.process_time() - started


def ratio(suffix: str, count: int, rounds: int) -> dict[str, float]:
    """Return the least processor times a recording of both ways, and their ratio."""
    options = reading(suffix)
    settings = IngestSettings(teeth=str(TEETH), channels=("a1",), reading=options)
    with tempfile.TemporaryDirectory() as place:
        paths = write(Path(place), suffix, count)
        plain, whole = [], []
        for number in range(rounds + 1):  # the first round compiles
            plain.append(sum(read_and_resample(path, options) for path in paths) / count)
            started = time.process_time()
            ingest(place, Path(place) / f"db{number}", settings=settings, jobs=1)
            whole.append((time.process_time() - started) / count)
        rows = sigdb.open(Path(place) / "db0").cases()
        assert (rows["status"] == "ok").all(), rows["status"].tolist()
    least = min(plain[1:]), min(whole[1:])
    return {"read_and_resample_s": least[0], "ingest_s": least[1], "ratio": least[1] / least[0]}


def memory(count: int) -> float:
    """Return the greatest memory of a process that ingests so many recordings, MB."""
    with tempfile.TemporaryDirectory() as place:
        write(Path(place), "npz", count)
        settings = IngestSettings(teeth=str(TEETH), channels=("a1",), reading=READING)
        ingest(place, Path(place) / "db", settings=settings, jobs=1)
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    """Print the results as JSON."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=4, help="Recordings of each format.")
    parser.add_argument("--rounds", type=int, default=3, help="Rounds; the best one counts.")
    parser.add_argument("--memory", type=int, help="Only print the memory for so many recordings, MB.")
    options = parser.parse_args()
    if options.memory:
        print(memory(options.memory))
        return
    results: dict[str, object] = {
        suffix: ratio(suffix, options.count, options.rounds) for suffix in ("csv", "wav", "npz")
    }
    for count in (options.count, 8 * options.count):
        done = subprocess.run(
            [sys.executable, __file__, "--memory", str(count)], capture_output=True, text=True, check=True
        )
        results[f"memory_mb_{count}"] = float(done.stdout)
    print(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
