"""Cross-sections of a spur tooth along its centre line, sound or damaged: what its stiffness as a beam is made of."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray
from sigdb.transmission.damage import ToothDamage
from sigdb.transmission.mesh.profiles import raised_cosine
from sigdb.transmission.mesh.tooth_form import ToothForm

_FILLET_PANELS, _LOWER_PANELS = 48, 16
_CHIP_EDGE = 0.2
"""Height over which the edge of a chip is smoothed, in modules."""
_LEAST_THICKNESS = 1e-3
"""Thickness below which no section falls, in modules: a billionth of the stiffness in bending is left."""
_LEAST_WIDTH = 1e-9
"""Width that is always left, as a fraction of the face width."""


@dataclass(frozen=True, kw_only=True)
class ToothSections:
    """Sections at the nodes of Gauss's two-point rule, in panels from the root circle to the last point of contact.

    Attributes
    ----------
    height
        (panels, 2) distance from the gear's centre, m.
    weight
        (panels, 2) weights of an integral over the height, m.
    thickness, width
        (panels, 2), m.
    area, inertia
        (panels, 2) of the sections, m^2 and m^4.
    """

    height: FloatArray
    weight: FloatArray
    thickness: FloatArray
    width: FloatArray
    area: FloatArray
    inertia: FloatArray


def sections(form: ToothForm, face_width: float, rho: FloatArray, centre: float, damage: ToothDamage) -> ToothSections:
    """Sections of a tooth, with a panel's edge at every point of contact.

    Parameters
    ----------
    form, face_width
        The tooth.
    rho
        (n,) radii of curvature of the points of contact, ascending, m.
    centre
        Radius of curvature at which the pits' centres lie, m.
    damage
        If the damage does not fit the tooth: crack, wear, chip and pits are checked in this order.

    Notes
    -----
    The last n - 1 panels lie between the points of contact.
    """
    gamma, d_gamma = _panels(np.linspace(np.pi / 2, form.pressure_angle, _FILLET_PANELS + 1))
    lower = np.linspace(form.involute_start, rho[0], _LOWER_PANELS + 1)
    curvature, d_rho = _panels(np.concatenate([lower, rho[1:]]))
    (y_fillet, x_fillet), (y_flank, x_flank) = form.fillet(gamma), form.involute(curvature)
    dy_fillet = d_gamma * form.fillet_slope(gamma)
    dy_flank = d_rho * curvature / form.base_radius * np.cos(form.normal_angle(curvature))
    y, x = np.concatenate([y_fillet, y_flank]), np.concatenate([x_fillet, x_flank])

    thickness = x + loaded_side(form, y, x, damage)
    worn = damage.wear_depth / np.cos(form.normal_angle(curvature)) * (curvature >= rho[0])
    worn = np.concatenate([np.zeros_like(gamma), worn])
    thickness = np.maximum(thickness - worn, _LEAST_THICKNESS * form.module)
    width = face_width * np.maximum(1 - chipped(form, y, damage), _LEAST_WIDTH)
    area, inertia = thickness * width, thickness**3 * width / 12
    if damage.pit_diameter and damage.pit_depth:
        pits = np.zeros_like(y)
        pits[len(gamma) :] = pitted_width(form, curvature, centre, damage) * (curvature >= rho[0])
        area, inertia = _hollowed(area, inertia, thickness, pits, damage.pit_depth)
    return ToothSections(
        height=y,
        weight=np.concatenate([dy_fillet, dy_flank]),
        thickness=thickness,
        width=width,
        area=area,
        inertia=inertia,
    )


def contact_width(
    form: ToothForm, face_width: float, rho: FloatArray, centre: float, damage: ToothDamage
) -> FloatArray:
    """(n,) width over which a tooth can touch at radii of curvature rho, m."""
    left = face_width * (1 - chipped(form, form.involute(rho)[0], damage)) - pitted_width(form, rho, centre, damage)
    return np.maximum(left, _LEAST_WIDTH * face_width)


def loaded_side(form: ToothForm, y: FloatArray, x: FloatArray, damage: ToothDamage) -> FloatArray:
    """Distance from the centre line to the loaded side of each section, less than x where a root crack relieves it.

    The crack begins where the fillet's tangent is at 30 deg to the centre line and goes inwards and down. Sections
    above its tip end at a line through the tip. This line is parallel to the centre line, or goes to the corner of the
    tooth's tip where the crack is deeper than that corner (Wu, Zuo, Parey 2008, doi:10.1016/j.jsv.2008.03.038).
    """
    if not damage.crack_depth:
        return x
    y_start, x_start = crack_start(form)
    angle = np.deg2rad(damage.crack_angle_deg)
    x_tip = x_start - damage.crack_depth * np.sin(angle)
    y_tip = y_start - damage.crack_depth * np.cos(angle)
    (y_top, x_top) = (float(coordinate) for coordinate in form.involute(np.array(form.tip_curvature)))
    rising = np.clip((y - y_start) / (y_top - y_start), 0, 1)
    line = x_tip + max(0.0, x_top - x_tip) * rising
    # Below the crack's start the tooth hangs on what is left of that section.
    left = np.where(y < y_start, x_start - x + x_tip, line)
    return np.where(y >= y_tip, np.minimum(x, left), x)


def crack_start(form: ToothForm) -> tuple[float, float]:
    """Point (y, x) where a root crack begins: the fillet's tangent is at 30 deg to the tooth's centre line."""
    gamma = np.linspace(form.pressure_angle, np.pi / 2, 2001)
    at = np.interp(np.pi / 6, form.fillet_inclination(gamma), gamma)
    y, x = form.fillet(np.array(at))
    return float(y), float(x)


def broken_off(form: ToothForm, damage: ToothDamage) -> bool:
    """Whether the crack has gone through the root."""
    return damage.crack_depth * np.sin(np.deg2rad(damage.crack_angle_deg)) >= 2 * crack_start(form)[1]


def is_missing(form: ToothForm, damage: ToothDamage) -> bool:
    """Whether nothing of the tooth is left: broken off, or chipped down to its root over the whole face width."""
    to_the_root = damage.chip_height >= (1 - 1e-9) * (form.tip_radius - form.root_radius)
    return broken_off(form, damage) or (to_the_root and damage.chip_extent == 1)


def chipped(form: ToothForm, y: FloatArray, damage: ToothDamage) -> FloatArray:
    """Fraction of the face width that is missing at distances y from the gear's centre."""
    edge = _CHIP_EDGE * form.module
    height = form.tip_radius - form.root_radius
    # The edge slides from above the tip (no chip) to below the root (all of the tooth).
    depth = damage.chip_height * (height + edge) / height
    return damage.chip_extent * raised_cosine((depth - (form.tip_radius - y)) / edge)


