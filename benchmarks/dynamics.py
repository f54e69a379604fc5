"""Speed of the dynamics, as ratios: the march in time, templates, scipy's DOP853 and ROSS, all in one run.

Everything runs on one core, and seconds are its processor time, the least of several runs. Bounds are floating-point
operations over the peak that a product of matrices reaches on this core in the same run. Operations of the march are
those of its loops over the modes: 10 a mode for the mesh's force, 4 for each other force, 4 for each output. Those of a
template with s samples touched, R rows and C columns are 2/3 s^3 of its factors, 2 s^2 C of each solution and product
on the samples touched, and 2 R s C of what it adds to the healthy response. The rest of both, and so the interpolation
of a step and a template's estimate of its own error, counts in time but not in operations.

    python benchmarks/dynamics.py [--json FILE]

ROSS is measured if it can be imported: ``pip install -e '.[peers]'``.
"""

import argparse
import contextlib
import os
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from dop853 import ModalEquations, averaged
from measuring import environment, json_option, least_seconds, peak_flops, peak_megabytes, publish, timed
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.dynamics import PeriodicRig, march, prepare_periodic
from sigdb.dynamics.damage_forces import damage_change
from sigdb.dynamics.march.marcher import Marcher, mesh_tables
from sigdb.transmission import ModalSystem, ToothDamage, Transmission, elements_from, modal_system

RIG, ROSS_RIG = "nasa-spiral-bevel", "friswell-turbogenerator"
TOOTH = 6
MODES = (8, 40, 96)
STEPS, STEPS_PER_TOOTH = 100_000, 256
CASES = 32
TARGET = 1e-5
"""Error of all signals that DOP853 and the march are asked for, as a fraction of peak-to-peak."""
TOLERANCES = (1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 3e-8, 1e-8)
DOP853_RUNS = 3
MARCHES = (256, 512, 1024, 2048, 4096)
"""Steps in a tooth pass."""
MEMBER_RIGS, MEMBERS = (RIG, "spur-test-rig", "two-stage-gearbox"), 8
Rows = list[dict[str, Any]]


