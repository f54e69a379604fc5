"""The page of a rig: its numbers as tables of text."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from sigdb.report.text_table import PLAIN, Column, Terminal, TextTable, number, word
from sigdb.transmission import CoupledModes, RigFacts


def rig_text(facts: RigFacts, *, terminal: Terminal = PLAIN) -> str:
    """Return the numbers of a rig as a page of text.

    Parameters
    ----------
    facts
        What :func:`sigdb.transmission.describe_rig` returns.
    terminal
        Where the text is shown.

    Returns
    -------
    str
        Title, operating point, a table for each kind of part that the rig has, frequencies, resonances, and the
        origins of the numbers.
    """
    blocks = [_head(facts)]
    for title, key, columns in _TABLES:
        if facts[key]:
            blocks.append(f"{title}\n{_table(columns, facts[key], terminal)}")
    blocks += [*_frequencies(facts, terminal), _origins(facts["origins"])]
    return "\n\n".join(blocks) + "\n"


def modes_text(modes: CoupledModes, *, count: int | None = None, terminal: Terminal = PLAIN) -> str:
    """Return the modes of a rig as aligned text, the lowest first.

    Parameters
    ----------
    modes
        What :func:`sigdb.transmission.coupled_modes` returns.
    count
        Number of modes to show; all of them by default.
    terminal
        Where the text is shown.
    """
    head = ("mode", "frequency, Hz", "damping ratio", "moves (share of kinetic energy)")
    rows = [
        [str(i), f"{frequency:.1f}", f"{ratio:z.4f}", _moves(moves)]
        for i, (frequency, ratio, moves) in enumerate(
            zip(modes.frequency_hz, modes.damping_ratio, modes.moves, strict=True), start=1
        )
    ]
    return TextTable(head, rows[:count]).text(terminal) + "\n"


def _table(columns: Sequence[Column[Any]], rows: Sequence[Any], terminal: Terminal) -> str:
    return TextTable.of(columns, rows).text(terminal, indent=2)


def _list(values: Sequence[float]) -> str:
    return " ".join(f"{value:g}" for value in values)


def _hertz(value: float) -> str:
    return f"{value:.6g}"


def _end(row: Mapping[str, Any]) -> str:
    if row["to_shaft"] is None:
        return f"machine of {row['inertia']:.4g} kg m^2"
    return f"shaft {row['to_shaft']}, node {row['to_node']}"


def _place(row: Mapping[str, Any]) -> str:
    return f"gear {row['gear']}" if row["gear"] else f"casing point {row['point']}"


def _moves(moves: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {share:.0%}" for name, share in list(moves.items())[:3] if share >= 0.05)


_NAME: Column[Any] = ("name", lambda row: word(row["name"]))
_WHERE: tuple[Column[Any], Column[Any]] = (
    ("shaft", lambda row: word(row["shaft"])),
    ("node", lambda row: word(row["node"])),
)
_INERTIA: tuple[Column[Any], ...] = (
    ("mass, kg", lambda row: number(row["mass"])),
    ("Ip, kg m^2", lambda row: number(row["polar_inertia"])),
    ("Id, kg m^2", lambda row: number(row["diametral_inertia"])),
)
_MODE: tuple[Column[Any], ...] = (
    ("frequency, Hz", lambda row: f"{row['frequency_hz']:.1f}"),
    ("damping ratio", lambda row: f"{row['damping_ratio']:z.4f}"),
)

_MOVES: Column[Any] = ("moves", lambda row: _moves(row["moves"]))

_Parts = Literal[
    "shafts", "gears", "disks", "meshes", "tooth_forces", "bearings", "couplings", "casing", "sensors", "excitations"
]
_TABLES: tuple[tuple[str, _Parts, Sequence[Column[Any]]], ...] = (
    (
        "Shafts",
        "shafts",
        (
            _NAME,
            ("segments", lambda row: word(row["segments"])),
            ("nodes", lambda row: word(row["nodes"])),
            ("length, m", lambda row: number(row["length"])),
            ("mass, kg", lambda row: number(row["mass"])),
            ("speed, rpm", lambda row: number(row["speed_rpm"], 6)),
            ("speed, Hz", lambda row: _hertz(row["speed_hz"])),
            ("motions", lambda row: " ".join(row["motions"])),
        ),
    ),
    (
        "Gears (at the mean pitch radius)",
        "gears",
        (
            _NAME,
            *_WHERE,
            ("teeth", lambda row: word(row["teeth"])),
            ("radius, mm", lambda row: number(row["pitch_radius"] * 1e3)),
            ("pitch angle, deg", lambda row: number(row["pitch_angle_deg"], 5)),
            *_INERTIA,
        ),
    ),
    ("Disks", "disks", (_NAME, *_WHERE, *_INERTIA)),
    (
        "Meshes (static, under the mean torque)",
        "meshes",
        (
            _NAME,
            ("driving", lambda row: word(row["driving"])),
            ("driven", lambda row: word(row["driven"])),
            ("ratio", lambda row: number(row["ratio"], 5)),
            ("stiffness, N/m", lambda row: number(row["stiffness"])),
            ("contact ratio", lambda row: number(row["contact_ratio"])),
            ("normal force, N", lambda row: number(row["normal_force"], 5)),
            ("compression, um", lambda row: number(row["static_compression"] * 1e6)),
        ),
    ),
    (
        "Tooth forces, N (radial: towards the gear's axis; axial: along its shaft's z)",
        "tooth_forces",
        (
            ("mesh", lambda row: word(row["mesh"])),
            ("gear", lambda row: word(row["gear"])),
            ("tangential", lambda row: number(row["tangential"], 5)),
            ("radial", lambda row: number(row["radial"], 5)),
            ("axial", lambda row: number(row["axial"], 5)),
        ),
    ),
    (
        "Bearings (along x, y, z in N/m and N s/m, about x, y, z in N m/rad and N m s/rad)",
        "bearings",
        (
            _NAME,
            *_WHERE,
            ("seat", lambda row: row["seat"] or "ground"),
            ("stiffness", lambda row: _list(row["stiffness"])),
            ("damping", lambda row: _list(row["damping"])),
            ("cross terms", lambda row: "yes" if row["cross_terms"] else "no"),
        ),
    ),
    (
        "Couplings",
        "couplings",
        (
            _NAME,
            *_WHERE,
            ("to", _end),
            ("stiffness, N m/rad", lambda row: number(row["stiffness"])),
            ("damping, N m s/rad", lambda row: number(row["damping"])),
        ),
    ),
    (
        "Casing modes",
        "casing",
        (
            *_MODE,
            ("modal mass, kg", lambda row: number(row["modal_mass"])),
            ("points", lambda row: ", ".join(row["shape"])),
        ),
    ),
    (
        "Sensors",
        "sensors",
        (
            _NAME,
            ("at", _place),
            ("direction", lambda row: _list(row["direction"])),
            ("measures", lambda row: word(row["quantity"])),
            ("unit", lambda row: word(row["unit"])),
        ),
    ),
    (
        "Other excitations",
        "excitations",
        (
            ("what", lambda row: word(row["what"])),
            ("size", lambda row: number(row["size"])),
            ("unit", lambda row: word(row["unit"])),
            ("shaft", lambda row: word(row["shaft"])),
        ),
    ),
)


def _head(facts: RigFacts) -> str:
    at = facts["operating"]
    lines = [f"{facts['name']}: {facts['title']}" if facts["title"] else facts["name"]]
    if at["drive"] is None:
        lines.append(f"{at['speed_rpm']:g} rpm of shaft {at['drive_shaft']}, no torque")
    else:
        power = at["torque"] * at["speed_rpm"] * math.pi / 30
        lines.append(
            f"{at['speed_rpm']:g} rpm and {at['torque']:g} N m ({power / 1e3:.4g} kW) from {at['drive']} "
            f"on shaft {at['drive_shaft']} to {at['load']}"
        )
    lines.append(f"damping ratio of the rotors' modes {facts['damping_ratio']:g}")
    return "\n".join(lines)


def _frequencies(facts: RigFacts, terminal: Terminal) -> list[str]:
    blocks = []
    if facts["meshes"]:
        columns: tuple[Column[Any], ...] = (
            ("mesh", lambda row: word(row["name"])),
            ("mesh, Hz", lambda row: _hertz(row["mesh_frequency_hz"])),
            ("twice", lambda row: f"{row['harmonics_hz'][1]:.6g}"),
            ("three times", lambda row: f"{row['harmonics_hz'][2]:.6g}"),
            ("tooth cycle, Hz", lambda row: _hertz(row["tooth_cycle_hz"])),
        )
        note = "tooth cycle = mesh frequency x gcd(z1, z2) / (z1 z2): how often the same two teeth meet"
        blocks.append(f"Mesh frequencies\n{_table(columns, facts['meshes'], terminal)}\n{note}")
    title = f"Natural frequencies ({len(facts['modes'])} shown; moves: share of kinetic energy)"
    block = f"{title}\n{_table((*_MODE, _MOVES), facts['modes'], terminal)}"
    if facts["overdamped"]:
        block += f"\n{facts['overdamped']} more do not vibrate: they are overdamped"
    return [*blocks, block, _warnings(facts["resonances"], terminal)]


def _warnings(resonances: Sequence[object], terminal: Terminal) -> str:
    if not resonances:
        return "No natural frequency is within 5 % of a shaft's speed or of the first three harmonics of a mesh"
    columns: tuple[Column[Any], ...] = (
        *_MODE,
        ("is near", lambda row: f"{row['order']} x {row['excited_by']}"),
        ("at, Hz", lambda row: f"{row['excitation_hz']:.1f}"),
        _MOVES,
    )
    return f"Resonance: natural frequencies within 5 % of an excitation\n{_table(columns, resonances, terminal)}"


def _origins(origins: Mapping[str, int]) -> str:
    counts = ", ".join(f"{count} {origin}" for origin, count in origins.items() if origin != "unstated")
    return f"Numbers by origin: {counts}, {origins['unstated']} without a source"
