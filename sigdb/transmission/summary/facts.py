"""Facts of a rig: the types of what its description holds. SI units, but for names that end in _deg, _rpm or _hz."""

from typing import TypedDict


class OperatingFacts(TypedDict):
    """The operating point: speed and torque of the drive, and the shaft that they refer to."""

    shaft: str | None
    drive: str | None
    load: str | None
    speed_rpm: float
    torque: float
    rotation: int
    load_fluctuation: float
    load_order: int
    load_angle_deg: float
    drive_shaft: str


class ShaftFacts(TypedDict):
    """A shaft; its speed is signed about its own z axis."""

    name: str
    segments: int
    nodes: int
    length: float
    mass: float
    speed_rpm: float
    speed_hz: float
    motions: list[str]


class BodyFacts(TypedDict):
    """A rigid body on a node of a shaft."""

    name: str
    shaft: str
    node: int
    mass: float
    polar_inertia: float
    diametral_inertia: float


class GearFacts(BodyFacts):
    """A gear; mean pitch radius and pitch angle are None where it meshes with none."""

    teeth: int
    pitch_radius: float | None
    pitch_angle_deg: float | None


class MeshFacts(TypedDict):
    """A mesh under the mean torque; ``tooth_cycle_hz`` is how often the same two teeth meet."""

    name: str
    driving: str
    driven: str
    ratio: float
    stiffness: float
    contact_ratio: float
    normal_force: float
    static_compression: float
    mesh_frequency_hz: float
    harmonics_hz: list[float]
    tooth_cycle_hz: float


class ToothForceFacts(TypedDict):
    """Static force on a gear in a mesh: radial positive towards its axis, axial along its shaft's z."""

    mesh: str
    gear: str
    tangential: float
    radial: float
    axial: float


class BearingFacts(TypedDict):
    """A bearing: the diagonals of its stiffness and damping over x, y, z, rx, ry, rz."""

    name: str
    shaft: str
    node: int
    seat: str | None
    stiffness: list[float]
    damping: list[float]
    cross_terms: bool


class CouplingFacts(TypedDict):
    """A coupling to an end machine of some inertia, or to another shaft."""

    name: str
    shaft: str
    node: int
    stiffness: float
    damping: float
    inertia: float | None
    to_shaft: str | None
    to_node: int
    lateral_stiffness: tuple[float, float, float]


class CasingModeFacts(TypedDict):
    """A mode of the casing without its rotors."""

    frequency_hz: float
    damping_ratio: float
    modal_mass: float
    shape: dict[str, tuple[float, float, float]]


class SensorFacts(TypedDict):
    """A sensor on a gear or on a point of the casing."""

    name: str
    unit: str
    gear: str | None
    point: str | None
    direction: tuple[float, float, float]
    quantity: str


class ExcitationFacts(TypedDict):
    """An excitation other than torque and mesh stiffness."""

    what: str
    size: float
    unit: str
    shaft: str


class ModeFacts(TypedDict):
    """A mode of the coupled rig; ``moves`` is the share of kinetic energy in each motion, greatest first."""

    frequency_hz: float
    damping_ratio: float
    moves: dict[str, float]


class ResonanceFacts(ModeFacts):
    """A mode near the speed of a shaft or a harmonic of a mesh frequency."""

    excited_by: str
    order: int
    excitation_hz: float


class AssumedFacts(TypedDict):
    """A number that is assumed, its value, and its range, choices or tie in words; the value of a table is its kind."""

    path: str
    value: float | int | str | list[float]
    assumed: str
    is_free: bool


class RigFacts(TypedDict):
    """A rig as :func:`~sigdb.transmission.describe_rig` describes it."""

    name: str
    title: str
    damping_ratio: float
    operating: OperatingFacts
    shafts: list[ShaftFacts]
    gears: list[GearFacts]
    disks: list[BodyFacts]
    meshes: list[MeshFacts]
    tooth_forces: list[ToothForceFacts]
    bearings: list[BearingFacts]
    couplings: list[CouplingFacts]
    casing: list[CasingModeFacts]
    sensors: list[SensorFacts]
    excitations: list[ExcitationFacts]
    modes: list[ModeFacts]
    overdamped: int
    resonances: list[ResonanceFacts]
    origins: dict[str, int]
    assumed: list[AssumedFacts]
    remarks: list[str]
