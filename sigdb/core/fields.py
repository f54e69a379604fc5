"""Parameter fields: unit, bounds and help of a physical quantity, declared once, where the field is.

Validation, error messages, docs, command-line help and the metadata of database columns read them from there.
"""

from collections.abc import Iterable, Mapping
from functools import partial
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, Strict, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from sigdb.core.errors import InputError, suggestion
from sigdb.core.units import PHYSICAL, QuantityError, in_si

Vector = Annotated[tuple[float, float, float], Strict(False)]
"""Three components in the casing's frame (X, Y, Z)."""

_MOST_PROBLEMS = 20
"""Problems that one error lists."""
_LONGEST_VALUE = 120
"""Characters of a value in an error."""

KeyPath = tuple[int | str, ...]
"""Keys and indices that lead to a field."""


class Section(BaseModel):
    """A frozen group of fields: strict types, finite numbers, unknown keys refused.

    A field with a physical unit takes a text with any unit of its kind too, also inside a list: ``"2.5 mm"``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    def __init__(self, **data: Any) -> None:
        """Check the fields.

        Raises
        ------
        InputError
            Names each offending field, the rule, the value and what to do.
        """
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise _input_error(type(self), error, type(self).__name__) from None

    def __setattr__(self, name: str, value: object) -> None:
        """Refuse an assignment.

        Raises
        ------
        InputError
            Names the field and the remedy.
        """
        try:
            super().__setattr__(name, value)
        except ValidationError:
            raise InputError(
                f"{type(self).__name__}.{name} cannot be assigned: its fields do not change; make a new one with other "
                "values, of a rig with rig.replace({'operating.speed_rpm': 3000.0})"
            ) from None

    # With this mark pydantic builds nested sections itself, so that one error names the whole path of a key.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]


def quantity(unit: str, help: str, **rules: Any) -> Any:
    """Declare a field with its unit, help and bounds; a physical one also takes texts with a unit of its kind.

    Parameters
    ----------
    unit : str
        SI unit, or ``"-"`` for a number without one.
    help : str
        Description in one sentence, with the sign convention.
    rules
        ``default``, ``gt``, ``ge``, ``lt``, ``le``, ``min_length`` ... as in :func:`pydantic.Field`.
    """
    field = Field(description=help, json_schema_extra={"unit": unit}, **rules)
    if unit in PHYSICAL:
        field.metadata.append(BeforeValidator(partial(in_si, unit=unit)))
    return field


def unit_of(field: FieldInfo) -> str:
    """Return the unit of a field, ``"-"`` for a field without one."""
    extra = field.json_schema_extra
    return str(extra.get("unit", "-")) if isinstance(extra, dict) else "-"


def without_defaults(section: BaseModel, dumped: dict[str, Any], names: Iterable[str]) -> dict[str, Any]:
    """Return a dumped section without those of the named fields that have their default.

    So a section is stored and hashed as before it had these fields.
    """
    fields = type(section).model_fields
    left_out = {name for name in names if getattr(section, name) == fields[name].default}
    return {name: value for name, value in dumped.items() if name not in left_out}


S = TypeVar("S", bound=BaseModel)


def validated(model: type[S], data: Mapping[str, object], *, owner: str, first: int = 0) -> S:
    """Return the section that data describe, or raise one error that lists everything wrong with them.

    Parameters
    ----------
    model
        The section.
    data
        Its fields.
    owner
        Origin of the data for messages, usually a file.
    first
        Number of the first item of a list in messages; 0, as in the dotted paths of a rig, or 1.

    Raises
    ------
    InputError
        Names the owner (usually a file), each offending key, the rule, the value and what to do.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise _input_error(model, error, owner, first) from None


def _input_error(model: type[BaseModel], error: ValidationError, owner: str, first: int = 0) -> InputError:
    problems = error.errors()
    # A default that follows from other values fails where they do, and they are what is to be mended.
    problems = [problem for problem in problems if problem["type"] != "default_factory_not_called"] or problems
    # A list whose item is wrong is also reported as too short; only the item helps.
    inner = [problem["loc"][:depth] for problem in problems for depth in range(len(problem["loc"]))]
    reported = [problem for problem in problems if problem["type"] != "too_short" or problem["loc"] not in inner]
    lines = [line for problem in reported[:_MOST_PROBLEMS] for line in _sentence(model, problem, first).splitlines()]
    if len(reported) > _MOST_PROBLEMS:
        lines.append(f"{len(reported) - _MOST_PROBLEMS} more; mend these first")
    return InputError("\n".join(f"{owner}: {line}" for line in lines))


