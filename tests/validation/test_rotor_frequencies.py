"""Validation: natural frequencies of published rotors, put together here from sigdb's elements.

M. I. Friswell, J. E. T. Penny, S. D. Garvey, A. W. Lees, Dynamics of Rotating Machines, Cambridge, 2010, example 5.9.1,
and the geared turbo-generator of Rao, Shiau, Chang (1998) as computed by Friswell (2010).
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.transmission.mesh.geometry import PairMember, mesh_geometry
from sigdb.transmission.parts.gears import Mesh, Trapezoid
from sigdb.transmission.parts.shafts import Material
from sigdb.transmission.system.beam import beam_element

AXIAL = 2


class Rotors:
    """Mass, damping with gyroscopics, and stiffness of shafts that are put together node by node."""

    def __init__(self, nodes):
        self.mass, self.damping, self.stiffness = np.zeros((3, 6 * nodes, 6 * nodes))

    def shaft(self, first, lengths, diameters, material, speed):
        for i, (length, diameter) in enumerate(zip(lengths, diameters, strict=True)):
            element = beam_element(length, diameter, 0.0, material)
            span = slice(6 * (first + i), 6 * (first + i) + 12)
            self.mass[span, span] += element.mass
            self.stiffness[span, span] += element.stiffness
            self.damping[span, span] += speed * element.gyroscopic

    def disk(self, node, mass, diametral, polar, speed):
        """Id theta_x'' + Ip Omega theta_y' = Mx, Id theta_y'' - Ip Omega theta_x' = My."""
        i = 6 * node
        self.mass[range(i, i + 6), range(i, i + 6)] += [mass] * 3 + [diametral] * 2 + [polar]
        self.damping[i + 3, i + 4] += polar * speed
        self.damping[i + 4, i + 3] -= polar * speed

    def bearing(self, node, kx, ky, c):
        for i, k in ((6 * node, kx), (6 * node + 1, ky)):
            self.stiffness[i, i] += k
            self.damping[i, i] += c

    def modes(self):
        """Poles above the real axis by rising frequency, and their shapes, with axial motion left out."""
        n = len(self.mass)
        take = np.ix_(*[[i for i in range(n) if i % 6 != AXIAL]] * 2)
        m, c, k = self.mass[take], self.damping[take], self.stiffness[take]
        state = np.block([[np.zeros_like(m), np.eye(len(m))], [-np.linalg.solve(m, k), -np.linalg.solve(m, c)]])
        poles, shapes = np.linalg.eig(state)
        upper = np.flatnonzero(poles.imag > 1e-2)
        upper = upper[np.argsort(poles[upper].imag)]
        return poles[upper], shapes[: len(m), upper]


def example_591(rpm, elements=6):
    """Shaft 1.5 m x 50 mm, disks at 0.5 m and 1.0 m (OD 0.28, 0.35, width 0.07, bore 0.05 m), 1 MN/m at both ends."""
    steel = Material(density=7810.0, young_modulus=2.11e11, shear_modulus=8.12e10)
    speed = rpm * 2 * np.pi / 60
    rotor = Rotors(elements + 1)
    rotor.shaft(0, [1.5 / elements] * elements, [0.05] * elements, steel, speed)
    for node, outer in ((elements // 3, 0.28), (2 * elements // 3, 0.35)):
        m = 7810 * np.pi / 4 * (outer**2 - 0.05**2) * 0.07
        squares = (outer**2 + 0.05**2) / 4
        rotor.disk(node, m, m / 12 * (3 * squares + 0.07**2), m / 2 * squares, speed)
    for node in (0, elements):
        rotor.bearing(node, 1e6, 1e6, 0.0)
    return rotor


@pytest.mark.parametrize(
    ("rpm", "published"),
    [
        (0, [86.66, 86.66, 274.31, 274.31, 650.41, 716.78]),
        (4000, [85.39, 87.80, 251.78, 294.71, 600.18, 650.41]),
    ],
)
def test_friswell_example_591(rpm, published):
    """Published to 0.01 rad/s; 650.41 is torsion. Forward whirl rises with speed, backward falls."""
    poles, _ = example_591(rpm).modes()
    assert_allclose(poles.imag[:6], published, atol=0.011)


def test_the_higher_whirl_turns_forward():
    """x leads y by a quarter turn, y = -i x, in a whirl in the sense of a positive speed."""
    poles, shapes = example_591(4000).modes()
    for frequency, sense in ((251.78, -1), (294.71, 1)):
        shape = shapes[:, np.argmin(abs(poles.imag - frequency))]
        x, y = shape[10], shape[11]
        assert_allclose(y / x, -1j * sense, atol=1e-6)


def turbo_generator(rotation):
    steel = Material(density=7800.0, young_modulus=2.07e11, shear_modulus=7.95e10)
    speed1 = rotation * 1500 * 2 * np.pi / 60
    speed2 = -speed1 * 328 / 23
    rotors = Rotors(5 + 4)
    rotors.shaft(0, [0.1, 4.24, 1.16, 0.3], [0.3, 0.3, 0.22, 0.22], steel, speed1)
    rotors.disk(1, 525.7, 16.1, 32.2, speed1)
    rotors.disk(2, 116.04, 3.115, 6.23, speed1)
    rotors.disk(4, 726.4, 56.95, 113.9, speed1)
    rotors.shaft(5, [0.3, 5.0, 0.1], [0.15] * 3, steel, speed2)
    rotors.disk(5, 5.0, 0.002, 0.004, speed2)
    rotors.disk(7, 7.45, 0.0745, 0.149, speed2)
    for node, kx, ky in ((0, 183.9e6, 200.4e6), (3, 183.9e6, 200.4e6), (6, 10.1e6, 41.6e6), (8, 10.1e6, 41.6e6)):
        rotors.bearing(node, kx, ky, 3e3)

    base_radius = 0.5086
    mesh = Mesh(
        driving="wheel",
        driven="pinion",
        module=2 * base_radius / np.cos(np.deg2rad(22.5)) / 328,
        face_width=0.1,
        pressure_angle_deg=22.5,
        line_of_centres=(1.0, 0.0, 0.0),
        stiffness=1e8,
        profile=Trapezoid(contact_ratio=1.5, flank=0.3),
    )
    axis = np.array([0.0, 0.0, 1.0])
    wheel, pinion = (PairMember(teeth=teeth, axis=axis, apex=None) for teeth in (328, 23))
    h = np.zeros(54)
    h[[*range(24, 30), *range(30, 36)]] = mesh_geometry(mesh, wheel, pinion, rotation).vector
    rotors.stiffness += mesh.stiffness * np.outer(h, h)
    return rotors


def test_geared_turbo_generator():
    """Published to 0.001 Hz; the base radii of wheel and pinion agree with the tooth counts to 0.02 % only."""
    published = [11.641, 12.284, 17.268, 18.458, 23.956, 37.681, 49.889, 50.861, 56.248, 57.752, 59.188, 63.113, 74.203]
    poles, _ = turbo_generator(1).modes()
    assert_allclose(poles.imag[:13] / (2 * np.pi), published, rtol=1e-4)
