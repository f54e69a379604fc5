"""A plan again from what its database says of it."""

from typing import Any

from sigdb.core.errors import DatabaseError, InputError
from sigdb.core.fields import validated
from sigdb.measurement import Measurement
from sigdb.signature.settings import Signature
from sigdb.sweep.design import Design
from sigdb.sweep.plan import Plan
from sigdb.sweep.planning import make_plan
from sigdb.sweep.resolved import counted, same_content
from sigdb.transmission import Transmission

_OTHER_VERSION = "it was made by another version of sigdb; use that version, or make the database again"


def plan_from(resolved: dict[str, Any]) -> Plan:
    """The plan of a database from its resolved recipe, as ``sigdb.toml`` holds it.

    Parameters
    ----------
    resolved
        What :attr:`Plan.resolved` was, or the same without the keys that hold None.

    Raises
    ------
    DatabaseError
        If the plan would not be the same: another version of sigdb resolved the recipe.

    Examples
    --------
    >>> import sigdb
    >>> from sigdb.measurement import Measurement
    >>> from sigdb.signature.settings import Signature
    >>> from sigdb.sweep import Design, make_plan, plan_from
    >>> design = Design(rig="nasa-spiral-bevel", grid=[{"stiffness_loss": [0.2, 0.4]}])
    >>> plan = make_plan(design, Measurement(), Signature(), sigdb.load_transmission(design.rig))
    >>> plan_from(plan.resolved).hash == plan.hash
    True
    """
    try:
        plan = _rebuilt(resolved)
    except (InputError, KeyError, TypeError) as error:
        raise DatabaseError(
            f"the plan cannot be made again from the resolved recipe ({error}); {_OTHER_VERSION}"
        ) from None
    if not same_content(counted(plan.resolved), counted(resolved)):
        raise DatabaseError(f"the plan made again from the resolved recipe is another one; {_OTHER_VERSION}")
    return plan


def _rebuilt(resolved: dict[str, Any]) -> Plan:
    owner = "resolved recipe"
    rig = validated(Transmission, resolved["rig"], owner=owner)
    sweep = resolved["sweep"] | {"rig": rig.name}
    return make_plan(
        validated(Design, sweep, owner=owner),
        validated(Measurement, resolved["measurement"], owner=owner),
        validated(Signature, resolved["signature"], owner=owner),
        rig,
        **resolved.get("parts", {}),
    )
