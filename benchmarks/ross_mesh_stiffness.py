"""Mesh stiffness of the 19/48 spur pair by ROSS's energy method, for comparison with sigdb's.

Stand-alone: it needs ``ross-rotordynamics`` (with ``plotly < 6.1``) and not sigdb, so that the two have no code in
common. It writes ``data/reference/ross_mesh_stiffness.csv``: for each gear the compliance of a tooth part by part at
some pressure angles, and the stiffness of the mesh over a tooth pass::

    python -m venv ross && ross/bin/pip install "ross-rotordynamics==2.3.0" "plotly<6.1"
    ross/bin/python benchmarks/ross_mesh_stiffness.py
"""

import csv
import platform
import warnings
from importlib.metadata import version
from pathlib import Path

import numpy as np
import ross as rs
from ross.gear_element import GearElementTVMS, Mesh

OUT = Path(__file__).parents[1] / "data" / "reference" / "ross_mesh_stiffness.csv"
TEETH = (19, 48)
MODULE, FACE_WIDTH, BORE, PRESSURE_ANGLE = 3.175e-3, 0.016, 0.03, np.deg2rad(20)
YOUNG_MODULUS, POISSON_RATIO = 2.068e11, 0.3
POINTS = 9


def gear(teeth):
    """A gear of the pair."""
    steel = rs.Material("steel", rho=7850, E=YOUNG_MODULUS, Poisson=POISSON_RATIO)
    return GearElementTVMS(
        n=0,
        material=steel,
        width=FACE_WIDTH,
        bore_diameter=BORE,
        module=MODULE,
        n_teeth=teeth,
        pr_angle=PRESSURE_ANGLE,
    )


def parts(one):
    """Pressure angle in rad and compliances in m/N: bending, shear, compression, foundation."""
    angles = one.pr_angles_dict
    for angle in np.linspace(angles["start_point"] + 0.05, angles["addendum"], POINTS):
        beta = one._to_tau(angle)
        yield float(angle), *(float(part(beta)) for part in (one._inv_kb, one._inv_ks, one._inv_ka, one._inv_kf))


def main():
    warnings.simplefilter("ignore")  # on the range of the foundation's coefficients
    pair = [gear(teeth) for teeth in TEETH]
    mesh = Mesh(*pair)
    versions = f"ross-rotordynamics {version('ross-rotordynamics')}, numpy {version('numpy')}, scipy {version('scipy')}"
    with OUT.open("w", encoding="utf-8", newline="") as file:
        file.write("# Spur pair 19/48, module 3.175 mm, 16 mm wide, 20 deg, bores 30 mm, E 206.8 GPa, nu 0.3: ROSS\n")
        file.write("# tooth: pressure angle, compliance in bending, shear, compression and of the foundation, m/N\n")
        file.write("# mesh: contact ratio, contact stiffness; mesh-stiffness: tooth passes, N/m\n")
        file.write(f"# {versions}, Python {platform.python_version()}; benchmarks/ross_mesh_stiffness.py\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["what", "teeth", "at", "a", "b", "c", "d"])
        for one in pair:
            for angle, *compliances in parts(one):
                table.writerow(["tooth", one.n_teeth, f"{angle:.12f}", *(f"{value:.12e}" for value in compliances)])
            theta = one.tooth_dict["root_angle"]
            table.writerow(["root-half-angle", one.n_teeth, f"{theta:.12f}", "", "", "", ""])
        contact = [f"{mesh.contact_ratio:.12f}", f"{mesh.hertzian_stiffness:.12e}"]
        table.writerow(["mesh", "", *contact, "", "", ""])
        passes = np.array(mesh.theta_range) * TEETH[0] / (2 * np.pi)
        for u, k in zip(passes[:-1], mesh.stiffness_range[:-1], strict=True):
            table.writerow(["mesh-stiffness", "", f"{u:.9f}", f"{k:.9e}", "", "", ""])


if __name__ == "__main__":
    main()
