"""The response of a rig: the periodic steady state, healthy or damaged, its stability, and the march in time."""

from sigdb.dynamics.drawn_ensemble import REASONS as REASONS
from sigdb.dynamics.drawn_ensemble import Ensemble, ensemble
from sigdb.dynamics.drawn_ensemble import possible_rig as possible_rig
from sigdb.dynamics.excitation import checked_index_errors as checked_index_errors
from sigdb.dynamics.march.history import TimeHistory, march
from sigdb.dynamics.march.transient import Orbit, Transient, settle
from sigdb.dynamics.period import check_in_one_mesh as check_in_one_mesh
from sigdb.dynamics.period import common_period as common_period
from sigdb.dynamics.period import damaged_gear as damaged_gear
from sigdb.dynamics.periodic.healthy_sensitivity import HealthySensitivity as HealthySensitivity
from sigdb.dynamics.periodic.periodic import PeriodicRig
from sigdb.dynamics.periodic.prepare import prepare_periodic
from sigdb.dynamics.periodic.steady_state import SteadyState, superpose
from sigdb.dynamics.simulate import ContactLossWarning, MarchErrorWarning, PreparedRig, Response, prepare, simulate
from sigdb.dynamics.solver import DEFAULT_SOLVER as DEFAULT_SOLVER
from sigdb.dynamics.solver import SOLVERS, Periodic, PeriodicOrTransient, Prepared, Solver, solver_named
from sigdb.dynamics.stability import floquet_multiplier
from sigdb.dynamics.time_profile import TimeProfile

__all__ = [
    "SOLVERS",
    "ContactLossWarning",
    "Ensemble",
    "MarchErrorWarning",
    "Orbit",
    "Periodic",
    "PeriodicOrTransient",
    "PeriodicRig",
    "Prepared",
    "PreparedRig",
    "Response",
    "Solver",
    "SteadyState",
    "TimeHistory",
    "TimeProfile",
    "Transient",
    "ensemble",
    "floquet_multiplier",
    "march",
    "prepare",
    "prepare_periodic",
    "settle",
    "simulate",
    "solver_named",
    "superpose",
]
