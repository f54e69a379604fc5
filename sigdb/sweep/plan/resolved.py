"""The resolved recipe of a plan, which a database stores, and its hash."""

import hashlib
import json
from typing import TYPE_CHECKING, Any

from sigdb.core import without_keys
from sigdb.database import FORMAT
from sigdb.dynamics import DEFAULT_SOLVER
from sigdb.transmission import preset_teeth

if TYPE_CHECKING:
    from sigdb.sweep.plan.plan import Plan


def resolved_content(plan: "Plan") -> dict[str, Any]:
    """Return everything that determines a plan's rows, with every default filled in."""
    content: dict[str, Any] = {
        "format": FORMAT,
        "sweep": plan.design.model_dump(mode="json", exclude={"rig", "solver", "store"}),
        "measurement": plan.measurement.model_dump(mode="json"),
        "signature": plan.signature.model_dump(mode="json"),
        "rig": plan.rig.model_dump(mode="json"),
    }
    content["sweep"]["gear"] = plan.gear
    content["sweep"]["patterns"] |= _presets(plan)
    content["signature"]["sensors"] = list(plan.sensors)
    # Defaults that came later are left out, so that older hashes hold.
    content |= {"solver": plan.design.solver} if plan.design.solver != DEFAULT_SOLVER else {}
    content |= {"nuisance": plan.nuisance.model_dump(mode="json")} if plan.nuisance.exist else {}
    return content | ({"parts": plan.parts_settings} if plan.parts_settings else {})


def hash_of(resolved: dict[str, Any]) -> str:
    """Return the SHA-256 of a resolved recipe without what determines no row of its rig."""
    return hashlib.sha256(json.dumps(without_sources(resolved), sort_keys=True).encode()).hexdigest()


def without_sources(resolved: dict[str, Any]) -> dict[str, Any]:
    """Return a resolved recipe without title, sources of the rig's numbers and what is assumed of them."""
    sourced = {
        name: without_keys(resolved[name], keys)
        for name, keys in (("rig", ("sources", "assumed", "title")), ("nuisance", ("sources",)))
        if name in resolved
    }
    return resolved | sourced


def _presets(plan: "Plan") -> dict[str, list[dict[str, object]]]:
    """Return the patterns that the grids name and the design does not define, on the rig's tooth count."""
    teeth = plan.rig.gears[plan.gear].teeth
    return {
        name: [damage.model_dump(mode="json") for damage in preset_teeth(name, teeth)]
        for name in plan.design.named_patterns
        if name not in plan.design.patterns
    }


def same_content(content: object, other: object) -> bool:
    """Return whether two resolved recipes have the same content; TOML has no key that holds None."""
    if isinstance(content, dict) and isinstance(other, dict):
        keys = {key for key in {*content, *other} if content.get(key) is not None or other.get(key) is not None}
        return all(same_content(content.get(key), other.get(key)) for key in keys)
    if isinstance(content, list | tuple) and isinstance(other, list | tuple):
        return len(content) == len(other) and all(map(same_content, content, other))
    return bool(content == other)
