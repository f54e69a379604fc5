"""Any rig, of any gear type, becomes one :class:`ModalSystem`: poles, inputs, outputs, direct terms."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "Assumptions",
    "Choices",
    "Compliance",
    "CoupledModes",
    "Damage",
    "ModalSystem",
    "Range",
    "Tie",
    "ToothDamage",
    "Transmission",
    "built_in_transmissions",
    "coupled_modes",
    "describe_rig",
    "load_transmission",
    "modal_system",
    "new_rig",
    "static_compliance",
    "write_new_rig",
]
