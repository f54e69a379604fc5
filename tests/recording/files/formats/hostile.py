"""Damaged and made-up files through every reader, in a process of bounded memory: what comes of each.

python tests/recording/files/formats/hostile.py FOLDER --cases 400 --seed 1
"""

import argparse
import collections
import faulthandler
import json
import resource
import time
import warnings
from pathlib import Path

import matlab_files
import numpy as np
import recording_files

from sigdb.core.errors import InputError
from sigdb.recording import read_recording

MOST_MEMORY = 3 * 2**30


def _bytes_changed(data, random):
    for _ in range(int(random.integers(1, 9))):
        data[int(random.integers(len(data)))] = int(random.integers(256))
    return data


def _header_changed(data, random):
    """Mostly lengths, kinds and counts are there."""
    for _ in range(int(random.integers(1, 5))):
        at = int(random.integers(min(len(data), 600)))
        data[at] = int(random.choice([0, 1, 0x7F, 0x80, 0xFF, int(random.integers(256))]))
    return data


def _word_changed(data, random):
    """A length or a count of four or eight bytes is made huge, negative or zero."""
    at = int(random.integers(max(1, len(data) - 8)))
    value = random.choice(
        [b"\xff" * 4, b"\xff\xff\xff\x7f", b"\0" * 4, b"\xff" * 8, b"\0\0\0\x80", b"\xff" * 7 + b"\x7f"]
    )
    data[at : at + len(value)] = value
    return data


def _cut(data, random):
    return data[: int(random.integers(len(data)))]


def _part_again(data, random):
    first, last = sorted(int(i) for i in random.integers(len(data), size=2))
    return data[:last] + data[first:]


def _part_lost(data, random):
    first, last = sorted(int(i) for i in random.integers(len(data), size=2))
    return data[:first] + data[last:]


def _garbage_after(data, random):
    at = int(random.integers(min(len(data), 200)))
    return data[:at] + random.bytes(int(random.integers(1, 3000)))


DAMAGES = (_bytes_changed, _header_changed, _word_changed, _cut, _part_again, _part_lost, _garbage_after)


def outcome(path, **options):
    """What reading gives: ``recording``, the line of an error, or what should not be, in capitals."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            recording = read_recording(path, **options)
        except InputError as error:
            line = str(error)
            return "error" if line.isprintable() and len(line) <= 600 and path.name in line else f"MESSAGE {line!r}"
        except BaseException as error:
            return f"ESCAPED {type(error).__name__}: {error}"
    sound = all(np.isfinite(one.samples).all() and one.samples.size for one in recording.channels)
    return "recording" if sound else "UNSOUND"


def main(folder, cases, seed, only):
    faulthandler.enable()
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    random = np.random.default_rng(seed)
    counted = collections.Counter()
    wrong, slowest = [], (0.0, "")
    for name, make in {**recording_files.MAKERS, **matlab_files.MAKERS}.items():
        if only and only not in name:
            continue
        made = folder / name
        make(made, recording_files.channels())
        data = made.read_bytes()
        assert outcome(made, sampling_rate=recording_files.RATE) == "recording", name
        for case in range(cases):
            damage = DAMAGES[case % len(DAMAGES)]
            made.write_bytes(bytes(damage(bytearray(data), random)))
            start = time.process_time()
            came = outcome(made, **({"sampling_rate": recording_files.RATE} if case % 3 else {}))
            slowest = max(slowest, (time.process_time() - start, f"{name} {damage.__name__}"))
            counted[came.split()[0]] += 1
            if came not in ("recording", "error"):
                wrong.append(f"{name} {damage.__name__} {case}: {came}")
    peak = _peak_mib()
    print(json.dumps({"counted": counted, "wrong": wrong, "slowest": slowest, "peak_mib": peak}))


def _peak_mib():
    """Greatest memory of this process; that of getrusage counts the process that started it too."""
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    (peak,) = (line.split()[1] for line in lines if line.startswith("VmHWM"))
    return int(peak) / 1024


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cases", type=int, default=400)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="")
    given = parser.parse_args()
    main(given.folder, given.cases, given.seed, given.only)
