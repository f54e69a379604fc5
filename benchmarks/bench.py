"""All benchmarks of speed, one after the other, in their short forms.

Each stores its numbers beside itself, in FILE.json: tables, machine and versions. The pages of the documentation show
them from there, and the README's table of speed is made of them (`benchmarks/speed_table.py`). A benchmark that fails
or takes too long is named, and the others go on; its old numbers stay. Loaders are not among them, since their peers
need environments of their own (`benchmarks/loaders.py`), nor are long studies.

    python benchmarks/bench.py [NAME ...]
"""

import argparse
import subprocess
import sys
import time
from pathlib import Path

from speed_table import write_table

HERE = Path(__file__).parent
SHORT: dict[str, tuple[str, ...]] = {
    "signature": (),
    "dynamics": (),
    "sweep": ("--rows", "10000"),
    "query": (),
    "recognition": ("--rows", "2000"),
    "posteriors": ("--rows", "4000"),
    "ingest": (),
    "truncation": (),
}
"""Arguments by benchmark. All together take less than 20 minutes on two cores."""
LONGEST = 400
"""Seconds after which a benchmark is stopped."""


def main() -> None:
    """Run benchmarks, and write the table of the README from what they stored."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"some of {', '.join(SHORT)}; all if left out")
    names = parser.parse_args().names or list(SHORT)
    if unknown := sorted({*names} - {*SHORT}):
        parser.error(f"there is no {', '.join(unknown)}; choose from {', '.join(SHORT)}")
    started, failed = time.monotonic(), []
    for number, name in enumerate(names, 1):
        print(f"\n[{number}/{len(names)}] {name}, {time.monotonic() - started:.0f} s after the start", flush=True)
        command = [sys.executable, str(HERE / f"{name}.py"), *SHORT[name], "--json", str(HERE / f"{name}.json")]
        try:
            subprocess.run(command, check=True, timeout=LONGEST)
        except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
            print(f"{name}: {error}", file=sys.stderr)
            failed.append(name)
    write_table()
    print(f"\n{len(names) - len(failed)} of {len(names)} in {time.monotonic() - started:.0f} s")
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
