"""Fuzz recordings, recipes, rigs, statements of SQL, stored models, stored databases, and arrays for functions.

Usage: python tests/fuzz/fuzz.py [--kind KIND] [--seconds S] [--cases N] [--seed SEED] [--keep FOLDER] [--case NUMBER]

A recording whose content is known must be read as what it holds, or be refused: another separator, another unit of the
time, another header must never give another rate, unit or channel. Everything else ends in a result or in an error of
sigdb in printable lines, in bounded time and memory; what can be compared gives the right numbers. Each fault is
printed with its kind, seed and number, which ``--case`` repeats, and its file stays in the folder. Ends with 1 if there
is a fault.
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

KINDS = ("recordings", "recipes", "rigs", "sql", "models", "databases", "arrays")
MOST_MEMORY = 4 * 2**30
HANGS = 300
"""Seconds after which a case that waits, or runs in a compiled library, is given up."""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kind", choices=KINDS, help="what is fuzzed; all in turn by default")
    parser.add_argument("--seconds", type=float, default=300.0, help="time for all cases")
    parser.add_argument("--cases", type=int, default=10**9, help="number of cases")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, default=Path("build/fuzz"), help="folder for the files of faults")
    parser.add_argument("--case", type=int, help="repeat this case only")
    parser.add_argument("--formats", default="", help="kinds of recordings, with commas; all by default")
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--refusals", action="store_true", help="print refusals of files whose content is known")
    parser.add_argument("--worker", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        return _work(options)
    if options.case is not None:
        if options.kind is None:
            parser.error("--case needs --kind")
        options.first, options.cases = options.case, 1
    kinds, first = KINDS if options.kind is None else (options.kind,), options.first
    options.seconds /= len(kinds)
    faults = 0
    for options.kind in kinds:
        options.first = first
        faults += _run(options)
    return 1 if faults else 0


def _work(options):
    """Run cases in this process, and print an object for each."""
    run_case = _cases(options)
    faulthandler.enable()
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    end = time.monotonic() + options.seconds
    for number in range(options.first, options.first + options.cases):
        if time.monotonic() > end:
            break
        if not run_case(None, number):
            continue
        print(json.dumps({"begins": number}), flush=True)
        faulthandler.dump_traceback_later(HANGS, exit=True)
        start = time.process_time()
        kind, outcome, about, fault = run_case(options.worker, number)
        if fault:
            _keep(options, number)
        case = {"number": number, "kind": kind, "outcome": outcome, "about": about, "fault": fault}
        print(json.dumps(case | {"seconds": time.process_time() - start}, default=repr), flush=True)
    faulthandler.cancel_dump_traceback_later()
    return 0


def _cases(options):
    """Return a function that runs a case, or without a folder says whether there is one of a number."""
    if options.kind != "recordings":
        from targets.all_targets import run_case as run_target  # the process that starts this one needs none of it

        def run(folder, number):
            return folder is None or (options.kind, *run_target(options.kind, folder, options.seed, number))

        return run
    from cases import ORDER, run_case

    def run_recording(folder, number):
        if folder is None:
            return not options.formats or ORDER[number % len(ORDER)] in options.formats.split(",")
        return run_case(folder, options.seed, number)

    return run_recording


def _keep(options, number):
    """Keep the files of a case; pipes and devices are none."""
    kept = options.keep / f"{options.kind}-seed-{options.seed}-case-{number}"
    shutil.rmtree(kept, ignore_errors=True)

    def special(folder, names):
        return {name for name in names if not _is_plain(Path(folder, name))}

    shutil.copytree(options.worker, kept, ignore=special)


def _is_plain(path):
    return path.is_dir() or (path.is_file() and not path.is_symlink())


def _run(options):
    """Start workers one after the other, as a crash of a library ends one; print progress and faults."""
    start = time.monotonic()
    counts, faults = collections.Counter(), collections.Counter()
    slowest, shown = (0.0, None), start
    first, last = options.first, options.first + options.cases
    with tempfile.TemporaryDirectory() as folder:
        options.worker = Path(folder) / "case"
        options.worker.mkdir()
        while first < last and (left := options.seconds - (time.monotonic() - start)) > 0:
            arguments = {"worker": options.worker, "kind": options.kind, "seed": options.seed, "first": first}
            arguments |= {"cases": last - first, "seconds": left, "formats": options.formats, "keep": options.keep}
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
                    print(f"{options.kind}: {cases} cases, {wrong} faults, {shown - start:.0f} s", flush=True)
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
        print(f"FAULT --kind {options.kind} --seed {options.seed} --case {case['number']} {case['kind']} {about}")
        print(f"  {case['fault']}", flush=True)


def counts_of(counts, outcome):
    return sum(number for (_, of), number in counts.items() if of == outcome)


def _summary(counts, faults, slowest, options, seconds):
    total = sum(counts.values())
    worst = f"slowest {slowest[0]:.1f} s, case {slowest[1]}"
    print(f"\n{options.kind}: {total} cases in {seconds:.0f} s with seed {options.seed}; {worst}")
    for kind in sorted({kind for kind, _ in counts}):
        parts = [f"{counts[kind, outcome]} {outcome}" for outcome in ("read", "refused", "fault")]
        print(f"  {kind:<12} {', '.join(parts)}")
    if faults:
        print(f"{sum(faults.values())} faults of {len(faults)} causes; their files are in {options.keep}")
    return 1 if faults or not total else 0


if __name__ == "__main__":
    sys.exit(main())
