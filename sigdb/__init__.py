"""sigdb builds fault-signature databases for gear transmissions and recognises damage with them.

The names below load when they are first used, so that ``import sigdb`` is quick.

Examples
--------
>>> import sigdb
>>> rig = sigdb.load_transmission("nasa-spiral-bevel")
>>> response = sigdb.simulate(rig, sigdb.Damage(tooth=6, stiffness_loss=0.5))
>>> response.gear
'pinion'
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sigdb import recognition, signature
    from sigdb.core.errors import SigdbError
    from sigdb.database import open
    from sigdb.dynamics import Periodic, simulate
    from sigdb.recognition import load_model
    from sigdb.transmission import Damage, load_transmission

__version__ = "0.1.0"

_HOME = {
    "Damage": "sigdb.transmission",
    "Periodic": "sigdb.dynamics",
    "SigdbError": "sigdb.core.errors",
    "load_model": "sigdb.recognition",
    "load_transmission": "sigdb.transmission",
    "open": "sigdb.database",
    "simulate": "sigdb.dynamics",
}
_LAYERS = ("recognition", "signature")

__all__ = [  # noqa: RUF022 - the public surface, in the order of a user's work
    "load_transmission",
    "Damage",
    "simulate",
    "Periodic",
    "open",
    "load_model",
    "signature",
    "recognition",
    "SigdbError",
    "__version__",
]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(importlib.import_module(_HOME[name]), name)
    if name in _LAYERS:
        return importlib.import_module(f"sigdb.{name}")
    raise AttributeError(f"module 'sigdb' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
