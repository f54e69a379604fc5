"""The response of a rig: the periodic steady state, healthy or damaged, and its stability."""

from sigdb.dynamics.periodic import PeriodicRig
from sigdb.dynamics.prepare import prepare
from sigdb.dynamics.simulate import ContactLossWarning, Periodic, Response, simulate, stable_multiplier
from sigdb.dynamics.stability import floquet_multiplier
from sigdb.dynamics.steady_state import SteadyState

__all__ = [
    "ContactLossWarning",
    "Periodic",
    "PeriodicRig",
    "Response",
    "SteadyState",
    "floquet_multiplier",
    "prepare",
    "simulate",
    "stable_multiplier",
]
