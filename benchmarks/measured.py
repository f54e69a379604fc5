"""How often a diagnosis of recordings is right, against the simplest detector and classical indicators.

Damage is injected into healthy recordings of a synthetic twin, and of a public test stand. Right is no tooth for a
healthy pair, and for an injected one a tooth with the true one in its interval or next to it. Wrong is a tooth where
none is damaged, another tooth, and 'no change' where at least the damage was injected that the answer says it would
have seen. Other answers without a tooth miss the damage; 'cannot be judged' abstains.

    python benchmarks/measured.py [--spectraquest FOLDER] [--json FILE] [--page FILE]
"""

import argparse
import json
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from gearbox_twin import TEETH
from healthy_only import MeanTurn, pulse
from injection import PAIR, RIGS, SPEED, Injection, mesh_angle
from measured_cases import EMPTY, FILES, NEAR_RPM, WHICH, Machine, Question, SpectraQuest, TwinMachine, questions
from measured_page import page
from measuring import environment, timed
from scipy.stats import binomtest
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.core import FloatArray, InputError
from sigdb.diagnosis import Diagnosis, diagnose
from sigdb.diagnosis.change.templates import Templates
from sigdb.diagnosis.diagnose_signature import diagnose_signature
from sigdb.diagnosis.mate import Mate, diagnosis_of_pair
from sigdb.diagnosis.rig_templates import Source
from sigdb.recording import AveragingSettings, RecordedSignature, recorded_signature
from sigdb.signature import na4_star, residual_signal
from sigdb.transmission import Transmission

STORED = Path(__file__).with_suffix(".json")
PAGE = Path(__file__).parents[1] / "docs" / "theory" / "diagnosis_rates.md"
SAMPLES_PER_TOOTH = 64
TOOTH = ("one tooth", "several teeth")
QUIET = ("no change", "level changed")
SEEN = 0.95
"""Probability with which an answer says that it would have seen damage."""
WITHIN, VAGUE = 1.5, 2
"""Distance from the true place at which a tooth is the true one or next to it, and half the widest interval."""
Row = dict[str, Any]

ATTRIBUTION = (
    "SpectraQuest Gearbox Fault Diagnostics Simulator, as published in the repository kokikwbt/predictive-maintenance, "
    "commit 8b0fa93, datasets/gfd, CC-BY-SA"
)


