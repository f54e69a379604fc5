"""Time response of the geared turbo-generator by ROSS, for comparison with sigdb's, and ROSS's time per step.

It needs ``ross-rotordynamics`` (with ``plotly < 6.1``) and not sigdb; the rotors are those of ``ross_frequencies.py``,
beside this file. From rest, with constant mesh stiffness, the unbalance of both gears acts from t = 0. The answer of
ROSS's state-space method goes to ``data/reference/ross_time_response.csv``; the errors of both its methods, by step,
and its times are printed::

    python -m venv ross && ross/bin/pip install "ross-rotordynamics==2.3.0" "plotly<6.1"
    OPENBLAS_NUM_THREADS=1 ross/bin/python benchmarks/ross_time_response.py

Forces are given to ROSS node by node: its own ``unbalance_force_over_time`` (2.3.0) takes the driven shaft's speed
for the size of the force, but turns it by the angle of the driving shaft. ROSS's Newmark method begins with no
acceleration whatever the first force is, so that under a force that is there from t = 0 its error falls with the first
power of the step only.
"""

import contextlib
import csv
import io
import platform
import time
from importlib.metadata import version

import numpy as np
import ross as rs
from ross_frequencies import RIG, ROOT, rotor

OUT = ROOT / "data" / "reference" / "ross_time_response.csv"
UNBALANCE = {"wheel": (1e-2, 0.0), "pinion": (1e-4, 60.0)}
"""kg m, and degrees from x at t = 0 in the sense of rotation; assumed, any would do."""
DURATION = 0.1
SAMPLE = 1e-4
STEPS = (10, 5, 2, 1)
"""Integration steps, us; the last is half the one before, from which the error is estimated."""
METHODS = {"state space": "default", "newmark": "newmark"}
COLUMNS = ("main", "wheel-vertical", "pinion-horizontal", "pinion-vertical", "pinion-vertical-velocity")
DOF = 6


def geared_pair(**options):
    return rs.MultiRotor(
        rotor("generator-shaft", "wheel"),
        rotor("turbine-shaft", "pinion"),
        coupled_nodes=(RIG["gears"]["wheel"]["node"], RIG["gears"]["pinion"]["node"]),
        gear_mesh_stiffness=RIG["meshes"]["main"]["stiffness"],
        orientation_angle=0.0,
        **options,
    )


def first_dofs(pair):
    """First degree of freedom of each gear's node: x, then y."""
    nodes = {"wheel": RIG["gears"]["wheel"]["node"], "pinion": pair.driven_nodes[RIG["gears"]["pinion"]["node"]]}
    return {gear: DOF * node for gear, node in nodes.items()}


def speeds(pair):
    """Signed speed of each gear, rad/s."""
    speed = RIG["operating"]["speed_rpm"] * 2 * np.pi / 60
    return {"wheel": speed, "pinion": -speed * pair.mesh.gear_ratio}


def force(pair, t):
    """(steps, n) ``U W^2 (cos, s sin)(|W| t + alpha)`` along x and y of each gear, s the sense of W."""
    found = np.zeros((len(t), pair.ndof))
    for gear, x in first_dofs(pair).items():
        (size, angle_deg), speed = UNBALANCE[gear], speeds(pair)[gear]
        angle = abs(speed) * t + np.deg2rad(angle_deg)
        found[:, x] = size * speed**2 * np.cos(angle)
        found[:, x + 1] = size * speed**2 * np.sign(speed) * np.sin(angle)
    return found


def outputs(pair):
    """(4, n) compression of the mesh, then displacements, from ROSS's degrees of freedom.

    Its coupling matrix is h h', and a wheel that turns in the positive sense compresses the mesh.
    """
    wheel, pinion = first_dofs(pair).values()
    coupling = pair.coupling_matrix()
    rows = np.zeros((4, pair.ndof))
    rows[0, [*range(wheel, wheel + DOF), *range(pinion, pinion + DOF)]] = coupling[:, 5] / np.sqrt(coupling[5, 5])
    rows[[1, 2, 3], [wheel + 1, pinion, pinion + 1]] = 1.0
    return rows


