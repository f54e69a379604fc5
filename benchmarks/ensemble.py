"""Naming the damaged tooth of an unknown rig: templates of an ensemble against those of one assumed rig.

Unknown rigs are drawn from the ranges of a shipped rig, and so are, by another seed, the rigs that make templates. A
tooth of an unknown rig loses stiffness. Its average, less the rig's own healthy one, with white noise of a tenth of the
difference's root mean square, is compared with the differences of all templates, at every tooth and severity. The
greatest correlation names the tooth. Only the shape counts, so the sensor's gain may be unknown.

The templates are of the rig as it is shipped, of one drawn rig (the mean over eight), or of several drawn rigs. A row
counts exact teeth, or teeth that are right within one.

    python benchmarks/ensemble.py [--unknown 60] [--json docs/guide/ensemble.json]
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from measuring import environment, print_table

import sigdb
from sigdb.core import FloatArray, IntArray
from sigdb.dynamics import damaged_gear, prepare_periodic
from sigdb.transmission import ToothDamage, Transmission, load_transmission, small_matrices

RIGS = {
    "nasa-spiral-bevel": ("pinion-vertical", "pinion-housing-vertical"),
    "spur-test-rig": ("pinion-vertical",),
}
LOSSES = (0.1, 0.2, 0.3, 0.5)
COUNTS = (2, 4, 8, 16)
NOISE, DRAWS = 0.1, 4
KNOWN_SEED, UNKNOWN_SEED = 1, 2
Rows = list[dict[str, Any]]


def main() -> None:
    """Print the table, and write a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--unknown", type=int, default=60, help="number of unknown rigs")
    parser.add_argument("--json", type=Path, help="file for the numbers")
    options = parser.parse_args()
    rows = [row for name in RIGS for row in shares(name, options.unknown)]
    print_table("Share of cases whose tooth is named", rows)
    if options.json is not None:
        document = {"machine": environment("numpy", "scipy"), "tables": {"unknown rigs": rows}}
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


@small_matrices
def shares(name: str, unknown: int) -> Rows:
    """Rows of a rig: for each sensor, and for each set of templates, how often the tooth is named."""
    rig = load_transmission(name)
    shipped = differences(rig)
    known = [differences(member) for member in sigdb.ensemble(rig, max(COUNTS), rng=KNOWN_SEED)]
    cases = np.array([differences(member) for member in sigdb.ensemble(rig, unknown, rng=UNKNOWN_SEED)])
    teeth = rig.gears[damaged_gear(rig, None)].teeth
    rows = []
    for sensor in RIGS[name]:
        row = list(rig.sensors).index(sensor)
        off = {
            "shipped_rig": [teeth_off([shipped[:, row]], cases[:, :, row], teeth)],
            "one_drawn_rig": [teeth_off([each[:, row]], cases[:, :, row], teeth) for each in known[:8]],
            **{
                f"{count}_drawn_rigs": [teeth_off([each[:, row] for each in known[:count]], cases[:, :, row], teeth)]
                for count in COUNTS
            },
        }
        for named, most in (("exactly", 0), ("within one", 1)):
            found = {label: float(np.mean(np.array(each) <= most)) for label, each in off.items()}
            rows.append({"rig": name, "sensor": sensor, "named": named, "chance": (1 + 2 * most) / teeth, **found})
    return rows


def differences(rig: Transmission) -> FloatArray:
    """Return the averages of a rig whose tooth 1 is damaged, less the healthy one, (losses, sensors, n)."""
    prepared = prepare_periodic(rig, gear=damaged_gear(rig, None), refine=False)
    damages = [{}, *({1: ToothDamage(stiffness_loss=loss)} for loss in LOSSES)]
    signals = prepared.steady_state(damages, specimens=False).signals
    return np.asarray(signals[1:] - signals[0])


def teeth_off(templates: list[FloatArray], cases: FloatArray, teeth: int) -> IntArray:
    """Return by how many teeth templates miss the tooth of cases (rigs, losses, n), for each case and draw of noise.

    Each of the templates is (losses, n).
    """
    rng = np.random.default_rng(0)
    rows = np.concatenate(templates)
    spectra = np.fft.rfft(rows / np.linalg.norm(rows, axis=1, keepdims=True), axis=1).conj()
    off = []
    for x in cases.reshape(-1, cases.shape[2]):
        noise = rng.standard_normal((DRAWS, len(x))) * NOISE * np.sqrt(np.mean(x**2))
        correlation = np.fft.irfft(np.fft.rfft(x + noise, axis=1)[:, None] * spectra, n=len(x), axis=2)
        tooth = correlation[:, :, :: len(x) // teeth].max(axis=1).argmax(axis=1)
        off.append(np.minimum(tooth, teeth - tooth))
    return np.array(off)


if __name__ == "__main__":
    main()
