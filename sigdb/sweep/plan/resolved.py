"""What a plan is made from, as it is stored with a database, and its hash."""

import hashlib
import json
from typing import TYPE_CHECKING, Any

from sigdb.database import FORMAT
from sigdb.dynamics import DEFAULT_SOLVER
from sigdb.transmission import preset_teeth

if TYPE_CHECKING:
    from sigdb.sweep.plan.plan import Plan


def resolved_content(plan: "Plan") -> dict[str, Any]:
    """All that determines a plan's rows, with every default filled in."""
    content: dict[str, Any] = {
        "format": FORMAT,
        "sweep": plan.design.model_dump(mode="json", exclude={"rig", "solver"}),
        "measurement": plan.measurement.model_dump(mode="json"),
        "signature": plan.signature.model_dump(mode="json"),
        "rig": plan.rig.model_dump(mode="json"),
    }
    content["sweep"]["gear"] = plan.gear
    content["sweep"]["patterns"] |= _presets(plan)
    content["signature"]["sensors"] = list(plan.sensors)
    # Defaults that came later are left out, so that older hashes hold.
    content |= {"solver": plan.design.solver} if plan.design.solver != DEFAULT_SOLVER else {}
    return content | ({"parts": plan.own_parts} if plan.own_parts else {})


def hash_of(resolved: dict[str, Any]) -> str:
    """SHA-256 of a resolved recipe, sources of the rig's numbers and descriptions aside."""
    return hashlib.sha256(json.dumps(without_uncounted(resolved), sort_keys=True).encode()).hexdigest()


def without_uncounted(resolved: dict[str, Any]) -> dict[str, Any]:
    """What of a resolved recipe determines rows: all but sources of the rig's numbers and descriptions."""
    return resolved | {"rig": _without(resolved["rig"], ("sources", "title"))}


def _presets(plan: "Plan") -> dict[str, Any]:
    """Patterns that the grids name and the design does not define, on the rig's own tooth count."""
    teeth = plan.rig.gears[plan.gear].teeth
    return {
        name: [one.model_dump(mode="json") for one in preset_teeth(name, teeth)]
        for name in plan.design.named_patterns
        if name not in plan.design.patterns
    }


def _without(value: Any, keys: tuple[str, ...]) -> Any:
    if isinstance(value, dict):
        return {key: _without(item, keys) for key, item in value.items() if key not in keys}
    if isinstance(value, list):
        return [_without(item, keys) for item in value]
    return value


def same_content(one: Any, other: Any) -> bool:
    """Whether two resolved recipes say the same; a key that holds None is not in TOML."""
    if isinstance(one, dict) and isinstance(other, dict):
        keys = {key for key in {*one, *other} if one.get(key) is not None or other.get(key) is not None}
        return all(same_content(one.get(key), other.get(key)) for key in keys)
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(map(same_content, one, other))
    return bool(one == other)
