"""Evaluate the identified ensemble on the paper's claims, and draw its Figures 5, 6, 8 and 9 with bands.

Usage: python benchmarks/paper_identified.py [--draws 500] [--numbers docs/guide/paper_identified.json]
                                            [--figures docs/images]

The numbers are those of [the page on the paper](../docs/guide/paper.md): margins of all claims for each member, also
of those that the search did not use; the changes under which a member still holds its targets; the modes that carry the
response; the targets in other motions and with other profiles; and the share of rigs drawn at random from the same
ranges that hold each claim.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from paper_cases import QuickResponse, targets_of
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.core import FloatArray, SigdbError, json_text, validated
from sigdb.dynamics import prepare_periodic
from sigdb.paper import identified_rigs, measures
from sigdb.paper.identified import (
    GEAR,
    MESH,
    NO_EFFECT,
    PRIOR,
    SENSOR,
    RigMargins,
    changed_rigs,
    distances,
    evaluations,
    margins_of,
    with_one_sensor,
)
from sigdb.paper.margins import HELD_OUT, TARGET_CASES, target_margins, worst
from sigdb.paper.signals import LOSSES, SHIFTS, TEETH, TOOTH, PaperSignals, signals_of
from sigdb.report import ReportSettings, save_figure, signature_figure
from sigdb.report.panels import INK, draw_distribution, draw_signal, mark_passes
from sigdb.signature import order_spectrum
from sigdb.transmission import Mesh, Range, Transmission, coupled_modes, draws, modal_system

BAND = "#9fc5b4"
OUTPUT = "displacement"
"""The motion that the identified rigs look at, in which rigs of the prior are evaluated too."""
OUTPUTS = ("displacement", "velocity", "acceleration")
ORDERS = (1, 4, 8, 12)
"""Orders at which modes are compared: those of the paper's distributions."""
RATIOS, FLANKS, COARSE = np.linspace(1.15, 2.0, 12), np.linspace(0.1, 0.6, 8), 32
"""Contact ratios and flanks of the trapezoids that are tried on a member, and samples in a tooth pass for them."""
TOGETHER = 0.25
"""Part of a range within which all members lie where they are said to have a number in common."""


def member_numbers(rig: Transmission, evaluated: RigMargins) -> dict[str, Any]:
    """Return the numbers of a member."""
    targets = {}
    for change, changed in changed_rigs(rig):
        result = margins_of(changed)
        targets[change] = result is not None and result.holds_targets
    return {
        "name": rig.name,
        "output": rig.sensors[SENSOR].quantity,
        "profile": rig.meshes["main"].profile.kind,
        **asdict(evaluated),
        "holds_when_changed": targets,
        "outputs": output_margins(rig),
        "best_trapezoid": best_trapezoid(rig),
        "modes": modes(rig),
    }


def modes(rig: Transmission) -> list[dict[str, Any]]:
    """Return for each order the mode with the greatest share in the sensor's response to a mesh force."""
    system, all_modes = modal_system(rig), coupled_modes(rig)
    row = 1 + list(rig.sensors).index(SENSOR)
    speed = abs(rig.speed(rig.gears[GEAR].shaft))
    upper = np.flatnonzero(system.poles.imag > 0)
    residues = system.outputs[row, upper] * system.inputs[upper, 0]
    answers = np.abs(residues / (1j * speed * np.array(ORDERS)[:, None] - system.poles[upper]))
    share = answers / answers.sum(axis=1, keepdims=True)
    listed = []
    for order, shares in zip(ORDERS, share, strict=True):
        pole = system.poles[upper][shares.argmax()]
        near = int(np.argmin(np.abs(all_modes.frequency_hz - pole.imag / (2 * np.pi))))
        listed.append(
            {
                "at_order": order,
                "order": float(pole.imag / speed),
                "damping_ratio": float(-pole.real / abs(pole)),
                "share": float(shares.max()),
                "moves": {part: round(energy, 2) for part, energy in list(all_modes.moves[near].items())[:2]},
            }
        )
    return listed


