"""The page of a rig: its numbers as tables of text."""

import math
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import TypedDict

from sigdb.report.text_table import PLAIN, Column, Terminal, TextTable, number, word
from sigdb.transmission import (
    AssumedFacts,
    BearingFacts,
    BodyFacts,
    CasingModeFacts,
    CoupledModes,
    CouplingFacts,
    ExcitationFacts,
    GearFacts,
    MeshFacts,
    ModeFacts,
    ResonanceFacts,
    RigFacts,
    SensorFacts,
    ShaftFacts,
    ToothForceFacts,
)


def rig_text(facts: RigFacts, *, terminal: Terminal = PLAIN) -> str:
    """Return the numbers of a rig as a page of text.

    Parameters
    ----------
    facts : RigFacts
        From :func:`sigdb.transmission.describe_rig`.
    terminal : Terminal
        Where the text is shown; by default a file of any width.

    Returns
    -------
    str
        Title, operating point, a table for each kind of part that the rig has, frequencies, resonances, ranges of
        the assumed numbers, the origins of all, and remarks on what is unusual.
    """
    parts = [f"{title}\n{table.text(terminal, indent=2)}" for title, table in _part_tables(facts).items() if table.rows]
    remarks = ["\n".join(["remarks", *_folded(facts["remarks"], terminal)])] if facts["remarks"] else []
    origins = [*_assumed(facts["assumed"], terminal), _origins(facts["origins"])]
    blocks = [_head(facts), *parts, *_frequencies(facts, terminal), *origins, *remarks]
    return "\n\n".join(blocks) + "\n"


def _folded(texts: Sequence[str], terminal: Terminal) -> Iterator[str]:
    """Yield the lines of indented sentences, folded at the width of a terminal."""
    for text in texts:
        width = len(text) + 2 if terminal.width is None else max(terminal.width, 20)
        yield from textwrap.wrap(
            text, width, initial_indent="  ", subsequent_indent="    ", break_long_words=False, break_on_hyphens=False
        )


def modes_text(modes: CoupledModes, *, count: int | None = None, terminal: Terminal = PLAIN) -> str:
    """Return the modes of a rig as aligned text, the lowest first.

    Parameters
    ----------
    modes : CoupledModes
        From :func:`sigdb.transmission.coupled_modes`.
    count : int, optional
        Number of modes to show; all of them by default.
    terminal : Terminal
        Where the text is shown; by default a file of any width.

    Returns
    -------
    str
        Several lines.
    """
    head = ("mode", "frequency, Hz", "damping ratio", "moves (share of kinetic energy)")
    rows = [
        [str(i), f"{frequency:.1f}", f"{ratio:z.4f}", _moves(moves)]
        for i, (frequency, ratio, moves) in enumerate(
            zip(modes.frequency_hz, modes.damping_ratio, modes.moves, strict=True), start=1
        )
    ]
    return TextTable(head, rows[:count]).text(terminal) + "\n"


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


def _part_tables(facts: RigFacts) -> dict[str, TextTable]:
    """Return the table of each kind of part by its title."""
    return {
        "Shafts": TextTable.of(_SHAFTS, facts["shafts"]),
        "Gears (at the mean pitch radius)": TextTable.of(_GEARS, facts["gears"]),
        "Disks": TextTable.of(_DISKS, facts["disks"]),
        "Meshes (static, under the mean torque)": TextTable.of(_MESHES, facts["meshes"]),
        "Tooth forces, N (radial: towards the gear's axis; axial: along its shaft's z)": TextTable.of(
            _TOOTH_FORCES, facts["tooth_forces"]
        ),
        "Bearings (along x, y, z in N/m and N s/m, about x, y, z in N m/rad and N m s/rad)": TextTable.of(
            _BEARINGS, facts["bearings"]
        ),
        "Couplings": TextTable.of(_COUPLINGS, facts["couplings"]),
        "Casing modes": TextTable.of(_CASING, facts["casing"]),
        "Sensors": TextTable.of(_SENSORS, facts["sensors"]),
        "Other excitations": TextTable.of(_EXCITATIONS, facts["excitations"]),
    }


