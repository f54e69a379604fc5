"""The Timoshenko beam element: bending with shear and rotary inertia, axial motion, torsion, gyroscopics.

Degrees of freedom of a node: u, v, w, theta_x, theta_y, theta_z in the shaft's frame, z along the shaft.
Bending uses the shape functions that are exact for static end loads, so stiffness is exact and mass consistent.
Source: M. I. Friswell, J. E. T. Penny, S. D. Garvey, A. W. Lees, Dynamics of Rotating Machines, Cambridge, 2010.
"""

from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray
from sigdb.transmission.parts.shafts import Material

_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(4)
# The plane x-z bends with (u, theta_y); the plane y-z with (v, -theta_x).
_XZ = np.array([0, 4, 6, 10])
_YZ = np.array([1, 3, 7, 9])
_YZ_SIGN = np.array([1.0, -1.0, 1.0, -1.0])
_AXIAL = np.array([2, 8])
_TORSION = np.array([5, 11])


@dataclass(frozen=True, kw_only=True)
class BeamElement:
    """Matrices (12, 12) of an element; the gyroscopic one is for a speed of 1 rad/s about +z."""

    mass: FloatArray
    stiffness: FloatArray
    gyroscopic: FloatArray


def shear_coefficient(poisson_ratio: float, diameter_ratio: float) -> float:
    """Cowper's shear coefficient of a hollow circular section; ``6 (1 + nu) / (7 + 6 nu)`` for a solid one.

    Source: G. R. Cowper, The shear coefficient in Timoshenko's beam theory, J. Appl. Mech. 33 (1966).
    """
    nu, m2 = poisson_ratio, diameter_ratio**2
    return 6 * (1 + nu) * (1 + m2) ** 2 / ((7 + 6 * nu) * (1 + m2) ** 2 + (20 + 12 * nu) * m2)


def beam_element(length: float, outer_diameter: float, inner_diameter: float, material: Material) -> BeamElement:
    """Element of circular section.

    Parameters
    ----------
    length, outer_diameter, inner_diameter
        In m; an inner diameter of 0 is a solid section.
    material
        Density, Young's and shear modulus.

    Examples
    --------
    >>> from sigdb.transmission.parts.shafts import Material
    >>> steel = Material(density=7800.0, young_modulus=2.1e11, shear_modulus=8.1e10)
    >>> element = beam_element(0.1, 0.05, 0.0, steel)
    >>> round(float(element.stiffness[2, 2]) * 0.1 / 2.1e11 / 0.05**2, 4)
    0.7854
    """
    rho, e, g = material.density, material.young_modulus, material.shear_modulus
    area = np.pi / 4 * (outer_diameter**2 - inner_diameter**2)
    inertia = np.pi / 64 * (outer_diameter**4 - inner_diameter**4)
    kappa = shear_coefficient(material.poisson_ratio, inner_diameter / outer_diameter)
    phi = 12 * e * inertia / (kappa * g * area * length**2)

    mass, stiffness, gyroscopic = np.zeros((3, 12, 12))
    for point, weight in zip(_GAUSS, _WEIGHTS, strict=True):
        n_v, n_theta, curvature = _shape(length, phi, (point + 1) / 2)
        shear = -phi / (1 + phi) * np.array([1 / length, 0.5, -1 / length, 0.5])
        dz = weight * length / 2
        m = dz * rho * (area * np.outer(n_v, n_v) + inertia * np.outer(n_theta, n_theta))
        k = dz * (e * inertia * np.outer(curvature, curvature) + kappa * g * area * np.outer(shear, shear))
        for plane, sign in ((_XZ, np.ones(4)), (_YZ, _YZ_SIGN)):
            mass[np.ix_(plane, plane)] += m * np.outer(sign, sign)
            stiffness[np.ix_(plane, plane)] += k * np.outer(sign, sign)
        # A section's moment about x from turning about y: rho Ip Omega theta_y', and its opposite about y.
        spin = dz * rho * 2 * inertia * np.outer(-n_theta * _YZ_SIGN, n_theta)
        gyroscopic[np.ix_(_YZ, _XZ)] += spin
        gyroscopic[np.ix_(_XZ, _YZ)] -= spin.T

    bar_mass = length / 6 * np.array([[2.0, 1.0], [1.0, 2.0]])
    bar_stiffness = np.array([[1.0, -1.0], [-1.0, 1.0]]) / length
    mass[np.ix_(_AXIAL, _AXIAL)] = rho * area * bar_mass
    stiffness[np.ix_(_AXIAL, _AXIAL)] = e * area * bar_stiffness
    mass[np.ix_(_TORSION, _TORSION)] = rho * 2 * inertia * bar_mass
    stiffness[np.ix_(_TORSION, _TORSION)] = g * 2 * inertia * bar_stiffness
    return BeamElement(mass=mass, stiffness=stiffness, gyroscopic=gyroscopic)


def _shape(length: float, phi: float, xi: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Deflection, section rotation and curvature at xi in [0, 1] for the four end displacements of one plane."""
    n_v = np.array(
        [
            1 + phi - phi * xi - 3 * xi**2 + 2 * xi**3,
            length * ((2 + phi) / 2 * xi - (4 + phi) / 2 * xi**2 + xi**3),
            phi * xi + 3 * xi**2 - 2 * xi**3,
            length * (-phi / 2 * xi - (2 - phi) / 2 * xi**2 + xi**3),
        ]
    )
    n_theta = np.array(
        [
            6 * (xi**2 - xi) / length,
            1 + phi - (4 + phi) * xi + 3 * xi**2,
            6 * (xi - xi**2) / length,
            -(2 - phi) * xi + 3 * xi**2,
        ]
    )
    curvature = np.array(
        [6 * (2 * xi - 1) / length, -(4 + phi) + 6 * xi, 6 * (1 - 2 * xi) / length, -(2 - phi) + 6 * xi]
    )
    return n_v / (1 + phi), n_theta / (1 + phi), curvature / length / (1 + phi)
