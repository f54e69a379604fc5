"""What a diagnosis costs, and how often that of raw recordings is right: by a tacho, by the phase, at two noise levels.

Cost: the command as a whole, imports and reading included, on two recordings of the gearbox twin, 6 s of four channels,
with tooth counts and one healthy recording, with a stored reference, and with the counts of one gear alone. Processor
time on one core, greatest memory of the process, and the time over that of the healthy-only detector in the same run.

A dozen recordings of the NASA rig are marched in time with backlash: nine damages and no damage three times. Each has a
speed and a torque of its own that wander, a resonance between mesh and sensor, coloured noise, jitter of the tacho and
tones of the other shaft. All are of one pair of gears with index errors. A healthy recording at another speed and load
gives the path. Right is no tooth for the healthy ones; for the others an interval with the damaged tooth, or, without a
tacho mark, any tooth, since its number is relative.

    python benchmarks/diagnosis.py [--json FILE]                             # both
    python benchmarks/diagnosis.py --cost docs/guide/diagnosis_cost.json   # the cost alone, as the guide shows it
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from gearbox_twin import TEETH, Twin
from healthy_only import MeanTurn, pulse
from measuring import environment, json_option, least_seconds, publish, timed
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.diagnosis import Diagnosis, diagnose
from sigdb.recording import Surroundings, synthetic_recording
from sigdb.recording.synthetic.surroundings import Drift
from sigdb.transmission import Transmission

RATE, REVOLUTIONS = 102.4e3, 140
INDEX_ERROR, SEED = 2e-6, 5
LEVELS = {"tacho": (30.0, -10.0), "mesh phase": (10.0, -10.0)}
"""Signal-to-noise ratios of one revolution, dB; the phase of the mesh needs no test without noise."""

DAMAGES = (
    None,
    None,
    None,
    *(sigdb.Damage(tooth=6, stiffness_loss=loss) for loss in (0.1, 0.2, 0.4, 0.6)),
    *(sigdb.Damage(tooth=2, phase_shift_deg=shift) for shift in (1.5, 3.0)),
    sigdb.Damage(tooth=9, stiffness_loss=0.2, damaged_teeth=2),
    sigdb.Damage(tooth=12, stiffness_loss=0.4, damaged_teeth=2),
    sigdb.Damage(tooth=4, stiffness_loss=0.2, phase_shift_deg=1.5),
)


def main() -> None:
    """Print the tables, or a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    json_option(parser)
    parser.add_argument("--cost", type=Path, help="measure the cost alone, and write it into this file")
    given = parser.parse_args()
    machine = environment("numpy", "scipy")
    costs = cost()
    if given.cost is not None:
        publish(machine, {"cost": costs}, given.cost)
        return
    with threadpool_limits(1):
        rows = [diagnosed(angle, level) for angle, levels in LEVELS.items() for level in levels]
    publish(machine, {"cost": costs, "Diagnoses of a dozen raw recordings": rows}, given.json)


def cost() -> list[dict[str, Any]]:
    """Processor time and memory of the command, each the least of three runs after one that fills the caches."""
    with tempfile.TemporaryDirectory() as folder:
        names = {"new": Path(folder, "new.csv"), "run": Path(folder, "run.csv")}
        turns = {}
        for number, (name, path) in enumerate(names.items()):
            one, angle = Twin(seed=1).record(load=50.0, number=number + 1)
            turns[name] = (one.channel("a1").samples, angle)
            columns = np.column_stack([channel.samples for channel in one.channels])
            header = ",".join(channel.name for channel in one.channels)
            np.savetxt(path, columns, delimiter=",", header=header, comments="", fmt="%.6g")
        floor = least_seconds(lambda: _floor(turns), repeats=5)
        reference = Path(folder, "machine.npz")
        base = ("diagnose", str(names["run"]), "--sampling-rate", "12800", "--tacho", "tacho")
        healthy = ("--healthy", str(names["new"]))
        cases = {
            "counts 32/80, one healthy recording": (*base, *healthy, "--teeth", "32/80"),
            "counts 32/80, stored reference": (*base, "--healthy", str(reference), "--teeth", "32/80"),
            "count 32, one healthy recording": (*base, *healthy, "--teeth", "32"),
        }
        command(*base, *healthy, "--teeth", "32/80", "--save-reference", str(reference))
        rows = []
        for case, arguments in cases.items():
            runs = [command(*arguments) for _ in range(3)]
            seconds = min(seconds for seconds, _ in runs)
            over = seconds / floor
            rows.append({"case": case, "seconds": seconds, "MB": min(peak for _, peak in runs), "over floor": over})
    return rows


def _floor(turns: dict[str, Any]) -> None:
    new, run = (MeanTurn.of(x, angle, teeth=TEETH) for x, angle in (turns["new"], turns["run"]))
    pulse(run, new, marked=True)


def command(*arguments: str) -> tuple[float, float]:
    """Processor time (s) and greatest memory (10^6 bytes) of a command of sigdb on one core."""
    process = subprocess.Popen(
        [sys.executable, "-m", "sigdb", *arguments],
        stdout=subprocess.DEVNULL,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )
    _, status, usage = os.wait4(process.pid, 0)
    assert os.waitstatus_to_exitcode(status) in (0, 1), arguments
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3


def diagnosed(angle: str, snr_db: float) -> dict[str, Any]:
    """Counts of one line."""
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    healthy = recording(rig, None, snr_db, number=len(DAMAGES))
    counts = {"right": 0, "no damage called damage": 0, "wrong tooth": 0, "cannot be judged": 0, "missed": 0}
    seconds = 0.0
    for number, damage in enumerate(DAMAGES):
        one = recording(rig, damage, snr_db, number=number)
        found, spent = timed(lambda one=one: diagnose(one, rig, healthy=healthy, mesh_phase=angle == "mesh phase"))
        counts[judged(found, damage)] += 1
        seconds += spent
    return {"angle": angle, "snr_db": snr_db, "of": len(DAMAGES)} | counts | {"seconds each": seconds / len(DAMAGES)}


def judged(found: Diagnosis, damage: sigdb.Damage | None) -> str:
    """Under which count an answer falls."""
    if found.kind == "cannot be judged":
        return found.kind
    if damage is None:
        return "no damage called damage" if found.exit_code else "right"
    if not found.exit_code:
        return "missed"
    return "right" if not found.absolute or damage.tooth in found.candidates else "wrong tooth"


def recording(rig: Transmission, damage: sigdb.Damage | None, snr_db: float, *, number: int) -> Any:
    """A raw recording at a speed, a torque and with noise of its own."""
    errors = INDEX_ERROR * np.random.default_rng(SEED).standard_normal(rig.gears["pinion"].teeth)
    surroundings = Surroundings(
        speed=Drift(offset=0.005 * np.cos(number), depth=0.01, period=0.2),
        torque=Drift(offset=0.02 * np.sin(number), depth=0.01, period=0.15),
        path={"frequency": 9000.0, "damping_ratio": 0.05, "gain": 3.0},
        noise={"snr_db": snr_db, "corner_frequency": 8000.0},
        tacho={"jitter": 1e-6},
        shafts=({"shaft": "gear-shaft", "amplitude": 0.1, "harmonics": (1, 2, 3)},),
    )
    return synthetic_recording(
        rig,
        damage,
        sampling_rate=RATE,
        revolutions=REVOLUTIONS,
        index_errors=errors - errors.mean(),
        surroundings=surroundings,
        seed=number,
    )


if __name__ == "__main__":
    main()
