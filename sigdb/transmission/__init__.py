"""Any rig, of any gear type, becomes one :class:`ModalSystem`: poles, inputs, outputs, direct terms."""

from sigdb.transmission.damage import Damage, ToothDamage
from sigdb.transmission.library import built_in_transmissions, load_transmission
from sigdb.transmission.modal import CoupledModes, ModalSystem, coupled_modes, modal_system
from sigdb.transmission.rig import Transmission

__all__ = [
    "CoupledModes",
    "Damage",
    "ModalSystem",
    "ToothDamage",
    "Transmission",
    "built_in_transmissions",
    "coupled_modes",
    "load_transmission",
    "modal_system",
]
