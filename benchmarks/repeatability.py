"""Events at one place of a gear's turn without a healthy recording: the limit that healthy gears set, and its power.

Gears get pitch errors of the classes 5 to 9 of ISO 1328-1, as their mates do. `fast` and `slow` gears are those of
linear rigs of known counts and assumed sizes; `tooth by tooth`, an error of a tooth scales its own pass of the mesh. A
record has noise, white or falling, a number of revolutions, and a highest order, all drawn.

`healthy gears`: the ratio of the strongest pulse (`sigdb.recording.Repeatability.energy_ratio`). The limit is the
value that k of n gears exceed, with (k + 1) / (n + 1) at most 0.001, of that kind of gear where it is greatest. It
stands in `sigdb/recording/evidence/repeatability.py`, and the suite compares the two.

`pulses`: short pulses of the stated least size, at random places and with random phases, that are seen; 0.95 are
claimed.

`damaged teeth`: simulated losses of a tooth's stiffness that are seen, by class; and the rms that such damage needs,
over that of the least pulse.

`what repeats`: for other healthy gears, the share of revolutions whose strongest pulse lies at the same place, the
correlation of odd and even revolutions, and the power over that of neighbouring tooth counts. Their 95 % quantiles
stand in `repeatability.py` too.

    nice -n 5 python benchmarks/repeatability.py [--gears 14997] [--json docs/guide/repeatability.json]
    nice -n 5 python benchmarks/repeatability.py --what-repeats 999 --json docs/guide/repeatability.json  # that alone
"""

import argparse
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from measuring import environment, print_table

import sigdb
from sigdb.core import ComplexArray, FloatArray, SigdbError
from sigdb.measurement import pitch_errors
from sigdb.recording import MeshPresence
from sigdb.recording.evidence.least_event import least_event
from sigdb.recording.evidence.repeatability import repeatability
from sigdb.recording.evidence.residual_bands import ResidualBands
from sigdb.transmission import Transmission

RIGS = (
    ("10/30", 1000, 4), ("12/36", 1000, 5), ("17/51", 1500, 20), ("19/45", 1480, 40), ("23/67", 2950, 30),
    ("32/80", 1780, 20), ("20/40", 900, 60), ("36/90", 1200, 30), ("29/100", 1480, 50), ("40/60", 600, 100),
    ("55/75", 900, 50), ("24/40", 3000, 25), ("80/32", 700, 50), ("120/40", 500, 80),
)  # fmt: skip
"""Tooth counts of the averaged gear and its mate, speed (rpm), torque (N m)."""
SPEEDS, MEMBERS, SAMPLES, LOSSES = {"fast": 1.0, "slow": 0.1}, 3, 32, (0.2, 0.4, 0.6)
"""Factors of the speed, rigs of each ensemble, samples in a tooth pass, losses of a tooth's stiffness."""
TOOTH_BY_TOOTH, DEFLECTION = "tooth by tooth", 15e-6
"""Third kind of gear, and the deflection of its mesh, m: an error of that size is the whole amplitude of a pass."""
CLASSES, RATE, SEED = (5, 6, 7, 8, 9), 1e-3, 20
Rows = list[dict[str, Any]]


@dataclass(frozen=True, kw_only=True)
class Gear:
    """A gear's spectra by whole order: healthy, per metre of a tooth's error, and the change by damage of tooth 1."""

    kind: str
    teeth: int
    mate_teeth: int
    module: float
    healthy: ComplexArray
    errors: ComplexArray
    damage: ComplexArray


@dataclass(frozen=True, kw_only=True)
class Record:
    """Spectra (R, K) of the revolutions of a gear, its bands, and the change by damage of each loss."""

    spectra: ComplexArray
    highest: float
    bands: ResidualBands
    damage: ComplexArray
    tolerance_class: int
    kind: str


