"""The response of a rig: the periodic steady state, healthy or damaged, its stability, and the march in time."""

from sigdb.dynamics.history import TimeHistory, march
from sigdb.dynamics.periodic import PeriodicRig
from sigdb.dynamics.prepare import prepare
from sigdb.dynamics.simulate import ContactLossWarning, Periodic, Response, simulate, stable_multiplier
from sigdb.dynamics.stability import floquet_multiplier
from sigdb.dynamics.steady_state import SteadyState
from sigdb.dynamics.time_profile import TimeProfile
from sigdb.dynamics.transient import Orbit, Transient, settle

__all__ = [
    "ContactLossWarning",
    "Orbit",
    "Periodic",
    "PeriodicRig",
    "Response",
    "SteadyState",
    "TimeHistory",
    "TimeProfile",
    "Transient",
    "floquet_multiplier",
    "march",
    "prepare",
    "settle",
    "simulate",
    "stable_multiplier",
]
