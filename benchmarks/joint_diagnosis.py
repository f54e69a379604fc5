"""How often a joint diagnosis is right, and how sure: two channels and two loads of twins that resemble no rig.

Each machine is a gearbox twin of its own seed, recorded healthy and again at loads of 30 and 50 per cent. In half of
the machines a tooth is damaged: the change of a rig's average, scaled to a share of the rms drawn evenly over its
logarithm, is added to both channels at both loads, behind ways of their own. Conditions are drawn too: nothing else is
wrong; the second channel is dead, has another gain and polarity, or is swapped with the first; or the load is another
one than that of the healthy recording. Answers are those of the diagnosis of the first channel at the first load, of
the joint rule for it, of both channels there, and of both channels at both loads. Right is no alarm without damage,
and with damage an alarm whose candidates hold the tooth.

    python benchmarks/joint_diagnosis.py [--machines 40] [--seed 0] [--json benchmarks/joint_diagnosis.json]
"""

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from gearbox_twin import TEETH, Twin
from injection import RIGS, Injection
from measuring import environment, print_table
from threadpoolctl import threadpool_limits

from sigdb.diagnosis import Diagnosis, JointDiagnosis, JointPart, diagnose_jointly, joint_answer
from sigdb.recording import Recording

CONDITIONS = ("alike", "dead", "other gain", "swapped", "other load")
CHANNELS, LOADS = ("a1", "a2"), (50.0, 30.0)
SHARES, LOSS, SECONDS = (0.05, 0.5), 0.4, 3.0
ANSWERS = {"one channel": 1, "two channels": 2, "two channels, two loads": 4}
"""Number of averages of each answer, of the parts in the order of loads, then channels."""
ALONE = "diagnosis of one channel"


@dataclass(frozen=True)
class Machine:
    """A machine with its condition and its damaged tooth, 0 for none, and what each answer says."""

    condition: str
    tooth: int
    answers: dict[str, Diagnosis | JointDiagnosis]


def main() -> None:
    """Print the tables, or write a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=40, help="machines of each condition; 40 by default")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first machine; 0 by default")
    parser.add_argument("--json", type=Path, help="file for the numbers")
    options = parser.parse_args()
    with threadpool_limits(1):
        machines = list(made(options.machines, options.seed))
    rows = [
        counted(condition, name, [each for each in machines if each.condition == condition])
        for condition in CONDITIONS
        for name in (ALONE, *ANSWERS)
    ]
    calibration = [calibrated(name, machines) for name in ANSWERS]
    print_table("Joint answers", rows)
    print_table("Calibration", calibration)
    if options.json is not None:
        tables = {"answers": rows, "calibration": calibration}
        document = {"machine": environment("numpy", "scipy"), "seed": options.seed, "tables": tables}
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def made(machines: int, first: int) -> Iterator[Machine]:
    """Yield the machines of all conditions."""
    for number in range(machines * len(CONDITIONS)):
        seed = first + number
        stream = np.random.default_rng([9, seed])
        condition = CONDITIONS[number % len(CONDITIONS)]
        tooth = int(stream.integers(1, TEETH + 1)) * int(number // len(CONDITIONS) % 2)
        share = float(np.exp(stream.uniform(*np.log(SHARES))))
        twin = Twin(seed=seed)
        healthy = [_recorded(twin, load, 1 + i)[0] for i, load in enumerate(LOADS)]
        runs = []
        for i, load in enumerate(LOADS):
            at = load + 5.0 * (condition == "other load")
            run, angle = _recorded(twin, at, 11 + i)
            if tooth:
                for place, channel in enumerate(CHANNELS):
                    damage = Injection(
                        rig=seed % RIGS, loss=LOSS, tooth=tooth, seed=10 * seed + 2 * i + place, share_of_rms=share
                    )
                    run, _ = damage.into(run, channel, angle)
            runs.append(_disturbed(replace(run, source=f"run {i}"), condition, stream))
        joint = diagnose_jointly(runs, teeth=TEETH, healthy=healthy, of_channels=CHANNELS)
        parts = sorted(joint.parts, key=lambda part: (part.recordings, part.channel))
        answers = {name: joint_answer([_alone(part) for part in parts[:count]]) for name, count in ANSWERS.items()}
        yield Machine(condition, tooth, {ALONE: parts[0].diagnosis, **answers})


def _recorded(twin: Twin, load: float, number: int) -> tuple[Recording, Any]:
    recording, angle = twin.record(load=load, number=number, seconds=SECONDS)
    return replace(recording, load=load), angle


def _disturbed(run: Recording, condition: str, stream: np.random.Generator) -> Recording:
    """Return a recording whose second channel is dead, has another gain and polarity, or is swapped with the first."""
    first, second, *rest = run.channels
    match condition:
        case "dead":
            second = replace(second, samples=1e-3 * stream.standard_normal(len(second.samples)))
        case "other gain":
            second = replace(second, samples=-2.0 * second.samples)
        case "swapped":
            first, second = replace(first, samples=second.samples), replace(second, samples=first.samples)
    return replace(run, channels=(first, second, *rest))


def _alone(part: JointPart) -> JointPart:
    return replace(part, contribution=None)


def counted(condition: str, name: str, machines: Sequence[Machine]) -> dict[str, Any]:
    """Counts of one answer in one condition."""
    sound = [each.answers[name] for each in machines if not each.tooth]
    damaged = [(each.tooth, each.answers[name]) for each in machines if each.tooth]
    located = [tooth in found.candidates for tooth, found in damaged if found.exit_code == 1]
    return {
        "condition": condition,
        "averages": name,
        "sound": len(sound),
        "false alarms": sum(found.exit_code == 1 for found in sound),
        "damaged": len(damaged),
        "right tooth": sum(located),
        "wrong tooth": len(located) - sum(located),
        "missed": sum(found.exit_code == 0 for _, found in damaged),
        "not judged": sum(found.exit_code == 3 for _, found in damaged) + sum(found.exit_code == 3 for found in sound),
        "contradictions": sum(any(note.code == "averages-contradict" for note in found.notes)
                              for found in [*sound, *(found for _, found in damaged)]),
    }  # fmt: skip


def calibrated(name: str, machines: Sequence[Machine]) -> dict[str, Any]:
    """How often damage is there where the posterior gives it a probability, and the log loss of the tooth."""
    found = [(each.tooth, each.answers[name]) for each in machines]
    some = [(tooth, one.posterior) for tooth, one in found if isinstance(one, JointDiagnosis) and one.posterior]
    damage = np.array([1 - posterior.none for _, posterior in some])
    there = np.array([tooth > 0 for tooth, _ in some])
    share = np.array([posterior.teeth[tooth - 1] if tooth else posterior.none for tooth, posterior in some])
    sure = damage >= 0.9
    least = np.array([posterior.teeth.max() / max(1 - posterior.none, 1e-300) for _, posterior in some])
    tooth_sure = sure & (least >= 0.9)
    right = np.array([tooth == 1 + int(posterior.teeth.argmax()) for tooth, posterior in some])
    return {
        "averages": name,
        "machines": len(some),
        "log loss": float(np.mean(-np.log(np.maximum(share, 1e-6)))),
        "damage above 0.9": int(sure.sum()),
        "of these damaged": float(there[sure].mean()) if sure.any() else None,
        "one tooth above 0.9": int(tooth_sure.sum()),
        "of these right": float(right[tooth_sure].mean()) if tooth_sure.any() else None,
        "damage below 0.5": int((damage < 0.5).sum()),
        "of those damaged": float(there[damage < 0.5].mean()) if (damage < 0.5).any() else None,
    }


if __name__ == "__main__":
    main()