def _sentence(model: type[BaseModel], problem: ErrorDetails, first: int) -> str:
    """Return sentences about a problem, one a line, in the words of the file."""
    error = problem.get("ctx", {}).get("error")
    written = (*_as_written(model, problem["loc"]), *(error.place if isinstance(error, QuantityError) else ()))
    location = [part + first if isinstance(part, int) else part for part in written]
    key = ".".join(str(part) for part in location) or "(top level)"
    if problem["type"] == "extra_forbidden":
        return f"unknown key {key}{_closest(model, problem['loc'])}"
    if problem["type"] == "union_tag_invalid":
        discriminator = problem["ctx"]["discriminator"].strip("()'")
        return f"{key}.{discriminator} = {problem['ctx']['tag']!r} must be one of {problem['ctx']['expected_tags']}"
    if problem["type"] == "missing":
        return f"{key} is missing; add it"
    if problem["type"] == "string_pattern_mismatch":
        where = key.removesuffix(".[key]")
        return f"name {problem['input']!r} in {where} must be letters, digits, - or _, a letter first"
    if problem["type"] == "too_short":
        return f"{key} is empty; give at least {problem['ctx']['min_length']}"
    if problem["type"] == "too_long":
        return f"{key} has more than {problem['ctx']['max_length']} items; give fewer"
    message = problem["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    if problem["type"] == "value_error":
        return message if key == "(top level)" else "\n".join(f"{key}: {line}" for line in message.splitlines())
    return f"{key} = {_shortened(problem['input'])} must be {message}"


def _shortened(value: object) -> str:
    """Return a value as Python writes it, its middle left out where it is long."""
    try:
        text = repr(value)
    except ValueError:
        return "a number of thousands of digits"
    return text if len(text) <= _LONGEST_VALUE else f"{text[: _LONGEST_VALUE // 2]} ... {text[-_LONGEST_VALUE // 2 :]}"


def _closest(model: type[BaseModel], location: KeyPath) -> str:
    owner = _section_at(model, location[:-1])
    if owner is None:
        return "; remove it"
    return suggestion(str(location[-1]), [field.alias or name for name, field in owner.model_fields.items()])


def _section_at(model: type[BaseModel], location: KeyPath) -> type[BaseModel] | None:
    """Return the section that a path of keys ends in, looked up through tables of sections and unions."""
    candidates = _sections_in(_walk(model, location)[0])
    return candidates[0] if len(candidates) == 1 else None


def _as_written(model: type[BaseModel], location: KeyPath) -> KeyPath:
    """Return a path of keys as in the file, without the names of members of unions."""
    return _walk(model, location)[1]


def _walk(model: type[BaseModel], location: KeyPath) -> tuple[object, KeyPath]:
    """Follow a path of keys: return its end, and the path without the names of members of unions."""
    here: object = model
    written: list[int | str] = []
    for part in location:
        field = here.model_fields.get(str(part)) if isinstance(here, type) and issubclass(here, BaseModel) else None
        named = None if field else next((member for member in _sections_in(here) if part in _names(member)), None)
        if not named:
            written.append(part)
        here = field.annotation if field else named or _member(here, part)
    return here, tuple(written)


def _names(section: type[BaseModel]) -> set[int | str]:
    """Return the names of a member of a union in a path: its class, and its kind."""
    return {section.__name__} | ({section.model_fields["kind"].default} if "kind" in section.model_fields else set())


def _member(annotation: object, part: int | str) -> object:
    sections = _sections_in(annotation)
    if len(sections) == 1 and str(part) in sections[0].model_fields:
        return sections[0].model_fields[str(part)].annotation
    return annotation


def _sections_in(annotation: object) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [section for part in getattr(annotation, "__args__", ()) for section in _sections_in(part)]
