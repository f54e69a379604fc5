"""Fuzz the reading of recordings: files whose content is known, damaged files, options and side files at random.

Usage: python tests/fuzz/recordings.py [--seconds S] [--cases N] [--seed SEED] [--keep FOLDER] [--case NUMBER]

A file whose content is known must be read as what it holds, or be refused: another separator, another unit of the time,
another header must never give another rate, unit or channel. Any file at all ends in a recording or in one printable
line, in bounded time and memory. Each fault is printed with its seed and number, which ``--case`` repeats, and its file
stays in the folder. Ends with 1 if there is a fault.
"""

import argparse
import collections
import faulthandler
import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MOST_MEMORY = 4 * 2**30
HANGS = 300
"""Seconds after which a case that waits, or runs in a compiled library, is given up."""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=300.0, help="time for all cases")
    parser.add_argument("--cases", type=int, default=10**9, help="number of cases")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, default=Path("build/fuzz"), help="folder for the files of faults")
    parser.add_argument("--case", type=int, help="repeat this case only")
    parser.add_argument("--kinds", default="", help="kinds of cases, with commas; all by default")
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--refusals", action="store_true", help="print refusals of files whose content is known")
    parser.add_argument("--worker", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        return _work(options)
    if options.case is not None:
        options.first, options.cases = options.case, 1
    return _run(options)


def _work(options):
    """Run cases in this process, and print an object for each."""
    from cases import ORDER, run_case  # the process that starts this one needs none of it

    faulthandler.enable()
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    end = time.monotonic() + options.seconds
    for number in range(options.first, options.first + options.cases):
        if time.monotonic() > end:
            break
        if options.kinds and ORDER[number % len(ORDER)] not in options.kinds.split(","):
            continue
        print(json.dumps({"begins": number}), flush=True)
        faulthandler.dump_traceback_later(HANGS, exit=True)
        start = time.process_time()
        kind, outcome, about, fault = run_case(options.worker, options.seed, number)
        if fault:
            _keep(options, number)
        case = {"number": number, "kind": kind, "outcome": outcome, "about": about, "fault": fault}
        print(json.dumps(case | {"seconds": time.process_time() - start}, default=repr), flush=True)
    faulthandler.cancel_dump_traceback_later()
    return 0


def _keep(options, number):
    """Keep the files of a case."""
    kept = options.keep / f"seed-{options.seed}-case-{number}"
    shutil.rmtree(kept, ignore_errors=True)
    shutil.copytree(options.worker, kept)


def _run(options):
    """Start workers one after the other, as a crash of a library ends one; print progress and faults."""
    start = time.monotonic()
    counts, faults = collections.Counter(), collections.Counter()
    slowest, shown = (0.0, None), start
    first, last = options.first, options.first + options.cases
    with tempfile.TemporaryDirectory() as folder:
        options.worker = Path(folder)
        while first < last and (left := options.seconds - (time.monotonic() - start)) > 0:
            arguments = {"worker": folder, "seed": options.seed, "first": first, "cases": last - first, "seconds": left,
                         "kinds": options.kinds, "keep": options.keep}  # fmt: skip
            words = [f"--{name}={value}" for name, value in arguments.items()]
            worker = subprocess.Popen(
                [sys.executable, "-W", "error", __file__, *words], stdout=subprocess.PIPE, text=True
            )
            begun = False
            for line in worker.stdout:
                begun, case = True, json.loads(line)
                if "begins" in case:
                    first = case["begins"]
                    continue
                counts[case["kind"], case["outcome"]] += 1
                slowest = max(slowest, (case["seconds"], case["number"]))
                if options.refusals and "line" in case["about"]:
                    print(f"REFUSED --case {case['number']} {case['kind']} {case['about']}")
                if case["fault"]:
                    _show(case, faults, options)
                if time.monotonic() - shown > 10:
                    shown = time.monotonic()
                    cases, wrong = sum(counts.values()), counts_of(counts, "fault")
                    print(f"{cases} cases, {wrong} faults, {shown - start:.0f} s", flush=True)
            if worker.wait() == 0:
                break
            if not begun:
                print("the cases cannot be imported", file=sys.stderr)
                return 1
            _keep(options, first)
            fault = f"crash: exit code {worker.returncode}"
            _show({"number": first, "kind": "crash", "about": {}, "fault": fault}, faults, options)
            counts["crash", "fault"] += 1
            first += 1
    return _summary(counts, faults, slowest, options, time.monotonic() - start)


def _show(case, faults, options):
    """Print a fault, unless one with the same cause was printed."""
    about = {key: value for key, value in case["about"].items() if key != "line"}
    cause = (case["kind"], case["fault"].split(":")[0], json.dumps(about, sort_keys=True))
    faults[cause] += 1
    if faults[cause] == 1:
        print(f"FAULT --seed {options.seed} --case {case['number']} {case['kind']} {about}")
        print(f"  {case['fault']}", flush=True)


def counts_of(counts, outcome):
    return sum(number for (_, of), number in counts.items() if of == outcome)


def _summary(counts, faults, slowest, options, seconds):
    total = sum(counts.values())
    print(f"\n{total} cases in {seconds:.0f} s with seed {options.seed}; slowest {slowest[0]:.1f} s, case {slowest[1]}")
    for kind in sorted({kind for kind, _ in counts}):
        parts = [f"{counts[kind, outcome]} {outcome}" for outcome in ("read", "refused", "fault")]
        print(f"  {kind:<12} {', '.join(parts)}")
    if faults:
        print(f"{sum(faults.values())} faults of {len(faults)} causes; their files are in {options.keep}")
    return 1 if faults or not total else 0


if __name__ == "__main__":
    sys.exit(main())