def main() -> None:
    """Print the tables, or a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    json_option(parser)
    given = parser.parse_args()
    with threadpool_limits(1):
        machine, tables = measure()
    publish(machine, tables, given.json)
    if "ross" not in machine:
        print("\nROSS is not installed here; it is compared after pip install -e '.[peers]'")


def measure() -> tuple[dict[str, Any], dict[str, Rows]]:
    """The machine, and tables by title."""
    rig = sigdb.load_transmission(RIG)
    prepared, peak = prepare_periodic(rig), peak_flops()
    ross = ross_steps()
    packages = ["numpy", "scipy", "numba", *(["ross-rotordynamics"] if ross else [])]
    machine = environment(*packages) | {"peak_gflops": round(peak / 1e9, 1)}
    against = dop853(rig, prepared)
    tables = {
        "March: one mesh, one recorded sensor": marches(rig, prepared.system, peak),
        f"Templates of {RIG}, 64 samples a tooth": templates(prepared, peak),
        "DOP853 from rest to the same steady state, against a template": against,
        "A simulated revolution of the march, to the same accuracy": revolutions(rig, prepared, against[0]),
        "Growth with steps, at 40 modes": growth_with_steps(rig, prepared.system),
        "Growth with modes": growth_with_modes(rig, prepared.system),
        "Growth with cases, one damaged tooth with specimens": growth_with_cases(prepared),
        "Preparing a member of an ensemble: drawn, synthesised, its steady state and stability": members(),
        "Memory": memory(rig, prepared),
    }
    if ross:
        tables[f"A step of {ROSS_RIG}, against ROSS"] = ross
        machine["ross"] = machine.pop("ross-rotordynamics")
    return machine, tables


def members() -> Rows:
    """Time the preparation of rigs drawn from what is assumed of one, those that are left out among them."""
    rows = []
    for name in MEMBER_RIGS:
        rig = sigdb.load_transmission(name)
        drawn = sigdb.ensemble(rig, MEMBERS, rng=1)
        seconds = least_seconds(partial(sigdb.ensemble, rig, MEMBERS, rng=1), repeats=3)
        draws = MEMBERS + sum(drawn.left_out.values())
        rows.append(
            {"rig": name, "free numbers": len(rig.assumptions.free), "draws": draws, "s a draw": seconds / draws}
        )
    return rows


def marches(rig: Transmission, system: ModalSystem, peak: float) -> Rows:
    """Time a step, and the fraction of the bound."""
    rows = []
    for modes in MODES:
        recorded = one_sensor(system.truncated(modes))
        step = stepping_seconds(rig, recorded, STEPS) / STEPS
        flops = modes * (10 + 4 * len(recorded.outputs))
        rows.append({"modes": modes, "ns a step": step * 1e9, "of the bound": flops / step / peak})
    return rows


def one_sensor(system: ModalSystem) -> ModalSystem:
    """The system with its mesh and the first sensor alone."""
    return replace(system, outputs=system.outputs[:2], direct=system.direct[:2], sensors=system.sensors[:1])


def stepping_seconds(rig: Transmission, system: ModalSystem, steps: int, others: int = 0) -> float:
    """Seconds of a march, with so many further forces."""
    gear = next(iter(rig.meshes.values())).driving
    teeth, speed = rig.gears[gear].teeth, abs(rig.speed(rig.gears[gear].shaft))
    tables = mesh_tables(rig, gear, {TOOTH: ToothDamage(stiffness_loss=0.5)}, np.zeros(teeth), system)
    step = 2 * np.pi / speed / (teeth * STEPS_PER_TOOTH)
    marcher = Marcher(
        system, elements_from(rig, gear, system), tables, step, np.eye(system.inputs.shape[1])[:, :others]
    )
    upper = np.count_nonzero(system.poles.imag >= 0)
    marcher.start(np.zeros(upper, complex), 0.0, np.zeros(others), np.zeros(0))
    turns = np.arange(1, steps + 1) / (teeth * STEPS_PER_TOOTH)
    forces, lift = np.zeros((steps, others)), np.zeros((steps, 0))
    return least_seconds(lambda: marcher.run(turns, forces, lift))


def templates(prepared: PeriodicRig, peak: float) -> Rows:
    """Templates a second, and the fraction of the bound."""
    rows = []
    for damaged in (1, 2, 3):
        for specimens in (True, False):
            seconds = template_seconds(prepared, damaged, specimens)
            flops = template_flops(prepared, damaged, specimens)
            rows.append(
                {
                    "damaged teeth": damaged,
                    "specimens": specimens,
                    "ms": seconds * 1e3,
                    "a second": 1 / seconds,
                    "of the bound": flops / seconds / peak,
                }
            )
    return rows


def damages(count: int, damaged: int) -> list[dict[int, ToothDamage]]:
    """Different cases of so many damaged teeth; one damaged tooth keeps contact in all of them."""
    losses = np.linspace(0.1, 0.4, count)
    return [{TOOTH + i: ToothDamage(stiffness_loss=float(loss)) for i in range(damaged)} for loss in losses]


def template_seconds(prepared: PeriodicRig, damaged: int, specimens: bool, count: int = CASES) -> float:
    """Seconds a template."""
    cases = damages(count, damaged)

    def simulate() -> None:
        for damage in cases:
            prepared.steady_state([damage], specimens=specimens)[0]

    return least_seconds(simulate) / count


def template_flops(prepared: PeriodicRig, damaged: int, specimens: bool) -> float:
    """Operations of a template; see the head of this file."""
    (damage,) = damages(1, damaged)
    mesh, force = prepared.meshes[0], float(prepared.static_force[0])
    made = damage_change(
        mesh, prepared.gear, prepared.teeth, prepared.base_pitch, damage, prepared.samples_per_tooth, force
    )
    s, rows = len(made.samples), len(prepared.response)
    columns = 1 + (prepared.teeth if specimens else 0)
    return 2 / 3 * s**3 + 2 * (2 * s**2 * columns) + 2 * rows * s * columns


def responses(prepared: PeriodicRig, columns: int) -> tuple[NDArray, NDArray]:
    """(sensors, n, columns) signals of a template, and (1 + sensors, columns) peak-to-peak of its outputs."""
    state = prepared.steady_state([damages(2, 1)[1]])[0]
    signals = np.concatenate([state.signals[..., None], state.specimen_response], axis=2)[..., :columns]
    compression = np.column_stack([state.compression, state.compression_response])[:, :columns]
    return signals, np.vstack([np.ptp(compression, axis=0), np.ptp(signals, axis=1)])


def dop853(rig: Transmission, prepared: PeriodicRig) -> Rows:
    """DOP853 with the loosest tolerance that is accurate enough, from rest until it repeats."""
    (damage,), rows = damages(2, 1)[1:], []
    fine = averaged(
        responses(prepare_periodic(rig, samples_per_tooth=256), 1 + prepared.teeth)[0].swapaxes(0, 1)[None], prepared
    )
    alone = ModalEquations(rig=rig, prepared=prepared, damage=damage, columns=1)
    size = responses(prepared, 1)[1]
    settling = alone.solve(45, TOLERANCES[-1], size, every=True)
    settled = [error(one, fine[0, ..., :1]) <= TARGET / 4 for one in settling].index(True) + 1
    for specimens in (False, True):
        columns = 1 + (prepared.teeth if specimens else 0)
        signals, size = responses(prepared, columns)
        equations, exact = replace(alone, columns=columns), fine[0, ..., :columns]
        template = template_seconds(prepared, 1, specimens)
        for tolerance in TOLERANCES:
            found, seconds = timed(partial(equations.solve, settled, tolerance, size))
            if error(found[0], exact) <= TARGET:
                break
        again = partial(equations.solve, settled, tolerance, size)
        seconds = min(seconds, *(timed(again)[1] for _ in range(DOP853_RUNS)))
        rows.append(
            {
                "specimens": specimens,
                "columns": columns,
                "template ms": template * 1e3,
                "template error": error(signals, exact),
                "DOP853 s": seconds,
                "DOP853 error": error(found[0], exact),
                "revolutions": settled,
                "times a template": seconds / template,
            }
        )
    return rows


def error(signals: NDArray, exact: NDArray) -> float:
    """Greatest difference of any signal (sensors, n, columns) as a fraction of its peak-to-peak."""
    return float((np.abs(signals - exact) / np.ptp(exact, axis=1, keepdims=True)).max())


def revolutions(rig: Transmission, prepared: PeriodicRig, dop853: dict[str, Any]) -> Rows:
    """The march with the fewest steps that is accurate enough, against DOP853 on the same equations."""
    (damage,), none, rows = damages(2, 1)[1:], np.zeros(prepared.teeth), []
    fine = averaged(responses(prepare_periodic(rig, samples_per_tooth=256), 1)[0].swapaxes(0, 1)[None], prepared)[0]
    tables, state = mesh_tables(rig, prepared.gear, damage, none, prepared.system), prepared.modal_state(damage, none)
    for per_tooth in MARCHES:
        steps = prepared.teeth * per_tooth
        marcher = Marcher(
            prepared.system,
            elements_from(rig, prepared.gear, prepared.system),
            tables,
            prepared.seconds / steps,
            np.empty((prepared.system.inputs.shape[1], 0)),
        )
        turns, nothing = np.arange(1, steps + 1) / steps, np.zeros((steps, 0))
        marcher.start(state, 0.0, np.zeros(0), np.zeros(0))
        for _ in range(dop853["revolutions"]):
            outputs, _ = marcher.run(turns, nothing, nothing)
        found = averaged(np.roll(outputs, 1, axis=0)[None, :, 1:, None], prepared)[0]
        if error(found, fine) <= TARGET:
            break
    seconds = least_seconds(lambda: marcher.run(turns, nothing, nothing))
    slower = dop853["DOP853 s"] / dop853["revolutions"]
    rows.append(
        {
            "modes": int(np.count_nonzero(prepared.system.poles.imag >= 0)),
            "steps": steps,
            "march error": error(found, fine),
            "march ms": seconds * 1e3,
            "DOP853 error": dop853["DOP853 error"],
            "DOP853 ms": slower * 1e3,
            "times the march": slower / seconds,
        }
    )
    return rows


def growth_with_steps(rig: Transmission, system: ModalSystem) -> Rows:
    """Time a step over two decades of steps."""
    recorded = one_sensor(system.truncated(40))
    counts = (10_000, 100_000, 1_000_000)
    return growth("steps", "ns a step", counts, [1e9 * stepping_seconds(rig, recorded, steps) for steps in counts])


def growth_with_modes(rig: Transmission, system: ModalSystem) -> Rows:
    """Time a step over two decades of modes: copies of four modes that share their forces, so the same response."""
    few, copies = one_sensor(system.truncated(4)), (1, 3, 10, 30, 100)
    found = [1e9 / STEPS * stepping_seconds(rig, copied(few, count), STEPS) for count in copies]
    rows = growth("modes", "ns a mode", [4 * count for count in copies], found)
    further = [(b - a) / (4 * (n - m)) for (a, b), (m, n) in zip(pairwise(found), pairwise(copies), strict=True)]
    for row, step, one in zip(rows, found, [None, *further], strict=True):
        row |= {"ns a step": step, "ns a further mode": one}
    return rows


def copied(system: ModalSystem, copies: int) -> ModalSystem:
    """A system with the same response by several times the modes."""
    return replace(
        system,
        poles=np.tile(system.poles, copies),
        inputs=np.tile(system.inputs, (copies, 1)) / copies,
        outputs=np.tile(system.outputs, copies),
    )


def growth_with_cases(prepared: PeriodicRig) -> Rows:
    """Time a case over two decades of cases."""
    counts = (10, 100, 1000)
    found = [1e6 * count * template_seconds(prepared, 1, True, count) for count in counts]
    return growth("cases", "us a case", counts, found)


def growth(what: str, unit: str, counts: Any, found: list[float]) -> Rows:
    """Rows of a cost by its count, and of the cost of one as a multiple of the first."""
    each = [cost / count for cost, count in zip(found, counts, strict=True)]
    return [{what: count, unit: one, "of the first": one / each[0]} for count, one in zip(counts, each, strict=True)]


def memory(rig: Transmission, prepared: PeriodicRig) -> Rows:
    """Greatest memory held at once, beside what was held before; what compiled code allocates is counted too."""
    calls: dict[str, Callable[[], Any]] = {
        "prepare": lambda: prepare_periodic(rig),
        "prepare, and one template": lambda: prepare_periodic(rig).steady_state([damages(1, 1)[0]])[0],
        "prepare, and one template of three damaged teeth": lambda: prepare_periodic(rig).steady_state(
            [damages(1, 3)[0]]
        )[0],
        "one template, prepared": lambda: prepared.steady_state([damages(1, 1)[0]])[0],
        "64 templates of one damaged tooth held": lambda: [prepared.steady_state([one])[0] for one in damages(64, 1)],
        "march of 0.1 s at 100 kHz": lambda: march(rig, duration=0.1, sampling_rate=1e5, system=prepared.system),
        "march of 1 s at 100 kHz": lambda: march(rig, duration=1.0, sampling_rate=1e5, system=prepared.system),
    }
    return [{"what": what, "10^6 bytes": peak_megabytes(call)} for what, call in calls.items()]


def ross_steps() -> Rows:
    """Milliseconds a step of ROSS's methods and of the march on the same rig, each with all its modes."""
    try:
        with quietly():
            import ross_time_response as peer
    except ImportError:
        return []
    rig = sigdb.load_transmission(ROSS_RIG)
    system = modal_system(rig)
    ours = stepping_seconds(rig, system, STEPS, others=4) / STEPS
    modes = np.count_nonzero(system.poles.imag >= 0)
    rows: Rows = [{"method": f"sigdb's march, {modes} modes, mesh stiffness varying", "ms": ours * 1e3, "times": 1.0}]
    methods = {
        "ROSS, state space, mesh constant": ("default", {}, 20_000),
        "ROSS, Newmark, mesh constant": ("newmark", {}, 20_000),
        "ROSS, Newmark, mesh stiffness varying": ("newmark", {"update_mesh_stiffness": True}, 1_000),
    }
    for name, (method, options, steps) in methods.items():
        pair, t = peer.geared_pair(**options), np.arange(steps + 1) * 1e-5
        seconds = least_seconds(lambda pair=pair, method=method, t=t: peer.march(pair, method, t), 3) / steps
        rows.append({"method": name, "ms": seconds * 1e3, "times": seconds / ours})
    return rows


@contextlib.contextmanager
def quietly() -> Iterator[None]:
    """Without what ROSS's libraries write to standard output, in C too, when they are loaded."""
    kept = os.dup(1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        os.dup2(kept, 1)


if __name__ == "__main__":
    main()
