"""The page of a rig: its numbers as tables of text."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from sigdb.report.text_table import Column, hertz, lists, number, table, word


def rig_text(facts: Mapping[str, Any]) -> str:
    """The numbers of a rig as a page of text.

    Parameters
    ----------
    facts
        What :func:`sigdb.transmission.describe_rig` returns.

    Returns
    -------
    str
        Title, operating point, a table for each kind of part that the rig has, frequencies, resonances, and the
        origins of the numbers.
    """
    blocks = [_head(facts)]
    for title, key, columns in _TABLES:
        if facts[key]:
            blocks.append(f"{title}\n{table(columns, facts[key])}")
    blocks += [*_frequencies(facts), _origins(facts["origins"])]
    return "\n\n".join(blocks) + "\n"


def _end(row: Mapping[str, Any]) -> str:
    if row["to_shaft"] is None:
        return f"machine of {row['inertia']:.4g} kg m^2"
    return f"shaft {row['to_shaft']}, node {row['to_node']}"


def _place(row: Mapping[str, Any]) -> str:
    return f"gear {row['gear']}" if row["gear"] else f"casing point {row['point']}"


def _moves(row: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {share:.0%}" for name, share in list(row["moves"].items())[:3] if share >= 0.05)


_NAME: Column = ("name", word("name"))
_WHERE: tuple[Column, Column] = (("shaft", word("shaft")), ("node", word("node")))
_INERTIA: tuple[Column, ...] = (
    ("mass, kg", number("mass")),
    ("Ip, kg m^2", number("polar_inertia")),
    ("Id, kg m^2", number("diametral_inertia")),
)
_MODE: tuple[Column, ...] = (
    ("frequency, Hz", lambda row: f"{row['frequency_hz']:.1f}"),
    ("damping ratio", lambda row: f"{row['damping_ratio']:z.4f}"),
)

_TABLES: tuple[tuple[str, str, Sequence[Column]], ...] = (
    (
        "Shafts",
        "shafts",
        (
            _NAME,
            ("segments", word("segments")),
            ("nodes", word("nodes")),
            ("length, m", number("length")),
            ("mass, kg", number("mass")),
            ("speed, rpm", number("speed_rpm", 6)),
            ("speed, Hz", hertz("speed_hz")),
            ("motions", lambda row: " ".join(row["motions"])),
        ),
    ),
    (
        "Gears (at the mean pitch radius)",
        "gears",
        (
            _NAME,
            *_WHERE,
            ("teeth", word("teeth")),
            ("radius, mm", number("pitch_radius", scale=1e3)),
            ("pitch angle, deg", number("pitch_angle_deg", 5)),
            *_INERTIA,
        ),
    ),
    ("Disks", "disks", (_NAME, *_WHERE, *_INERTIA)),
    (
        "Meshes (static, under the mean torque)",
        "meshes",
        (
            _NAME,
            ("driving", word("driving")),
            ("driven", word("driven")),
            ("ratio", number("ratio", 5)),
            ("stiffness, N/m", number("stiffness")),
            ("contact ratio", number("contact_ratio")),
            ("normal force, N", number("normal_force", 5)),
            ("compression, um", number("static_compression", scale=1e6)),
        ),
    ),
    (
        "Tooth forces, N (radial: towards the gear's axis; axial: along its shaft's z)",
        "tooth_forces",
        (
            ("mesh", word("mesh")),
            ("gear", word("gear")),
            ("tangential", number("tangential", 5)),
            ("radial", number("radial", 5)),
            ("axial", number("axial", 5)),
        ),
    ),
    (
        "Bearings (along x, y, z in N/m and N s/m, about x, y, z in N m/rad and N m s/rad)",
        "bearings",
        (
            _NAME,
            *_WHERE,
            ("seat", lambda row: row["seat"] or "ground"),
            ("stiffness", lists("stiffness")),
            ("damping", lists("damping")),
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
            ("stiffness, N m/rad", number("stiffness")),
            ("damping, N m s/rad", number("damping")),
        ),
    ),
    (
        "Casing modes",
        "casing",
        (*_MODE, ("modal mass, kg", number("modal_mass")), ("points", lambda row: ", ".join(row["shape"]))),
    ),
    (
        "Sensors",
        "sensors",
        (
            _NAME,
            ("at", _place),
            ("direction", lists("direction")),
            ("measures", word("quantity")),
            ("unit", word("unit")),
        ),
    ),
    (
        "Other excitations",
        "excitations",
        (("what", word("what")), ("size", number("size")), ("unit", word("unit")), ("shaft", word("shaft"))),
    ),
)


def _head(facts: Mapping[str, Any]) -> str:
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


def _frequencies(facts: Mapping[str, Any]) -> list[str]:
    blocks = []
    if facts["meshes"]:
        columns: tuple[Column, ...] = (
            ("mesh", word("name")),
            ("mesh, Hz", hertz("mesh_frequency_hz")),
            ("twice", lambda row: f"{row['harmonics_hz'][1]:.6g}"),
            ("three times", lambda row: f"{row['harmonics_hz'][2]:.6g}"),
            ("tooth cycle, Hz", hertz("tooth_cycle_hz")),
        )
        note = "tooth cycle = mesh frequency x gcd(z1, z2) / (z1 z2): how often the same two teeth meet"
        blocks.append(f"Mesh frequencies\n{table(columns, facts['meshes'])}\n{note}")
    title = f"Natural frequencies ({len(facts['modes'])} shown; moves: share of kinetic energy)"
    block = f"{title}\n{table((*_MODE, ('moves', _moves)), facts['modes'])}"
    if facts["overdamped"]:
        block += f"\n{facts['overdamped']} more do not vibrate: they are overdamped"
    return [*blocks, block, _warnings(facts["resonances"])]


def _warnings(resonances: Sequence[Mapping[str, Any]]) -> str:
    if not resonances:
        return "No natural frequency is within 5 % of a shaft's speed or of the first three harmonics of a mesh"
    columns: tuple[Column, ...] = (
        *_MODE,
        ("is near", lambda row: f"{row['order']} x {row['excited_by']}"),
        ("at, Hz", lambda row: f"{row['excitation_hz']:.1f}"),
        ("moves", _moves),
    )
    return f"Resonance: natural frequencies within 5 % of an excitation\n{table(columns, resonances)}"


def _origins(origins: Mapping[str, int]) -> str:
    counts = ", ".join(f"{count} {origin}" for origin, count in origins.items() if origin != "unstated")
    return f"Numbers by origin: {counts}, {origins['unstated']} without a source"
