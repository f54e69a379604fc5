"""Verification: the coupled modal equations (8), (9) of the paper marched literally, against the modal system.

Each rotor has its own modal coordinates A_i and the casing its own B: ``A_i'' + L_i^2 A_i = P_i' (-Fb - Fg + Fu ...)``
and ``B'' + 2 z w B' + w^2 B = S' sum Tci Fb / m``. Bearing and mesh forces are those of the displacements that these
coordinates give, equations (3) and (4); nothing of the rig's assembly is used.
"""

import numpy as np
from scipy.linalg import block_diag, eigh

from sigdb.dynamics import prepare_periodic
from sigdb.transmission import ToothDamage, Transmission
from sigdb.transmission.parts.shafts import Material
from sigdb.transmission.system.beam import beam_element

AXIS = np.array([0.6, 0.0, 0.8])
Y = np.array([0.0, 1.0, 0.0])
ROTATION = np.column_stack([np.cross(Y, AXIS), Y, AXIS])
SOFT = {"density": 9000.0, "young_modulus": 3.0e9, "shear_modulus": 1.15e9}
TEETH, MODULE, PRESSURE, CONTACT, FLANK, MEAN = (7, 11), 0.02, 20.0, 1.5, 0.25, 2.0e6
BODIES = ((6.0, 0.02, 0.012), (12.0, 0.06, 0.035))
LENGTHS, DIAMETERS, GEAR_NODES = (0.3, 0.35), (0.08, 0.09), (0, 1)
COUPLINGS = ((1, 3.0e3, 0.02), (0, 4.0e3, 0.03))
UNBALANCE, ANGLE = 8e-3, np.deg2rad(50.0)
SPEED, TORQUE, RATIO = 1500 * 2 * np.pi / 60, 40.0, 0.25
POINTS = ("left", "right")
SHAPES = {"left": ((0.3, 1.0, 0.2), (1.0, -0.2, 0.1)), "right": ((0.1, 0.6, -0.3), (0.8, 0.3, 0.4))}
CASING = ((150.0, 0.2, 5.0), (230.0, 0.15, 4.0))
BEARINGS = (  # rotor, node, seat, stiffness, damping
    (0, 0, "left", (2.0e6, 1.5e6, 1.0e6), (200.0, 150.0, 100.0)),
    (0, 1, "right", (2.0e6, 1.5e6, 0.0), (100.0, 100.0, 0.0)),
    (1, 0, "left", (1.0e6, 2.0e6, 1.0e6), (0.0, 120.0, 60.0)),
    (1, 1, "right", (1.0e6, 2.0e6, 0.0), (0.0, 0.0, 0.0)),
)


def described():
    names = ("small", "large")
    return Transmission(
        name="literal",
        damping_ratio=RATIO,
        operating={"drive": "machine-0", "load": "machine-1", "speed_rpm": 1500.0, "torque": TORQUE},
        materials={"soft": SOFT},
        shafts={
            f"shaft-{i}": {
                "axis": AXIS.tolist(),
                "material": "soft",
                "segments": [{"length": LENGTHS[i], "outer_diameter": DIAMETERS[i]}],
            }
            for i in range(2)
        },
        gears={
            names[i]: {
                "shaft": f"shaft-{i}",
                "node": GEAR_NODES[i],
                "teeth": TEETH[i],
                "mass": BODIES[i][0],
                "polar_inertia": BODIES[i][1],
                "diametral_inertia": BODIES[i][2],
                "unbalance": (UNBALANCE, 0.0)[i],
                "unbalance_angle_deg": float(np.rad2deg(ANGLE)),
            }
            for i in range(2)
        },
        meshes={
            "main": {
                "driving": "small",
                "driven": "large",
                "module": MODULE,
                "face_width": 0.03,
                "pressure_angle_deg": PRESSURE,
                "line_of_centres": Y.tolist(),
                "stiffness": MEAN,
                "profile": {"contact_ratio": CONTACT, "flank": FLANK},
            }
        },
        couplings={
            f"machine-{i}": {"shaft": f"shaft-{i}", "node": node, "stiffness": k, "inertia": inertia}
            for i, (node, k, inertia) in enumerate(COUPLINGS)
        },
        bearings={
            f"bearing-{i}": {"shaft": f"shaft-{rotor}", "node": node, "seat": seat, "stiffness": k, "damping": c}
            for i, (rotor, node, seat, k, c) in enumerate(BEARINGS)
        },
        casing={
            "modes": [
                {
                    "frequency_hz": f,
                    "damping_ratio": zeta,
                    "modal_mass": m,
                    "shape": {point: SHAPES[point][i] for point in POINTS},
                }
                for i, (f, zeta, m) in enumerate(CASING)
            ]
        },
        sensors={
            "small": {"gear": "small", "direction": [0.0, 1.0, 0.0], "quantity": "velocity"},
            "wall": {"point": "left", "direction": [0.0, 1.0, 0.0], "quantity": "displacement"},
        },
    )