def main() -> None:
    """Print the tables, and write a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--gears", type=int, default=14_997, help="number of healthy gears, a third of each kind; 14997 by default"
    )
    parser.add_argument("--json", type=Path, help="file for the numbers")
    parser.add_argument("--what-repeats", type=int, help="count only what repeats, on this number of gears")
    options = parser.parse_args()
    gears = [*made_gears(), *simple_gears(np.random.default_rng(SEED))]
    if options.what_repeats is not None:
        rows = what_repeats(gears, options.what_repeats)
        print_table("what repeats", rows)
        if options.json is not None:
            document = json.loads(options.json.read_text(encoding="utf-8"))
            document["tables"]["what repeats"] = rows
            options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
        return
    limit, healthy = healthy_ratios(gears, options.gears)
    tables = {
        "healthy gears": healthy,
        "what repeats": what_repeats(gears, max(options.gears // 15, 1)),
        "pulses": [pulses(gears, max(options.gears // 30, 1), limit)],
        "damaged teeth": damaged_teeth(gears, max(options.gears // 40, 1), limit),
    }
    for title, rows in tables.items():
        print_table(title, rows)
    counted = {
        "limit": limit,
        "false_alarm_rate": RATE,
        "healthy_gears": options.gears,
        "of_each_kind": options.gears // 3,
    }
    print(counted)
    if options.json is not None:
        document = {"machine": environment("numpy", "scipy"), "counted": counted, "tables": tables}
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def made_gears() -> Iterator[Gear]:
    """Yield the gears of all rigs and sensors."""
    for number, (counts, rpm, torque) in enumerate(RIGS):
        for speed, factor in SPEEDS.items():
            rig = sigdb.new_rig(counts, speed=rpm * factor, torque=torque)
            for member in (rig, *sigdb.ensemble(rig, MEMBERS - 1, rng=SEED + number)):
                try:
                    yield from gears_of(member, speed, int(counts.split("/")[1]))
                except SigdbError as error:
                    print(f"{counts}, {speed}: left out, {error}")


def simple_gears(stream: np.random.Generator) -> Iterator[Gear]:
    """Yield gears whose teeth act one by one: two with mesh harmonics of their own for each pair of tooth counts."""
    for counts, _, _ in RIGS * 2:
        teeth, mate_teeth = map(int, counts.split("/"))
        passes = np.arange(teeth * SAMPLES) / SAMPLES
        mesh = sum(
            stream.rayleigh() / h * np.cos(2 * np.pi * (h * passes + stream.random()))
            for h in range(1, int(stream.integers(2, 7)) + 1)
        )
        begin = stream.random()
        each = np.where(np.floor(passes + begin) % teeth == np.arange(teeth)[:, None], mesh, 0.0)
        yield Gear(
            kind=TOOTH_BY_TOOTH,
            teeth=teeth,
            mate_teeth=mate_teeth,
            module=2e-3,
            healthy=np.fft.rfft(mesh) / len(passes),
            errors=np.fft.rfft(each, axis=1) / len(passes) / DEFLECTION,
            damage=-np.outer(LOSSES, np.fft.rfft(each[0]) / len(passes)),
        )


def gears_of(rig: Transmission, speed: str, mate_teeth: int) -> Iterator[Gear]:
    """Yield the gear of a rig by each sensor."""
    prepared = sigdb.Periodic(samples_per_tooth=SAMPLES).prepare(rig)
    damages = [sigdb.Damage(tooth=1, stiffness_loss=loss).on_teeth(prepared.teeth) for loss in LOSSES]
    states = prepared.steady_state([{}, *damages])
    healthy = states[0]
    n = healthy.signals.shape[-1]
    for sensor in range(len(healthy.signals)):
        yield Gear(
            kind=speed,
            teeth=prepared.teeth,
            mate_teeth=mate_teeth,
            module=next(iter(rig.meshes.values())).module or 2e-3,
            healthy=np.fft.rfft(healthy.signals[sensor]) / n,
            errors=np.fft.rfft(healthy.specimen_response[sensor].T, axis=-1) / n,
            damage=np.fft.rfft(states.signals[1:, sensor] - states.signals[0, sensor], axis=-1) / n,
        )


def record(stream: np.random.Generator, gears: list[Gear], i: int, *, tolerance_class: int | None = None) -> Record:
    """Return record i, of kinds in turn: a gear and its mate with errors, noise, length and highest order."""
    kinds = (*SPEEDS, TOOTH_BY_TOOTH)
    of_kind = [gear for gear in gears if gear.kind == kinds[i % len(kinds)]]
    gear = of_kind[i // len(kinds) % len(of_kind)]
    Z, mate_teeth = gear.teeth, gear.mate_teeth
    A = int(stream.choice(CLASSES)) if tolerance_class is None else tolerance_class
    e, mate = (pitch_errors(stream, z, module=gear.module, tolerance_class=A) for z in (Z, mate_teeth))
    R, snr_db = round(math.exp(stream.uniform(math.log(8), math.log(300)))), stream.uniform(-10, 30)
    highest = Z * stream.uniform(2.0, 14.0)
    k = np.arange(int(highest) + 1)
    meets = (np.arange(Z) + Z * np.arange(R)[:, None] + stream.integers(mate_teeth)) % mate_teeth
    spectra = gear.healthy[k] + (e + mate[meets]) @ gear.errors[:, k]
    shape = (1 + (k / (0.3 * highest)) ** 2) ** (-0.5 * stream.integers(3))
    power = 2 * np.sum(np.abs(spectra.mean(axis=0)[1:]) ** 2)
    deviation = shape * np.sqrt(power * 10 ** (-snr_db / 10) / np.sum(2 * shape**2))
    noise = stream.standard_normal((2, R, len(k))) * deviation / math.sqrt(2)
    tooth = int(stream.integers(Z))
    spectra = spectra + noise[0] + 1j * noise[1]
    bands = ResidualBands.of(spectra, teeth=Z, highest=highest)
    assert bands is not None  # two harmonics lie below the highest order
    damage = gear.damage[:, k] * np.exp(-2j * np.pi * k * tooth / Z)
    return Record(spectra=spectra, highest=highest, bands=bands, damage=damage, tolerance_class=A, kind=gear.kind)


def ratio_of(one: Record, added: ComplexArray | float = 0.0) -> float:
    """Ratio of the strongest pulse of a record, with something added to every revolution."""
    spectra = one.spectra + added
    bands = ResidualBands.of(spectra, teeth=one.bands.teeth, highest=one.highest)
    assert bands is not None
    return float(bands.pulses(spectra.mean(axis=0)[bands.orders]).ratio)


def healthy_ratios(gears: list[Gear], n: int) -> tuple[float, Rows]:
    """Limit, and quantiles of the ratio by kind, class, bands and tooth count."""
    stream = np.random.default_rng(SEED)
    found: Rows = []
    for i in range(n):
        one = record(stream, gears, i)
        Z = one.bands.teeth
        found.append(
            {
                "kind": one.kind,
                "class": one.tolerance_class,
                "bands": "1 to 3" if len(one.bands.orders) < 4 else "4 to 13",
                "teeth": "10 to 20" if Z <= 20 else "21 to 40" if Z <= 40 else "41 to 120",
                "ratio": ratio_of(one),
            }
        )
    by_kind = [[one["ratio"] for one in found if one["kind"] == kind] for kind in {one["kind"] for one in found}]
    limit = max(exceeded(ratios) for ratios in by_kind)
    rows = []
    for key in ("kind", "class", "bands", "teeth"):
        for value in sorted({one[key] for one in found}, key=str):
            ratios = np.array([one["ratio"] for one in found if one[key] == value])
            quantiles = {f"{q:g}": float(np.quantile(ratios, q)) for q in (0.5, 0.9, 0.99, 0.999)}
            above = int(np.sum(ratios > limit))
            rows.append({"of": f"{key} {value}", "gears": len(ratios), **quantiles, "above": above})
    return limit, rows


def what_repeats(gears: list[Gear], n: int) -> Rows:
    """Quantiles of what repeats from revolution to revolution of healthy gears."""
    stream = np.random.default_rng(SEED + 2)
    shares: dict[str, list[float]] = {"same place": [], "odd against even": [], "power ratio": []}
    present = MeshPresence(present=True, reason="the mesh was added", p_value=0.0)
    for i in range(n):
        one = record(stream, gears, i)
        Z, R = one.bands.teeth, len(one.spectra)
        size = Z * math.ceil(2.2 * one.spectra.shape[1] / Z)
        x = np.fft.irfft(one.spectra * size, size, axis=1).ravel()
        found = repeatability(x, samples_per_rev=size, teeth=Z, highest=one.highest, presence=present)
        if not math.isnan(found.energy_ratio):
            shares["same place"].append(found.same_place / R)
            shares["odd against even"].append(found.odd_even_correlation)
            shares["power ratio"].append(found.power_ratio)
    return [
        {"of": name, "gears": len(values), **{f"{q:g}": float(np.quantile(values, q)) for q in (0.05, 0.5, 0.95)}}
        for name, values in shares.items()
    ]


def exceeded(ratios: list[float]) -> float:
    """Return the value that k of n ratios exceed, with (k + 1) / (n + 1) at most the rate of false alarms."""
    return float(np.sort(ratios)[-max(math.floor(RATE * (len(ratios) + 1)), 1)])


def pulses(gears: list[Gear], n: int, limit: float) -> dict[str, Any]:
    """Share of short pulses of the stated least size that are seen, and quantiles of that size."""
    stream = np.random.default_rng(SEED + 1)
    sizes, seen = [], []
    for i in range(n):
        one = record(stream, gears, i)
        average = one.spectra.mean(axis=0)
        size = least_event(one.bands, average, limit)
        sizes.append(size)
        if not math.isnan(size):
            seen.append(ratio_of(one, pulse(stream, one, size)) > limit)
    judged = [size for size in sizes if not math.isnan(size)]
    return {
        "records": n,
        "judged": len(judged),
        "seen": sum(seen),
        "share": float(np.mean(seen)),
        **{f"size {q:g}": float(np.quantile(judged, q)) for q in (0.1, 0.5, 0.9)},
    }


def pulse(stream: np.random.Generator, one: Record, size: float) -> ComplexArray:
    """Return a short pulse with the residual's level, at a place and with phases of its own, by whole order."""
    bands, average = one.bands, one.spectra.mean(axis=0)
    k = np.arange(one.spectra.shape[1])
    level = bands.level(average[bands.orders])
    level = np.interp(k, bands.orders.ravel(), level.ravel(), left=0, right=0)
    phase = np.exp(2j * np.pi * stream.random(len(bands.orders)))[
        np.clip((k + (bands.teeth - 1) // 2) // bands.teeth - 1, 0, len(bands.orders) - 1)
    ]
    x = np.sqrt(level) * phase * np.exp(-2j * np.pi * k * stream.random())
    return np.asarray(x * size * rms(average) / rms(x))


def rms(spectrum: ComplexArray) -> float:
    """Return the rms of a signal, without its mean, over the root of 2."""
    return math.sqrt(float(np.sum(np.abs(spectrum[1:]) ** 2)))


def damaged_teeth(gears: list[Gear], n: int, limit: float) -> Rows:
    """Share of the losses that are seen, by class, and the rms that they need over that of the least pulse."""
    rows = []
    for A in CLASSES:
        stream = np.random.default_rng(SEED + 1 + A)
        seen: FloatArray = np.zeros(len(LOSSES))
        shares, needed = [], []
        for i in range(n):
            one = record(stream, gears, i, tolerance_class=A)
            seen += [ratio_of(one, damage) > limit for damage in one.damage]
            shares.append([rms(damage) / rms(one.spectra.mean(axis=0)) for damage in one.damage])
            if i % 10 == 0:
                needed.append(needed_size(one, limit) / least_event(one.bands, one.spectra.mean(axis=0), limit))
        by_loss = {f"loss {loss:g} seen": share / n for loss, share in zip(LOSSES, seen, strict=True)}
        median = {f"rms of {loss:g}": m for loss, m in zip(LOSSES, np.median(shares, axis=0).tolist(), strict=True)}
        known = [one for one in needed if not math.isnan(one)]
        needs = {f"needs {q:g}": known_quantile(known, q) for q in (0.25, 0.5, 0.75)}
        rows.append({"class": A, "records": n, **by_loss, **median, **needs})
    return rows


def known_quantile(values: list[float], q: float) -> float | None:
    """Return a quantile; None where it is infinite, or without values."""
    value = float(np.quantile(values, q, method="inverted_cdf")) if values else math.inf
    return value if math.isfinite(value) else None


def needed_size(one: Record, limit: float) -> float:
    """Return the smallest rms of the shape of the greatest loss from which on it is seen, over that of the average."""
    shape = one.damage[-1] / rms(one.damage[-1]) * rms(one.spectra.mean(axis=0))
    sizes = np.geomspace(0.05, 30, 33)
    unseen = np.flatnonzero([ratio_of(one, size * shape) <= limit for size in sizes])
    last = int(unseen[-1]) + 1 if unseen.size else 0
    return float(sizes[last]) if last < len(sizes) else math.inf


if __name__ == "__main__":
    main()
