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

import lazy_loader

from sigdb.core import __version__ as __version__

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "Damage",
    "Periodic",
    "SigdbError",
    "TimeProfile",
    "ToothDamage",
    "Transient",
    "__version__",
    "add_features",
    "diagnose",
    "ensemble",
    "load_model",
    "load_transmission",
    "march",
    "new_rig",
    "open",
    "prepare",
    "read_recording",
    "recognition",
    "signature",
    "simulate",
]
