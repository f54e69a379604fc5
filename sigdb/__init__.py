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

from typing import TYPE_CHECKING

from sigdb.core.lazy import lazy_names
from sigdb.core.version import __version__

if TYPE_CHECKING:
    from sigdb import recognition, signature
    from sigdb.core.errors import SigdbError
    from sigdb.database import open
    from sigdb.dynamics import Periodic, TimeProfile, Transient, march, simulate
    from sigdb.measurement import read_recording
    from sigdb.pipeline import diagnose
    from sigdb.recognition import load_model
    from sigdb.transmission import Damage, ToothDamage, load_transmission

__all__ = [
    "Damage",
    "Periodic",
    "SigdbError",
    "TimeProfile",
    "ToothDamage",
    "Transient",
    "__version__",
    "diagnose",
    "load_model",
    "load_transmission",
    "march",
    "open",
    "read_recording",
    "recognition",
    "signature",
    "simulate",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "Damage": "sigdb.transmission",
        "Periodic": "sigdb.dynamics",
        "SigdbError": "sigdb.core.errors",
        "TimeProfile": "sigdb.dynamics",
        "ToothDamage": "sigdb.transmission",
        "Transient": "sigdb.dynamics",
        "diagnose": "sigdb.pipeline",
        "load_model": "sigdb.recognition",
        "load_transmission": "sigdb.transmission",
        "march": "sigdb.dynamics",
        "open": "sigdb.database",
        "read_recording": "sigdb.measurement",
        "recognition": "sigdb.recognition",
        "signature": "sigdb.signature",
        "simulate": "sigdb.dynamics",
    },
)
