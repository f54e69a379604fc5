"""Speed of a whole sweep to Parquet: signatures a second on one and two cores, stages, memory, and one file a row.

The recipe is `pipelines/quick.toml` with more specimens: 768 samples, one sensor, averages of 102 revolutions. A sweep
runs in a process of its own, which starts its workers: its seconds go from the recipe to the last receipt, by the
clock. Compiled kernels are there before, as on every machine after its first sweep. Memory is the greatest resident
memory of a worker, or of the process itself where it works alone. A Dask cluster of as many processes makes the largest
sweep once more; it runs already when the clock starts.

Stages are shares of the processor time of one core. The peer does what is done by hand: each row is simulated, gets its
noise, is analysed with the public functions and saved as a MAT file of its own; once more with the simulation left out
of its time. MATLAB's figure is a published one, of another model on another machine: 208 runs of a Simulink model by
generateSimulationEnsemble in about 10 minutes, one file each (MathWorks, Predictive Maintenance Toolbox, 'Using
Simulink to Generate Fault Data', https://www.mathworks.com/help/predmaint/ug/Use-Simulink-to-Generate-Fault-Data.html).

    python benchmarks/sweep.py [--json FILE] [--rows N] [--full]

``--full`` adds 10^6 rows, which take minutes and 5 GB of the temporary directory.
"""

import argparse
import cProfile
import json
import pstats
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from measuring import environment, json_option, publish, timed
from scipy.io import savemat
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.core.streams import specimen_stream
from sigdb.database.store.schema import write_schema
from sigdb.database.store.store import Store
from sigdb.dynamics import Periodic
from sigdb.measurement import index_errors, noise_deviation
from sigdb.pipeline import load_recipe
from sigdb.signature import indicators, mesh_bands, order_spectrum, pooled_wigner_ville
from sigdb.sweep import Plan, SweepSummary, make_plan, run
from sigdb.sweep.plan.schema import plan_schema
from sigdb.sweep.work.rows import make_row_part
from sigdb.sweep.work.templates import make_template_part

RECIPE = Path(__file__).parents[1] / "pipelines" / "quick.toml"
ROWS, SCALES, FULL = 100_000, (10_000,), 1_000_000
JOBS = (1, 2)
PEER_ROWS = 100
STAGES = {
    "templates": ("make_template_part",),
    "averages": ("averages.py:__init__",),
    "signature": ("_signature",),
    "encoding": ("_encode", "encoded"),
    "file, checksums": ("_write_file",),
}
"""Functions whose time, with that of what they call, makes a stage; where files are written, less the encoding."""
MATLAB = 208 / 600
"""Rows a second, as published."""
Rows = list[dict[str, Any]]


def main() -> None:
    """Print the tables, or a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    json_option(parser)
    parser.add_argument("--rows", type=int, default=ROWS, help=f"about how many rows to make; {ROWS} by default")
    parser.add_argument("--full", action="store_true", help=f"make {FULL} rows too")
    parser.add_argument("--one", nargs=3, metavar=("ENGINE", "ROWS", "JOBS"), help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        print(json.dumps(one_sweep(given.one[0], int(given.one[1]), int(given.one[2]))))
        return
    machine = environment("numpy", "scipy", "numba", "pandas", "pyarrow", "joblib", "distributed")
    sizes = [*(size for size in SCALES if size < given.rows), given.rows, *([FULL] if given.full else [])]
    tables = measure(sizes)
    publish(machine, tables, given.json)


def measure(sizes: list[int]) -> dict[str, Rows]:
    """Tables by title."""
    in_own_process("joblib", 1, 1)  # compiles what is kept on disk
    sweeps = [in_own_process("joblib", size, jobs) for size in sizes for jobs in JOBS]
    sweeps.append(in_own_process("dask", sizes[-1], JOBS[-1]))
    rate = {(row["engine"], row["rows"], row["jobs"]): row["rows a second"] for row in sweeps}
    for row in sweeps:
        row["times one job"] = row["rows a second"] / rate["joblib", row["rows"], 1]
        row["times joblib"] = row["rows a second"] / rate["joblib", row["rows"], row["jobs"]]
    with threadpool_limits(1):
        parts, peers = stages(planned(sizes[0])), one_file_a_row(planned(sizes[0]))
    own = max(row["rows a second"] for row in sweeps if row["jobs"] == 1)
    peers = [{"by": "sigdb, on one core", "rows a second": own, "bytes a row": None}, *peers]
    for row in peers:
        row["sigdb on one core is faster by"] = own / row["rows a second"]
    return {"Whole sweeps to Parquet": sweeps, "Stages, of one core": parts, "One file a row": peers}


def planned(rows: int) -> Plan:
    """The plan of about that many rows."""
    recipe = load_recipe(RECIPE)
    sections = recipe.sections

    def of(specimens: int) -> Plan:
        design = sections.sweep.model_copy(update={"specimens": specimens})
        return make_plan(design, sections.measurement, sections.signature, recipe.rig)

    return of(max(1, round(rows / of(1).rows)))


Sweep = Callable[[Plan, str], SweepSummary]


@contextmanager
def joblib_processes(jobs: int) -> Iterator[Sweep]:
    """A sweep by worker processes of this machine, which it starts."""
    yield partial(run, jobs=jobs)


@contextmanager
def dask_cluster(jobs: int) -> Iterator[Sweep]:
    """A sweep by a Dask cluster of worker processes on this machine, which runs already."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=jobs, threads_per_worker=1, dashboard_address=":0") as cluster:
        yield partial(run, scheduler=cluster.scheduler_address)


ENGINES: dict[str, Callable[[int], AbstractContextManager[Sweep]]] = {"joblib": joblib_processes, "dask": dask_cluster}
"""What carries out a sweep, by name."""