def _frequencies(facts: RigFacts, terminal: Terminal) -> list[str]:
    blocks = []
    if facts["meshes"]:
        table = TextTable.of(_FREQUENCIES, facts["meshes"]).text(terminal, indent=2)
        note = "tooth cycle = mesh frequency x gcd(z1, z2) / (z1 z2): how often the same two teeth meet"
        blocks.append(f"Mesh frequencies\n{table}\n{note}")
    title = f"Natural frequencies ({len(facts['modes'])} shown; moves: share of kinetic energy)"
    block = f"{title}\n{TextTable.of(_MODES, facts['modes']).text(terminal, indent=2)}"
    if facts["overdamped"]:
        block += f"\n{facts['overdamped']} more do not vibrate: they are overdamped"
    return [*blocks, block, _warnings(facts["resonances"], terminal)]


def _warnings(resonances: Sequence[ResonanceFacts], terminal: Terminal) -> str:
    if not resonances:
        return "No natural frequency is within 5 % of a shaft's speed or of the first three harmonics of a mesh"
    table = TextTable.of(_RESONANCES, resonances).text(terminal, indent=2)
    return f"Resonance: natural frequencies within 5 % of an excitation\n{table}"


def _origins(origins: Mapping[str, int]) -> str:
    counts = ", ".join(f"{count} {origin}" for origin, count in origins.items() if origin != "unstated")
    return f"Numbers by origin: {counts}, {origins['unstated']} without a source"


def _assumed(facts: Sequence[AssumedFacts], terminal: Terminal) -> list[str]:
    if not facts:
        return []
    free = sum(row["is_free"] for row in facts)
    title = f"Assumed numbers, {free} of them free (of a list: its first component that is not 0)"
    return [f"{title}\n{TextTable.of(_ASSUMED, facts).text(terminal, indent=2)}"]


def _list(values: Sequence[float]) -> str:
    return " ".join(f"{value:g}" for value in values)


def _value(value: float | str | list[float]) -> str:
    return value if isinstance(value, str) else _list(value if isinstance(value, list) else [value])


def _hertz(value: float) -> str:
    return f"{value:.6g}"


def _end(row: CouplingFacts) -> str:
    if row["to_shaft"] is None:
        return f"machine of {row['inertia']:.4g} kg m^2"
    return f"shaft {row['to_shaft']}, node {row['to_node']}"


def _place(row: SensorFacts) -> str:
    return f"gear {row['gear']}" if row["gear"] else f"casing point {row['point']}"