class Rotor:
    """A free rotor with its end machine: 12 motions of two nodes and the machine's angle, and all its modes, (5)."""

    def __init__(self, i):
        speed = SPEED * (1.0, -TEETH[0] / TEETH[1])[i]
        element = beam_element(LENGTHS[i], DIAMETERS[i], 0.0, Material(**SOFT))
        self.mass, self.stiffness, self.gyroscopic = (
            block_diag(m, 0.0) for m in (element.mass, element.stiffness, speed * element.gyroscopic)
        )
        g = 6 * GEAR_NODES[i]
        mass, polar, diametral = BODIES[i]
        self.mass[range(g, g + 6), range(g, g + 6)] += [mass] * 3 + [diametral] * 2 + [polar]
        self.gyroscopic[g + 3, g + 4] += polar * speed
        self.gyroscopic[g + 4, g + 3] -= polar * speed
        node, k, inertia = COUPLINGS[i]
        twist = np.zeros(13)
        twist[[6 * node + 5, 12]] = -1, 1
        self.mass[12, 12] = inertia
        self.stiffness += k * np.outer(twist, twist)
        self.squares, self.modes = eigh(self.stiffness, self.mass)
        self.speed, self.gear = speed, g


def mesh_vector():
    """(26,) the compression of the mesh by both rotors' motions: equation (4) by hand for a spur pair.

    The driving gear turns right-handed about the axis, its mate lies along +Y: at the mesh point it moves along
    axis x Y, and pushes along that, tilted by the pressure angle towards its mate.
    """
    phi = np.deg2rad(PRESSURE)
    normal = np.cos(phi) * np.cross(AXIS, Y) + np.sin(phi) * Y
    h = np.zeros(26)
    for i, sign in enumerate((1, -1)):
        arm = sign * MODULE * TEETH[i] / 2 * Y
        at = 13 * i + 6 * GEAR_NODES[i]
        h[at : at + 3] = sign * ROTATION.T @ normal
        h[at + 3 : at + 6] = sign * ROTATION.T @ np.cross(arm, normal)
    return h


def external_torque():
    """The wheel turns left-handed about its axis, so the brake's torque against it is right-handed, as the motor's."""
    torque = np.zeros(26)
    torque[12], torque[25] = TORQUE, TORQUE * TEETH[1] / TEETH[0]
    return torque


def step(x):
    return 0.5 - 0.5 * np.cos(np.pi * np.clip(x, 0.0, 1.0))


def mesh_stiffness(t, loss_of_tooth_3):
    x = (SPEED * t / (2 * np.pi) * TEETH[0] - np.arange(TEETH[0])[:, None] + 2.0) % TEETH[0] - 2.0
    k = MEAN * step(x / FLANK) * step((CONTACT - x) / FLANK) / (CONTACT - FLANK)
    k[2] *= 1 - loss_of_tooth_3 * step((CONTACT + 0.1 - x[2]) / 0.1)
    return k.sum(axis=0)