def in_own_process(engine: str, rows: int, jobs: int) -> dict[str, Any]:
    """One sweep in a fresh process, so that its start and its memory are its own."""
    command = [sys.executable, __file__, "--one", engine, str(rows), str(jobs)]
    return dict(json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout))


def one_sweep(engine: str, rows: int, jobs: int) -> dict[str, Any]:
    """One sweep in a temporary directory, from its recipe on."""
    with tempfile.TemporaryDirectory() as folder, ENGINES[engine](jobs) as sweep:
        started = time.perf_counter()
        summary = sweep(planned(rows), folder)
        seconds = time.perf_counter() - started
    return {
        "engine": engine,
        "rows": summary.rows,
        "jobs": jobs,
        "seconds": seconds,
        "rows a second": summary.rows / seconds,
        "bytes a row": summary.bytes / summary.rows,
        "failed": summary.failed,
        "worker, MB": peak_resident(jobs > 1 or engine == "dask") / 1e6,
    }


def peak_resident(of_workers: bool) -> float:
    """Greatest resident memory of a worker that has ended, or of this process, bytes."""
    if of_workers:
        from joblib.externals.loky import get_reusable_executor

        get_reusable_executor().shutdown(wait=True)
    # Linux counts in units of 1024 bytes.
    return resource.getrusage(resource.RUSAGE_CHILDREN if of_workers else resource.RUSAGE_SELF).ru_maxrss * 1024.0


def stages(plan: Plan) -> Rows:
    """Microseconds a row and shares of the stages of a sweep in this process."""
    profile = cProfile.Profile(time.process_time)
    with tempfile.TemporaryDirectory() as folder:
        store = Store.at(folder)
        write_schema(plan_schema(plan), store)
        for profiled in (False, True):
            if profiled:
                profile.enable()
            started = time.process_time()
            for make, parts in (
                (make_template_part, plan.template_part_numbers),
                (make_row_part, plan.row_part_numbers),
            ):
                for part in parts:
                    make(plan, store, part)
            total = time.process_time() - started
        profile.disable()
    found = {name: sum(cumulative(profile, one) for one in functions) for name, functions in STAGES.items()}
    found["file, checksums"] -= cumulative(profile, "encoded")
    found["the rest"] = total - sum(found.values())
    return [
        {"stage": name, "us a row": 1e6 * seconds / plan.rows, "share": seconds / total}
        for name, seconds in (found | {"all": total}).items()
    ]


def cumulative(profile: cProfile.Profile, name: str) -> float:
    """Seconds within a function of sigdb, given as its name or as ``file:name``."""
    stats: dict[Any, Any] = pstats.Stats(profile).stats  # type: ignore[attr-defined]
    file, _, function = name.rpartition(":")
    return float(
        sum(
            seconds
            for (path, _, called), (_, _, _, seconds, _) in stats.items()
            if called == function and "sigdb" in path and path.endswith(file)
        )
    )


def one_file_a_row(plan: Plan) -> Rows:
    """The first damaged rows as a loop makes them; with the simulation, and without it."""
    table = plan.table(0, plan.rows)
    rows = table[table["tooth"] > 0].iloc[:: max(1, len(table) // PEER_ROWS)][:PEER_ROWS].to_dict("records")
    seconds, simulated = 0.0, 0.0
    with tempfile.TemporaryDirectory() as folder:
        for row in rows:
            clean, spent = timed(partial(simulated_row, plan, row))
            simulated += spent
            seconds += timed(partial(saved_row, plan, row, clean, Path(folder)))[1]
        size = sum(file.stat().st_size for file in Path(folder).iterdir())
    return [
        {
            "by": "a loop: simulate, analyse, savemat",
            "rows a second": len(rows) / (seconds + simulated),
            "bytes a row": size / len(rows),
        },
        {
            "by": "a loop: analyse, savemat",
            "rows a second": len(rows) / seconds,
            "bytes a row": size / len(rows),
        },
        {"by": "MATLAB's ensemble, as published", "rows a second": MATLAB, "bytes a row": None},
    ]


def simulated_row(plan: Plan, row: dict[Any, Any]) -> np.ndarray:
    """The clean average of one row, simulated by itself."""
    damage = sigdb.Damage(
        gear=row["gear"],
        **{name: row[name] for name in ("tooth", "damaged_teeth", "phase_shift_deg", "stiffness_loss")},
    )
    mate = plan.rig.gears[plan.rig.mate(plan.gear)].teeth
    errors = row["index_error"] * index_errors(specimen_stream(plan.seed, row["specimen"]), row["teeth"], mate)
    solver = Periodic(samples_per_tooth=plan.signature.samples_per_tooth)
    return sigdb.simulate(plan.rig, damage, index_errors=errors, solver=solver).signal(plan.sensors[0])


def saved_row(plan: Plan, row: dict[Any, Any], clean: np.ndarray, folder: Path) -> None:
    """Noise, signature and file of one row."""
    deviation = noise_deviation(clean.var(), np.array(row["snr_db"])) / np.sqrt(row["averages"])
    tsa = clean + deviation * np.random.default_rng(row["id"]).standard_normal(clean.shape)
    teeth, step = row["teeth"], plan.signature.samples_per_tooth
    cells = pooled_wigner_ville(tsa, teeth=teeth, bands=mesh_bands(teeth), lag_window=2 * step, n_bins=6 * step)
    found = {"tsa": tsa, "spectrum": np.abs(order_spectrum(tsa)[1]), "wigner_ville": cells}
    savemat(folder / f"row_{row['id']:07d}.mat", row | found | indicators(tsa, teeth=teeth))


if __name__ == "__main__":
    main()