def main() -> None:
    """Answer the questions about a machine, and write the JSON document and the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--spectraquest", type=Path, help="folder with the public recordings; without it, the twin")
    parser.add_argument("--json", type=Path, default=STORED, help=f"its section is replaced there; {STORED.name}")
    parser.add_argument("--page", type=Path, default=PAGE, help="the page that is made from it")
    given = parser.parse_args()
    machine = TwinMachine() if given.spectraquest is None else SpectraQuest(given.spectraquest)
    document = json.loads(given.json.read_text(encoding="utf-8")) if given.json.exists() else {}
    with threadpool_limits(1):
        document[machine.name] = section(machine)
    document = {name: document[name] for name in ("twin", "spectraquest") if name in document}
    given.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    given.page.write_text(page(document), encoding="utf-8")


def section(machine: Machine) -> Row:
    """Return the section of a machine."""
    rows, power, seconds = [], [], 0.0
    for question in questions(machine):
        row, spent = timed(lambda question=question: answer(machine, question))
        seconds += spent
        rows.append(row)
        print(_line(row), file=sys.stderr, flush=True)
        if row["empty"] or row["loss"] is not None or row["power"] is None:
            continue
        found, spent = timed(lambda question=question, row=row: injected_at_power(machine, question, row))
        seconds += spent
        power.append(found)
        print("   power:", found["smallest"], found["seen"], file=sys.stderr, flush=True)
    made = environment("numpy", "scipy") | {"seconds of processor": round(seconds)}
    made.pop("load")
    found = {"made by": made, "thresholds": thresholds(rows), "power": power_share(power), "questions": rows}
    if isinstance(machine, SpectraQuest):
        found = {"attribution": ATTRIBUTION, "recordings": FILES, "sha256": machine.checksums()} | found
    return found


def answer(machine: Machine, question: Question) -> Row:
    """Return the answer of a diagnosis and the statistics of the others, for one question."""
    pair = question.pair
    row: Row = {
        "number": question.number,
        "kind": pair.kind,
        "angle": question.angle,
        "given": question.given,
        "run": pair.run,
        "healthy": list(pair.healthy),
        "channel": pair.channel,
        "loss": None if question.injection is None else question.injection.loss,
        "empty": pair.kind in EMPTY,
    }
    recording, angle = machine.measured(pair.run)
    if question.injection is not None:
        recording, share = question.injection.into(recording, pair.channel, angle)
        row |= {"rig": question.injection.rig, "tooth": question.injection.tooth, "share_of_rms": _short(share)}
        row |= {"gear": question.injection.gear} if pair.kind == WHICH else {}
    try:
        found = diagnosis_of(machine, question, recording)
    except InputError as error:
        return row | {
            "answer": "refused",
            "outcome": "right" if row["empty"] else "abstains",
            "why": str(error),
            "power": None,
        }
    row |= {"answer": found.kind, "named": [[each.tooth, each.low, each.high] for each in found.locations]}
    row["power"] = None if found.power is None else _plain_power(found)
    row |= dict(zip(("outcome", "why"), outcome(found, row, question, angle, recording), strict=True))
    if row["empty"] or pair.kind == WHICH:
        return row
    row["score"] = _short(found.finding.score) if found.finding is not None else None
    row["indicators"] = indicator_changes(found.signature, *found.healthy[:1])
    row["floor"] = floor_of(machine, question, recording)
    return row


def diagnosis_of(machine: Machine, question: Question, recording: Any) -> Diagnosis:
    """Return the diagnosis with the facts that the question gives.

    With a rig or both counts it is that of :func:`sigdb.diagnosis.diagnose`, but for templates at the nominal speed,
    which all questions share.
    """
    pair = question.pair
    if question.given == "teeth":
        options: Row = _by_angle(question) | {"load": pair.load, "healthy_load": pair.healthy_load}
        healthy = [machine.measured(name)[0] for name in pair.healthy]
        return diagnose(recording, healthy=healthy, channel=pair.channel, teeth=TEETH, **options)
    signatures = [_signature(recording, question)]
    signatures += [_healthy_signature(machine, name, question) for name in pair.healthy]
    loads: Row = {"torque": pair.load, "healthy_torques": pair.healthy_load or [None] * len(pair.healthy)}
    found = diagnose_signature(signatures[0], signatures[1:], templates=_templates(question.given), **loads)
    if pair.kind != WHICH:
        return found
    recordings = [recording, *(machine.measured(name)[0] for name in pair.healthy)]
    settings = AveragingSettings(channel=pair.channel, gear=_GEAR, **_by_angle(question))
    mate = Mate.of(recordings, signatures, assumed_rig(question.given), settings, **loads)
    return diagnosis_of_pair(found, mate)


def _by_angle(question: Question) -> Row:
    return {"mesh_phase": True, "speed_rpm": NEAR_RPM} if question.angle == "mesh phase" else {}


def _signature(recording: Any, question: Question) -> RecordedSignature:
    rig = assumed_rig(question.given)
    return recorded_signature(recording, channel=question.pair.channel, gear=_GEAR, rig=rig, **_by_angle(question))


_SIGNATURES: dict[tuple[str, ...], RecordedSignature] = {}


def _healthy_signature(machine: Machine, name: str, question: Question) -> RecordedSignature:
    key = (machine.name, name, question.pair.channel, question.angle)
    if key not in _SIGNATURES:
        _SIGNATURES[key] = _signature(machine.measured(name)[0], question)
    return _SIGNATURES[key]


_GEAR = "pinion"


@cache
def assumed_rig(given: str) -> Transmission:
    """Return the rig that a diagnosis is given, of no injected module; or the one that it assumes for both counts."""
    if given == "rig":
        return sigdb.new_rig(teeth=PAIR, speed=SPEED, torque="20Nm", module="2mm", name="other-sizes")
    return sigdb.new_rig(teeth=PAIR, speed=SPEED, torque="50Nm", name="assumed-rig")


@cache
def _templates(given: str) -> Templates:
    rig = assumed_rig(given)
    source = Source(rig=rig, described=given == "rig")
    speed, torque = rig.operating.speed_rpm, rig.operating.torque
    return source.templates(
        gear=_GEAR, sensor=None, channel="", speed_rpm=speed, torque=torque, samples_per_tooth=SAMPLES_PER_TOOTH
    ).templates


def outcome(found: Diagnosis, row: Row, question: Question, angle: FloatArray, recording: Any) -> tuple[str, str]:
    """Return whether an answer is right, wrong, missed or abstains, and why."""
    if found.kind == "cannot be judged":
        return ("right" if row["empty"] else "abstains"), "cannot be judged"
    if row["empty"]:
        return "wrong", f"the gear is not there, and the answer is {found.kind}"
    damaged = question.injection
    if damaged is None:
        return ("right", "") if found.kind in QUIET else ("wrong", "a tooth where none is damaged")
    gear = found.signature.gear
    if found.kind in QUIET:
        if damaged.gear != (gear or _GEAR):
            return "missed", f"the {damaged.gear} is damaged"
        power = row["power"]
        size = damaged.loss if power["quantity"] == "stiffness_loss" else row["share_of_rms"]
        beyond = power["smallest"] <= size and damaged.tooth not in power["exceptions"]
        return ("wrong", "damage that it says it would have seen") if beyond else ("missed", "below the stated power")
    if damaged.gear != (gear or _GEAR):
        return "wrong", f"a tooth of the {gear}, where the {damaged.gear} is damaged"
    teeth = found.signature.teeth
    ratio = TEETH / teeth if question.angle == "tacho" else 1.0
    true = (damaged.tooth - 1 - _begin(found.signature, angle, recording, ratio)) % teeth
    first, *further = found.locations
    if first.within > VAGUE:
        return "abstains", "the interval is wider than two teeth"
    low, high = min(first.low, first.tooth - 1) - 1, max(first.high, first.tooth + 1) - 1
    off = (true - (low + high) / 2 + teeth / 2) % teeth - teeth / 2
    if abs(off) > (high - low) / 2 + 0.5:
        return "wrong", f"another tooth, {off:+.1f} off"
    apart = [far for each in further if (far := _apart(each.tooth - 1, true, teeth)) > VAGUE + 0.5]
    return ("wrong", f"a further tooth, {apart[0]:.1f} off") if apart else ("right", "")


def _begin(signature: RecordedSignature, angle: FloatArray, recording: Any, ratio: float) -> float:
    """Return the angle at which an average begins, in tooth passes from the first contact of tooth 1.

    The first speed is that over a revolution of the shaft with the tacho, which turns ``1 / ratio`` times as fast.
    """
    track = signature.speed_track
    time = track["time"].iloc[0] - 30 * ratio / track["speed_rpm"].iloc[0]
    return float(np.interp(time * recording.signals[0].sampling_rate, np.arange(len(angle)), angle))


def _apart(a: float, b: float, teeth: int) -> float:
    return abs((a - b + teeth / 2) % teeth - teeth / 2)


def indicator_changes(run: RecordedSignature | None, healthy: RecordedSignature | None = None) -> Row | None:
    """Return classical indicators of a run relative to those of the healthy recording; NA4* has it as its baseline.

    None where a recording has none, since its gear is not to be seen.
    """
    if run is None or healthy is None or not run.indicators or not healthy.indicators:
        return None
    tsa = np.array([healthy.tsa, run.tsa])
    residuals = residual_signal(tsa, teeth=TEETH)
    star = na4_star(residuals, baseline=1, scale=np.abs(tsa).max(axis=1))[-1]
    ratios = {name: run.indicators[name] / healthy.indicators[name] for name in ("fm4", "kurtosis")}
    return {"fm4": _short(ratios["fm4"]), "na4_star": _short(star), "kurtosis": _short(ratios["kurtosis"])}


def floor_of(machine: Machine, question: Question, recording: Any) -> Row:
    """Return the statistic of the healthy-only detector, and how far its tooth is from the true one."""
    pair, marked = question.pair, question.angle == "tacho"
    _, true_angle = machine.measured(pair.run)
    other, other_angle = machine.measured(pair.healthy[0])
    angle = true_angle if marked else mesh_angle(recording, TEETH, near_rpm=NEAR_RPM)
    healthy_angle = other_angle if marked else mesh_angle(other, TEETH, near_rpm=NEAR_RPM)
    run = MeanTurn.of(recording.channel(pair.channel).samples, angle, teeth=TEETH)
    healthy = MeanTurn.of(other.channel(pair.channel).samples, healthy_angle, teeth=TEETH)
    value, place = pulse(run, healthy, marked=marked)
    found: Row = {"value": _short(value)}
    if question.injection is not None:
        begin = float(np.interp(np.ceil(angle[0] / TEETH) * TEETH, angle, true_angle))
        found["off"] = _short(_apart(place, question.injection.tooth - 1 - begin, TEETH))
    return found


def thresholds(rows: Sequence[Row]) -> Row:
    """Return the greatest value of each statistic among the healthy pairs, which is its threshold."""
    healthy = [row for row in rows if row["loss"] is None and not row["empty"]]
    found = {
        name: max(row["indicators"][name] for row in healthy if row["indicators"])
        for name in ("fm4", "na4_star", "kurtosis")
    }
    return {"floor": max(row["floor"]["value"] for row in healthy if "floor" in row), **found, "pairs": len(healthy)}


def injected_at_power(machine: Machine, question: Question, row: Row) -> Row:
    """Return whether damage is seen that is as large as the stated one, of a rig that is not given."""
    power, pair = row["power"], question.pair
    teeth = [tooth for tooth in range(1, TEETH + 1) if tooth not in power["exceptions"]]
    tooth = int(np.random.default_rng([8, question.number]).choice(teeth))
    by_loss = power["quantity"] == "stiffness_loss"
    injection = Injection(
        rig=question.number % RIGS,
        loss=power["smallest"] if by_loss else 0.4,
        tooth=tooth,
        seed=question.number,
        share_of_rms=None if by_loss else power["smallest"],
    )
    recording, share = injection.into(*_channel(machine, pair.run, pair.channel))
    found = diagnosis_of(machine, question, recording)
    return {
        "question": question.number,
        **power,
        "rig": injection.rig,
        "tooth": tooth,
        "injected_share_of_rms": _short(share),
        "seen": found.kind in TOOTH,
    }


def _channel(machine: Machine, name: str, channel: str) -> tuple[Any, str, FloatArray]:
    recording, angle = machine.measured(name)
    return recording, channel, angle


def power_share(rows: Sequence[Row]) -> Row:
    """Return the share that was seen of what was stated as seen, with its exact interval of 95 %."""
    found: Row = {"stated": SEEN}
    for quantity in ("stiffness_loss", "pulse"):
        some = [row for row in rows if row["quantity"] == quantity]
        if some:
            seen = sum(row["seen"] for row in some)
            interval = binomtest(seen, len(some)).proportion_ci(0.95)
            found[quantity] = {
                "seen": seen,
                "of": len(some),
                "low": _short(interval.low),
                "high": _short(interval.high),
            }
    return found | {"tried": list(rows)}


def _plain_power(found: Diagnosis) -> Row | None:
    power = found.power
    if power is None or power.smallest is None:
        return None
    return {
        "quantity": power.quantity,
        "smallest": power.smallest,
        "share_of_rms": None if power.share_of_rms is None else _short(power.share_of_rms),
        "exceptions": [int(tooth) for tooth in power.exceptions["tooth"]],
    }


def _short(value: float) -> float:
    return float(f"{value:.4g}")


def _line(row: Row) -> str:
    power = row["power"]["smallest"] if row["power"] else ""
    return (
        f"{row['number']:3d} {row['kind']:14s} {row['angle']:10s} {row['given']:6s} {row['run']:18s} {row['channel']} "
        f"loss {row['loss']} -> {row['answer']} {row.get('named', '')} {row['outcome']} {row['why'][:60]} "
        f"score {row.get('score')} power {power} floor {row.get('floor')} {row.get('indicators')}"
    )


if __name__ == "__main__":
    main()