def march(pair, method, t):
    """Result, and seconds a step."""
    applied = force(pair, t)
    started = time.perf_counter()
    with contextlib.redirect_stdout(io.StringIO()):
        result = pair.run_time_response(speeds(pair)["wheel"], applied, t, method=method)
    return result, (time.perf_counter() - started) / (len(t) - 1)


def histories(pair, method, step):
    """(samples, columns) at every SAMPLE, and seconds a step; Newmark's method gives no velocity."""
    steps = round(DURATION / step)
    result, seconds = march(pair, method, np.arange(steps + 1) * step)
    kept = slice(None, None, round(SAMPLE / step))
    found = result.yout[kept] @ outputs(pair).T
    if len(result.xout):
        found = np.column_stack([found, result.xout[kept, pair.ndof :] @ outputs(pair)[3]])
    return found, seconds


def errors(found, exact):
    """Largest difference in each column as a fraction of its peak-to-peak."""
    exact = exact[:, : found.shape[1]]
    return np.abs(found - exact).max(axis=0) / np.ptp(exact, axis=0)


def write(found, error, newmark):
    versions = f"ross-rotordynamics {version('ross-rotordynamics')}, numpy {version('numpy')}, scipy {version('scipy')}"
    unbalance = ", ".join(f"{gear} {size:g} kg m at {deg:g} deg" for gear, (size, deg) in UNBALANCE.items())
    finest, rpm = f"{STEPS[-1]} us", RIG["operating"]["speed_rpm"]
    with OUT.open("w", encoding="utf-8", newline="") as file:
        file.write("# Time response of data/transmissions/friswell_turbogenerator.toml by ROSS: s, m, m/s\n")
        file.write(f"# {versions}, Python {platform.python_version()}; benchmarks/ross_time_response.py\n")
        file.write(f"# From rest at {rpm:g} rpm, mesh stiffness constant; unbalance: {unbalance}\n")
        file.write(f"# State-space method, step {finest}, every {SAMPLE / STEPS[-1] * 1e6:.0f}th step\n")
        file.write("# Error of each column over its peak-to-peak, by halving the step:\n")
        file.write(f"# error,{','.join(f'{e:.1e}' for e in error)}\n")
        file.write(f"# The same of Newmark's method, step {finest}, not recorded here:\n")
        file.write(f"# newmark,{','.join(f'{e:.1e}' for e in newmark)}\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["time", *COLUMNS])
        for i, row in enumerate(found):
            table.writerow([f"{i * SAMPLE:.4f}", *(f"{value:.9e}" for value in row)])


def main():
    pair = geared_pair()
    march(pair, "newmark", np.arange(3) * 1e-6)  # ROSS compiles it at its first call
    found = {(name, step): histories(pair, method, step * 1e-6) for name, method in METHODS.items() for step in STEPS}
    coarse, fine = (found["state space", step][0] for step in STEPS[-2:])
    # The state-space method takes the force as linear over a step, so its error falls with the step's square.
    exact = (4 * fine - coarse) / 3

    print(f"{'method':<24}{'step, us':>9}{'ms a step':>11}  " + "  ".join(COLUMNS))
    for (name, step), (history, seconds) in found.items():
        cells = (f"{e:.1e}".rjust(len(column)) for e, column in zip(errors(history, exact), COLUMNS, strict=False))
        print(f"{name:<24}{step:>9}{seconds * 1e3:>11.4f}  " + "  ".join(cells))
    updating = geared_pair(update_mesh_stiffness=True)
    _, seconds = march(updating, "newmark", np.arange(2001) * 1e-5)
    print(f"{'newmark, mesh updated':<24}{10:>9}{seconds * 1e3:>11.4f}")

    write(fine, errors(fine, exact), errors(found["newmark", STEPS[-1]][0], exact))


if __name__ == "__main__":
    main()