def output_margins(rig: Transmission) -> dict[str, dict[str, float]]:
    """Return the margins of the targets where the sensor sees each motion."""
    data = rig.model_dump()
    data["sensors"] = {output: {**data["sensors"][SENSOR], "quantity": output} for output in OUTPUTS}
    prepared = prepare_periodic(validated(Transmission, data, owner=f"rig {rig.name!r}"), gear=GEAR)
    states = [prepared.steady_state([damage], specimens=False)[0] for damage in TARGET_CASES]
    return {
        output: worst(target_margins(targets_of([state.signals[row] for state in states], 1.0)))
        for row, output in enumerate(OUTPUTS)
    }


def best_trapezoid(rig: Transmission) -> float:
    """Return the least greatest margin of the targets with a trapezoid as the profile, on a coarse grid."""
    response, mesh = QuickResponse(with_one_sensor(rig, OUTPUT), COARSE), rig.meshes[MESH]
    data = mesh.model_dump()
    margins = []
    for ratio in RATIOS:
        for flank in FLANKS:
            data["profile"] = {"kind": "trapezoid", "contact_ratio": float(ratio), "flank": float(flank)}
            try:
                targets = response.with_mesh(validated(Mesh, data, owner=MESH)).targets()
            except SigdbError:
                continue
            margins.append(max(margin.value for margin in target_margins(targets)))
    return min(margins)


def prior_numbers(count: int) -> dict[str, Any]:
    """Return the share of rigs drawn from the ranges that hold each claim, of those in contact without damage."""
    rig = with_one_sensor(sigdb.load_transmission(PRIOR), OUTPUT)
    found = []
    for _, values in zip(range(count), draws(rig, rng=1), strict=False):
        try:
            member = rig.with_assumed(values)
            prepared = prepare_periodic(member, gear=GEAR)
            if prepared.steady_state([{}], specimens=False)[0].min_compression > 0:
                found.append(RigMargins.of(signals_of(member, prepared, SENSOR), prepared))
        except SigdbError:
            continue
    claims = list(found[0].margins)
    share = {claim: float(np.mean([result.margins[claim] <= 0 for result in found])) for claim in claims}
    share["all targets"] = float(np.mean([result.holds_targets for result in found]))
    return {
        "draws": count,
        "in_contact_when_healthy": len(found),
        "output": OUTPUT,
        "share": share,
        "best_margin": {claim: min(result.margins[claim] for result in found) for claim in claims},
    }


def common(rigs: Sequence[Transmission]) -> dict[str, Any]:
    """Return where the members lie in the ranges and choices: least and greatest coordinate, or all choices."""
    prior = sigdb.load_transmission(PRIOR).assumptions
    values = [prior.values_of(rig) for rig in rigs]
    found: dict[str, Any] = {}
    for number in prior.free:
        there = [row[number.path] for row in values if number.path in row]
        if not there or number.path in found:
            continue
        if isinstance(number.assumption, Range):
            u = [number.assumption.unit(value) for value in there]
            part = [min(u), max(u)]
            found[number.path] = {
                "least": min(there),
                "greatest": max(there),
                "part": part,
                "in_common": part[1] - part[0] <= TOGETHER and number.path not in NO_EFFECT,
            }
        else:
            found[number.path] = {str(value): there.count(value) for value in sorted(set(there), key=str)}
    return found


Column = tuple[str, list[FloatArray], tuple[int, ...]]
"""Title, signals of the members, and damaged teeth."""


def figures(signals: Sequence[PaperSignals], rigs: Sequence[Transmission], folder: Path) -> None:
    """Draw Figures 5, 6, 8 and 9: the first member, and bands over all."""
    shifts = [(f"{shift:g} deg", [s.shifts[shift] for s in signals], (6,)) for shift in SHIFTS]
    losses = [(f"{100 * loss:g} % loss", [s.losses[loss] for s in signals], (6,)) for loss in LOSSES]
    teeth = [
        ("A: tooth 6 pitted", [s.pitted for s in signals], (6,)),
        ("B: tooth 6 broken between two pitted ones", [s.broken for s in signals], (5, 6, 7)),
    ]
    healthy = [s.healthy for s in signals]
    folder.mkdir(parents=True, exist_ok=True)
    for name, title, columns, panels in (
        ("5", "Figure 5: phase shift of the mesh stiffness at tooth 6", shifts, PANELS_OF_SHIFTS),
        ("6", "Figure 6: loss of mesh stiffness at tooth 6", losses, PANELS),
        ("8", "Figure 8: pitted and broken teeth, with friction", teeth, PANELS[:-1]),
        ("9", "Figure 9: distributions of the cases of Figure 8", teeth, PANELS[-1:]),
    ):
        figure = _columns(title, columns, healthy, panels)
        save_figure(figure, folder / f"identified-figure-{name}.png", ReportSettings(dots_per_inch=90))