def test_the_coupled_equations_settle_where_the_modal_system_says(second_order):
    loss = 0.5
    rotors, h = [Rotor(0), Rotor(1)], mesh_vector()
    shapes = np.array([[SHAPES[point][mode] for mode in range(2)] for point in POINTS])  # (point, mode, 3)
    omega, zeta, modal_mass = (np.array(one) for one in zip(*CASING, strict=True))
    omega = 2 * np.pi * omega

    # Modal damping of the rotors, defined with bearings and the mean mesh on a fixed casing.
    mass = block_diag(rotors[0].mass, rotors[1].mass)
    held = block_diag(rotors[0].stiffness, rotors[1].stiffness) + MEAN * np.outer(h, h)
    for i, node, _, k, _ in BEARINGS:
        at = 13 * i + 6 * node + np.arange(3)
        held[at, at] += k
    root = np.linalg.cholesky(mass)
    inner = np.linalg.solve(root, np.linalg.solve(root, held).T)
    values, vectors = np.linalg.eigh((inner + inner.T) / 2)
    inner_root = (vectors * np.sqrt(values.clip(min=0))) @ vectors.T
    damping = 2 * RATIO * root @ inner_root @ root.T

    # It acts on motion relative to the statically followed casing: that of the rotors under its bearings' springs.
    pulls = np.zeros((26, 2))
    for i, node, seat, k, _ in BEARINGS:
        at = 13 * i + 6 * node + np.arange(3)
        pulls[at] += np.diag(k) @ ROTATION.T @ shapes[POINTS.index(seat)].T
    follow = np.linalg.lstsq(held, pulls, rcond=1e-12)[0]

    def bearing_forces(w, w_rate, b, b_rate):
        """(26,) on the rotors and (2,) on the casing's modes, of bearings, gyroscopic moments and damping."""
        on_rotors = -damping @ (w_rate - follow @ b_rate)
        on_casing = -follow.T @ on_rotors
        for i, rotor in enumerate(rotors):
            span = slice(13 * i, 13 * i + 13)
            on_rotors[span] -= rotor.gyroscopic @ w_rate[span]
        for i, node, seat, k, c in BEARINGS:
            at = 13 * i + 6 * node + np.arange(3)
            shape = shapes[POINTS.index(seat)]
            across = w[at] - ROTATION.T @ (b @ shape)
            rate = w_rate[at] - ROTATION.T @ (b_rate @ shape)
            bearing = np.array(c) * rate + np.array(k) * across
            on_rotors[at] -= bearing
            on_casing += shape @ (ROTATION @ bearing)
        return on_rotors, on_casing

    modes, squares = block_diag(rotors[0].modes, rotors[1].modes), np.concatenate([r.squares for r in rotors])

    def accelerations(state):
        """Return the matrix that gives the accelerations of (a, b), without mesh, unbalance and torque."""
        a, b, a_rate, b_rate = np.split(state, [26, 28, 54])
        on_rotors, on_casing = bearing_forces(modes @ a, modes @ a_rate, b, b_rate)
        a_second = modes.T @ on_rotors - squares * a
        b_second = on_casing / modal_mass - 2 * zeta * omega * b_rate - omega**2 * b
        return np.concatenate([a_second, b_second])

    def external(t):
        """(times, 28) accelerations by unbalance and torque."""
        forces, phase = np.zeros((len(t), 26)), SPEED * t + ANGLE
        forces[:, 0:2] += UNBALANCE * SPEED**2 * np.column_stack([np.cos(phase), np.sin(phase)])
        return np.pad((forces + external_torque()) @ modes, ((0, 0), (0, 2)))

    prepared = prepare_periodic(described(), gear="small", samples_per_tooth=96)
    state = prepared.steady_state([{3: ToothDamage(stiffness_loss=loss)}])[0]
    compression = state.compression + state.compression_harmonic[..., 0].sum(axis=1)
    signals = state.signals + state.harmonic_response[..., 0].sum(axis=2)

    revolution = 2 * np.pi / SPEED
    settle = int(np.ceil(np.log(1e6) / (-prepared.system.poles.real.max() * revolution))) + 1
    t = np.arange(8 * prepared.samples + 1) / (8 * prepared.samples) * revolution
    motion = np.zeros(56)
    motion[:26] = np.linalg.lstsq(modes, np.linalg.lstsq(held, external_torque(), rcond=1e-12)[0], rcond=None)[0]
    compression_row = np.pad(h @ modes, (0, 2))
    for _ in range(settle + 1):
        q, v, _, _, motion = second_order(
            np.column_stack([accelerations(unit) for unit in np.eye(56)]),
            compression_row[:, None],
            compression_row[None],
            gain=mesh_stiffness(t, loss)[:, None],
            late=np.zeros((len(t), 1)),
            external=external(t),
            state=motion,
            step=2 * t[1],
            samples=prepared.samples,
        )
    a, a_rate, b = q[:26], v[:26], q[26:]
    wall = shapes[0, :, 1] @ b
    expected = (h @ modes @ a, (modes @ a_rate)[rotors[0].gear + 1], wall)
    for ours, theirs in zip((compression, *signals), expected, strict=True):
        assert np.abs(ours - theirs).max() < 3e-5 * np.ptp(theirs)
    assert np.ptp(state.compression_harmonic[:, 0, 0]) > 0.02 * np.ptp(compression)
