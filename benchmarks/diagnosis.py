"""How often a diagnosis of raw recordings is right, with a tacho and by the phase of the mesh, at two levels of noise.

A dozen recordings of the NASA rig are marched in time with backlash: nine damages and no damage three times. Each has a
speed and a torque of its own that wander, a resonance between mesh and sensor, coloured noise, jitter of the tacho and
tones of the other shaft. All are of one pair of gears with index errors. A healthy recording at another speed and load
gives the path. Right is no tooth for the healthy ones; for the others an interval with the damaged tooth, or, without a
tacho mark, any tooth, since its number is relative.

    python benchmarks/diagnosis.py [--json]
"""

import argparse
import json
from typing import Any

import numpy as np
from measuring import environment, print_table, timed
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
    parser.add_argument("--json", action="store_true", help="print JSON")
    given = parser.parse_args()
    machine = environment("numpy", "scipy")
    with threadpool_limits(1):
        rows = [diagnosed(angle, level) for angle, levels in LEVELS.items() for level in levels]
    if given.json:
        print(json.dumps({"machine": machine, "rows": rows}, indent=1))
        return
    print(", ".join(f"{key} {value}" for key, value in machine.items()))
    print_table("Diagnoses of a dozen raw recordings", rows)


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