def draw_readme(signals: PaperSignals, rig: Transmission, folder: Path) -> None:
    """Draw the first member's signature with half of a tooth's stiffness lost, for README."""
    figure = signature_figure(
        signals.losses[max(LOSSES)],
        teeth=TEETH,
        sensor=SENSOR,
        unit=rig.sensors[SENSOR].unit,
        title="The identified rig with half of the stiffness of tooth 6 lost, no noise",
        damaged=(TOOTH,),
    )
    save_figure(figure, folder / "signature.png", ReportSettings(dots_per_inch=110))


def _columns(title: str, columns: list[Column], healthy: list[FloatArray], panels: Sequence["Panel"]) -> Figure:
    with matplotlib.rc_context({"font.size": 8, "axes.titlesize": 9, "axes.titlelocation": "left"}):
        figure = Figure(figsize=(4.0 * len(columns), 1.9 * len(panels) + 0.6), layout="constrained")
        FigureCanvasAgg(figure)
        rigs = f"bands of {len(healthy)} identified rigs" if len(healthy) > 1 else "the identified rig"
        figure.suptitle(f"{title}; {rigs}", fontsize=10)
        grid = figure.subplots(len(panels), len(columns), squeeze=False, sharey="row", sharex="row")
        for axes, (name, signals, damaged) in zip(grid.T, columns, strict=True):
            axes[0].set_title(name)
            for ax, panel in zip(axes, panels, strict=True):
                panel(ax, signals, healthy, damaged)
        for ax in grid[:, 1:].flat:
            ax.set_ylabel("")
    return figure


def _band(ax: Axes, curves: FloatArray, damaged: tuple[int, ...], healthy: FloatArray | None = None) -> None:
    """Draw the range of curves (members, n) against angle, and the first one."""
    angle = np.arange(curves.shape[1] + 1) * 360 / curves.shape[1]
    closed = np.column_stack([curves, curves[:, :1]])
    ax.fill_between(angle, closed.min(axis=0), closed.max(axis=0), color=BAND, linewidth=0)
    ax.plot(angle, closed[0], color=INK, linewidth=1)
    mark_passes(ax, TEETH, damaged)
    ax.grid(axis="y", linewidth=0.4)


def _signal(ax: Axes, signals: list[FloatArray], healthy: list[FloatArray], damaged: tuple[int, ...]) -> None:
    """The first member's signal, relative to the healthy amplitude."""
    scale = np.ptp(healthy[0]) / 2
    draw_signal(ax, (signals[0] - signals[0].mean()) / scale, TEETH, damaged, (healthy[0] - healthy[0].mean()) / scale)
    ax.set_ylabel("signal / healthy amplitude")


def _local(ax: Axes, signals: list[FloatArray], healthy: list[FloatArray], damaged: tuple[int, ...]) -> None:
    """Half of the peak-to-peak of a pass about each angle, relative to the healthy one."""
    curves = [_sliding(tsa) / (np.ptp(sound) / 2) for tsa, sound in zip(signals, healthy, strict=True)]
    _band(ax, np.array(curves), damaged)
    ax.set_ylabel("amplitude / healthy")