def pitted_width(form: ToothForm, rho: FloatArray, centre: float, damage: ToothDamage) -> FloatArray:
    """Width that round pits take from the flank at radii of curvature rho: their chords, m."""
    # Centres below the base circle, off any flank, count as negative.
    along = (rho**2 - centre * abs(centre)) / (2 * form.base_radius)
    return damage.pits * np.sqrt(np.maximum(damage.pit_diameter**2 - 4 * along**2, 0.0))


def _hollowed(
    area: FloatArray, inertia: FloatArray, thickness: FloatArray, pits: FloatArray, depth: float
) -> tuple[FloatArray, FloatArray]:
    """Area and inertia of sections with a slot of a width and a depth on one side."""
    depth_here = np.minimum(depth, (1 - 1e-3) * thickness)
    lost = np.minimum(pits, area / thickness) * depth_here
    arm = (thickness - depth_here) / 2
    return area - lost, inertia - lost * depth_here**2 / 12 - area * lost * arm**2 / (area - lost)


def _panels(edges: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nodes and weights (panels, 2) of Gauss's two-point rule between edges."""
    middle, half = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 2
    node = np.array([-1, 1]) / np.sqrt(3)
    return middle[:, None] + half[:, None] * node, np.repeat(half[:, None], 2, axis=1)