def _moves(moves: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {share:.0%}" for name, share in list(moves.items())[:3] if share >= 0.05)


class _Named(TypedDict):
    name: str


class _Placed(TypedDict):
    shaft: str
    node: int


class _Heavy(TypedDict):
    mass: float
    polar_inertia: float
    diametral_inertia: float


class _Damped(TypedDict):
    frequency_hz: float
    damping_ratio: float


_NAME: Column[_Named] = ("name", lambda row: row["name"])
_WHERE: tuple[Column[_Placed], ...] = (("shaft", lambda row: row["shaft"]), ("node", lambda row: word(row["node"])))
_INERTIA: tuple[Column[_Heavy], ...] = (
    ("mass, kg", lambda row: number(row["mass"])),
    ("Ip, kg m^2", lambda row: number(row["polar_inertia"])),
    ("Id, kg m^2", lambda row: number(row["diametral_inertia"])),
)
_MODE: tuple[Column[_Damped], ...] = (
    ("frequency, Hz", lambda row: f"{row['frequency_hz']:.1f}"),
    ("damping ratio", lambda row: f"{row['damping_ratio']:z.4f}"),
)
_MOVES: Column[ModeFacts] = ("moves", lambda row: _moves(row["moves"]))

_SHAFTS: tuple[Column[ShaftFacts], ...] = (
    _NAME,
    ("segments", lambda row: word(row["segments"])),
    ("nodes", lambda row: word(row["nodes"])),
    ("length, m", lambda row: number(row["length"])),
    ("mass, kg", lambda row: number(row["mass"])),
    ("speed, rpm", lambda row: number(row["speed_rpm"], 6)),
    ("speed, Hz", lambda row: _hertz(row["speed_hz"])),
    ("motions", lambda row: " ".join(row["motions"])),
)
_GEARS: tuple[Column[GearFacts], ...] = (
    _NAME,
    *_WHERE,
    ("teeth", lambda row: word(row["teeth"])),
    ("radius, mm", lambda row: "-" if row["pitch_radius"] is None else number(row["pitch_radius"] * 1e3)),
    ("pitch angle, deg", lambda row: number(row["pitch_angle_deg"], 5)),
    *_INERTIA,
)
_DISKS: tuple[Column[BodyFacts], ...] = (_NAME, *_WHERE, *_INERTIA)
_MESHES: tuple[Column[MeshFacts], ...] = (
    _NAME,
    ("driving", lambda row: word(row["driving"])),
    ("driven", lambda row: word(row["driven"])),
    ("ratio", lambda row: number(row["ratio"], 5)),
    ("stiffness, N/m", lambda row: number(row["stiffness"])),
    ("contact ratio", lambda row: number(row["contact_ratio"])),
    ("normal force, N", lambda row: number(row["normal_force"], 5)),
    ("compression, um", lambda row: number(row["static_compression"] * 1e6)),
)
_TOOTH_FORCES: tuple[Column[ToothForceFacts], ...] = (
    ("mesh", lambda row: word(row["mesh"])),
    ("gear", lambda row: word(row["gear"])),
    ("tangential", lambda row: number(row["tangential"], 5)),
    ("radial", lambda row: number(row["radial"], 5)),
    ("axial", lambda row: number(row["axial"], 5)),
)
_BEARINGS: tuple[Column[BearingFacts], ...] = (
    _NAME,
    *_WHERE,
    ("seat", lambda row: row["seat"] or "ground"),
    ("stiffness", lambda row: _list(row["stiffness"])),
    ("damping", lambda row: _list(row["damping"])),
    ("cross terms", lambda row: "yes" if row["cross_terms"] else "no"),
)
_COUPLINGS: tuple[Column[CouplingFacts], ...] = (
    _NAME,
    *_WHERE,
    ("to", _end),
    ("stiffness, N m/rad", lambda row: number(row["stiffness"])),
    ("damping, N m s/rad", lambda row: number(row["damping"])),
)
_CASING: tuple[Column[CasingModeFacts], ...] = (
    *_MODE,
    ("modal mass, kg", lambda row: number(row["modal_mass"])),
    ("points", lambda row: ", ".join(row["shape"])),
)
_SENSORS: tuple[Column[SensorFacts], ...] = (
    _NAME,
    ("at", _place),
    ("direction", lambda row: _list(row["direction"])),
    ("measures", lambda row: word(row["quantity"])),
    ("unit", lambda row: word(row["unit"])),
)
_ASSUMED: tuple[Column[AssumedFacts], ...] = (
    ("number", lambda row: row["path"]),
    ("value", lambda row: _value(row["value"])),
    ("assumed", lambda row: row["assumed"]),
)
_EXCITATIONS: tuple[Column[ExcitationFacts], ...] = (
    ("what", lambda row: word(row["what"])),
    ("size", lambda row: number(row["size"])),
    ("unit", lambda row: word(row["unit"])),
    ("shaft", lambda row: word(row["shaft"])),
)
_FREQUENCIES: tuple[Column[MeshFacts], ...] = (
    ("mesh", lambda row: row["name"]),
    ("mesh, Hz", lambda row: _hertz(row["mesh_frequency_hz"])),
    ("twice", lambda row: _hertz(row["harmonics_hz"][1])),
    ("three times", lambda row: _hertz(row["harmonics_hz"][2])),
    ("tooth cycle, Hz", lambda row: _hertz(row["tooth_cycle_hz"])),
)
_MODES: tuple[Column[ModeFacts], ...] = (*_MODE, _MOVES)
_RESONANCES: tuple[Column[ResonanceFacts], ...] = (
    *_MODE,
    ("is near", lambda row: f"{row['order']} x {row['excited_by']}"),
    ("at, Hz", lambda row: f"{row['excitation_hz']:.1f}"),
    _MOVES,
)