def _sliding(tsa: FloatArray) -> FloatArray:
    width = len(tsa) // TEETH
    places = (np.arange(len(tsa))[:, None] - width // 2 + np.arange(width)) % len(tsa)
    return np.asarray(np.ptp(tsa[places], axis=1) / 2)


def _amplitude(ax: Axes, signals: list[FloatArray], healthy: list[FloatArray], damaged: tuple[int, ...]) -> None:
    """Amplitude modulation of the mesh order, less its median."""
    curves = np.array([measures.modulations(tsa, TEETH)[0] for tsa in signals])
    _band(ax, curves - np.median(curves, axis=1, keepdims=True), damaged)
    ax.set_ylabel("amplitude modulation")


def _phase(ax: Axes, signals: list[FloatArray], healthy: list[FloatArray], damaged: tuple[int, ...]) -> None:
    """Phase modulation of the mesh order, less its median."""
    curves = np.array([measures.modulations(tsa, TEETH)[1] for tsa in signals])
    # Where the amplitude nearly vanishes the phase may turn once around: within half a turn it goes on.
    turned = (curves - np.median(curves, axis=1, keepdims=True) + 180) % 360 - 180
    _band(ax, turned, damaged)
    ax.set_ylabel("phase modulation, deg")


def _spectrum(ax: Axes, signals: list[FloatArray], healthy: list[FloatArray], damaged: tuple[int, ...]) -> None:
    """Spectra relative to the healthy mesh order: ranges, and the first member."""
    lines = np.array(
        [
            np.abs(order_spectrum(tsa)[1]) / measures.line(sound, TEETH)
            for tsa, sound in zip(signals, healthy, strict=True)
        ]
    )[:, 1 : 3 * TEETH + 1]
    order = np.arange(1, lines.shape[1] + 1)
    ax.vlines(order, lines.min(axis=0), lines.max(axis=0), color=BAND, linewidth=4)
    ax.plot(order, lines[0], "_", color=INK, markersize=5)
    ax.set(xlim=(0, 3 * TEETH), xticks=np.arange(0, 3 * TEETH + 1, TEETH), ylabel="line / healthy mesh", xlabel="order")
    ax.set_ylim(bottom=0)


def _distribution(ax: Axes, signals: list[FloatArray], healthy: list[FloatArray], damaged: tuple[int, ...]) -> None:
    """The mean over the members of the distributions, each relative to its ridge."""
    mean = np.zeros((len(signals[0]), len(signals[0])))
    for tsa in signals:
        W = measures.distribution(tsa)
        mean += W / measures.ridge(W, TEETH) / len(signals)
    draw_distribution(ax, mean, TEETH, 2 * TEETH, damaged, limit=0.5)
    ax.set(ylabel="order", xlabel="angle, deg")


Panel = Callable[[Axes, list[FloatArray], list[FloatArray], tuple[int, ...]], None]
PANELS: tuple[Panel, ...] = (_signal, _local, _spectrum, _distribution)
PANELS_OF_SHIFTS: tuple[Panel, ...] = (_signal, _amplitude, _phase, _spectrum, _distribution)


def main() -> None:
    """Evaluate and draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--draws", type=int, default=500)
    parser.add_argument("--numbers", type=Path, default=Path("docs/guide/paper_identified.json"))
    parser.add_argument("--figures", type=Path, default=Path("docs/images"))
    given = parser.parse_args()
    rigs = identified_rigs()
    with threadpool_limits(1):
        prepared = [prepare_periodic(rig, gear=GEAR) for rig in rigs]
        signals = [signals_of(rig, solver, SENSOR) for rig, solver in zip(rigs, prepared, strict=True)]
        figures(signals, rigs, given.figures)
        draw_readme(signals[0], rigs[0], given.figures)
        numbers = {
            "held_out": HELD_OUT,
            "evaluations": evaluations(),
            "members": [
                member_numbers(rig, RigMargins.of(s, solver))
                for rig, s, solver in zip(rigs, signals, prepared, strict=True)
            ],
            "least_distance": float(distances(rigs).min()) if len(rigs) > 1 else None,
            "numbers": common(rigs),
            "prior": prior_numbers(given.draws),
        }
    given.numbers.write_text(json_text(numbers), encoding="utf-8")
    print(f"{given.numbers}: {len(rigs)} rigs")


if __name__ == "__main__":
    main()
