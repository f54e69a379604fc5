"""Natural frequencies of the geared turbo-generator by ROSS, for comparison with sigdb's.

Stand-alone: it needs ``ross-rotordynamics`` (with ``plotly < 6.1``) and not sigdb, so that the two have no code in
common. It builds the rig of ``data/transmissions/friswell_turbogenerator.toml`` from the same numbers and writes
``data/reference/ross_two_shaft.csv``::

    python -m venv ross && ross/bin/pip install "ross-rotordynamics==2.3.0" "plotly<6.1"
    ross/bin/python benchmarks/ross_frequencies.py
"""

import csv
import platform
import tomllib
from importlib.metadata import version
from pathlib import Path

import numpy as np
import ross as rs

ROOT = Path(__file__).parents[1]
RIG = tomllib.loads((ROOT / "data" / "transmissions" / "friswell_turbogenerator.toml").read_text(encoding="utf-8"))
OUT = ROOT / "data" / "reference" / "ross_two_shaft.csv"
MODES = 24


def rotor(name, gear_name):
    """One shaft with its disks, its gear and its bearings; one Timoshenko element a segment."""
    material = RIG["materials"]["steel"]
    steel = rs.Material("steel", rho=material["density"], E=material["young_modulus"], G_s=material["shear_modulus"])
    shaft = [
        rs.ShaftElement(L=one["length"], idl=0.0, odl=one["outer_diameter"], material=steel)
        for one in RIG["shafts"][name]["segments"]
    ]
    mesh, gear = RIG["meshes"]["main"], RIG["gears"][gear_name]
    bodies = [
        rs.DiskElement(n=one["node"], m=one["mass"], Id=one["diametral_inertia"], Ip=one["polar_inertia"])
        for one in RIG["disks"].values()
        if one["shaft"] == name
    ]
    bodies.append(
        rs.GearElement(
            n=gear["node"],
            m=gear["mass"],
            Id=gear["diametral_inertia"],
            Ip=gear["polar_inertia"],
            n_teeth=gear["teeth"],
            pitch_diameter=mesh["module"] * gear["teeth"],
            pr_angle=np.deg2rad(mesh["pressure_angle_deg"]),
        )
    )
    bearings = []
    for one in RIG["bearings"].values():
        if one["shaft"] == name:
            (kxx, kyy, kzz), (cxx, cyy, _) = one["stiffness"], one["damping"]
            bearings.append(rs.BearingElement(n=one["node"], kxx=kxx, kyy=kyy, kzz=kzz, cxx=cxx, cyy=cyy))
    return rs.Rotor(shaft, bodies, bearings)


def frequencies(speed_rpm):
    """Lowest damped natural frequencies, Hz, without the free rotation of the train."""
    pair = rs.MultiRotor(
        rotor("generator-shaft", "wheel"),
        rotor("turbine-shaft", "pinion"),
        coupled_nodes=(RIG["gears"]["wheel"]["node"], RIG["gears"]["pinion"]["node"]),
        gear_mesh_stiffness=RIG["meshes"]["main"]["stiffness"],
        orientation_angle=0.0,
    )
    damped = pair.run_modal(speed=speed_rpm * 2 * np.pi / 60, num_modes=2 * pair.ndof, sparse=False).wd / (2 * np.pi)
    return np.sort(damped[damped > 0.1])[:MODES]


def main():
    versions = f"ross-rotordynamics {version('ross-rotordynamics')}, numpy {version('numpy')}, scipy {version('scipy')}"
    with OUT.open("w", encoding="utf-8", newline="") as file:
        file.write("# Damped natural frequencies, Hz, of data/transmissions/friswell_turbogenerator.toml by ROSS\n")
        file.write(f"# {versions}, Python {platform.python_version()}; benchmarks/ross_frequencies.py\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["speed_rpm", "mode", "frequency_hz"])
        for speed in (100.0, 1500.0, 3000.0):
            for mode, frequency in enumerate(frequencies(speed), start=1):
                table.writerow([speed, mode, f"{frequency:.6f}"])


if __name__ == "__main__":
    main()
