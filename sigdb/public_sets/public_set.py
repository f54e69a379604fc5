"""The description of a public set of recordings: each statement cites the page that makes it."""

import re
from collections.abc import Mapping
from importlib import resources
from typing import Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from sigdb.core import InputError, Section, read_toml, suggestion, validated
from sigdb.ingest import IngestSettings

Expected = Literal["damage", "none", "unknown"]


class Source(Section):
    """A page that statements cite."""

    title: str = Field(description="Title of the page.")
    url: str = Field(description="Address of the page.")


class Statement(Section):
    """A statement, and the key of the source that makes it."""

    text: str = Field(description="The statement in own words.")
    source: str = Field(description="Key of the source.")


class State(Section):
    """Labels that a word in a file's name stands for."""

    health: Literal["healthy", "damaged", "unknown"] = Field(description="Health of the gear by the source.")
    kind: str = Field(description="Kind of gear damage by ISO 10825:1995, none, other or unknown.")
    tooth: int | None = Field(default=None, ge=0, description="Damaged tooth, where the source states it.")
    severity: str | None = Field(default=None, description="Severity in the words of the source.")
    state: str | None = Field(default=None, description="State in plain words; the word itself if left out.")


class Files(Section):
    """Files of one kind: a pattern of their names, and facts that hold for all of them."""

    pattern: str = Field(description="Pattern with the fields of a table of recordings; {state} takes a key of states.")
    facts: dict[str, str] = Field(default={}, description="Facts of these files, as a table of recordings holds them.")
    recording: bool = Field(default=True, description="Whether these files hold raw recordings that ingest reads.")
    least: int = Field(default=1, ge=0, description="Number of such files in the complete set; 0 where not stated.")
    source: str = Field(description="Key of the source.")


class PublicSet(Section):
    """A public set: where it is, its files, gears, labels, and what a right answer is.

    A field that no page could be cited for is left out, and named in ``not_cited``.
    """

    title: str = Field(description="Title of the set.")
    where: Statement = Field(description="Where to get it.")
    licence: Statement | None = Field(default=None, description="Licence of the recordings.")
    gears: Statement | None = Field(default=None, description="Tooth counts.")
    labels: Statement = Field(description="How far the labels can be trusted.")
    answer: Statement = Field(description="The right answer.")
    expected: Literal["by label", "none", "unknown"] = Field(
        description="Right answers: by the labels, no gear damage whatever they say, or not known."
    )
    label_trust: Literal["inspected", "seeded", "stated", "assumed", "unknown"] = Field(
        description="How far the labels can be trusted, as a column of a database of recordings."
    )
    files: tuple[Files, ...] = Field(default=(), strict=False, description="Kinds of files.")
    states: dict[str, State] = Field(default={}, description="Labels by the word in a file's name.")
    settings: dict[str, Any] = Field(default={}, description="Settings of an ingest.")
    needs: tuple[str, ...] = Field(
        default=(), strict=False, description="Settings that the user must give, since no page states them."
    )
    reference: str = Field(default="", description="Pattern of the healthy files that others are compared with.")
    sha256: dict[str, str] = Field(default={}, description="SHA-256 of files that could be had, by name.")
    sources: dict[str, Source] = Field(description="Pages that are cited, by key.")
    not_cited: tuple[str, ...] = Field(
        default=(), strict=False, description="Facts that no page could be cited for, which are therefore left out."
    )
    tried: str = Field(default="", description="Real files that the adapter was tried on; empty if on none.")

    @field_validator("sha256")
    @classmethod
    def _are_checksums(cls, checksums: dict[str, str]) -> dict[str, str]:
        for name, text in checksums.items():
            if not re.fullmatch(r"[0-9a-f]{64}", text):
                raise ValueError(f"{name}: {text!r} is no SHA-256")
        return checksums

    @model_validator(mode="after")
    def _cites_known_sources(self) -> Self:
        statements = [self.where, self.licence, self.gears, self.labels, self.answer]
        keys = [each.source for each in (*statements, *self.files) if each is not None]
        for key in keys:
            if key not in self.sources:
                raise ValueError(f"source {key!r} is not among the sources{suggestion(key, self.sources)}")
        return self

    @property
    def warning(self) -> str:
        """A sentence where the adapter was not tried on real files; empty where it was."""
        return (
            ""
            if self.tried
            else f"this adapter of {self.title} was not tried on real files, only on a small synthetic twin of their "
            "layout; check what it finds"
        )

    def state(self, word: str) -> State | None:
        """Return the state that a word in a file's name stands for; capitals do not count."""
        by_word = {key.casefold(): state for key, state in self.states.items()}
        return by_word.get(word.casefold())

    def expected_of(self, word: str | None) -> Expected:
        """Return the right answer for a file with a word for its state: damage, none, or unknown."""
        if self.expected != "by label":
            return self.expected
        state = None if word is None else self.state(word)
        if state is None or state.health == "unknown":
            return "unknown"
        return "damage" if state.health == "damaged" else "none"

    def ingest_settings(self, more: Mapping[str, Any] | None = None) -> IngestSettings:
        """Return the settings of an ingest, with those of the user.

        Raises
        ------
        InputError
            If a setting that no page states is missing.
        """
        stated = {**self.settings, **(more or {})}
        for part in ("reading", "averaging"):
            if merged := {**self.settings.get(part, {}), **(more or {}).get(part, {})}:
                stated[part] = merged
        lacking = [name for name in self.needs if name not in stated and name not in stated.get("reading", {})]
        if lacking:
            options = " and ".join(f"--{name.replace('_', '-')}" for name in lacking)
            raise InputError(f"{self.title}: no cited page states {', '.join(lacking)}; give {options}")
        return validated(IngestSettings, stated, owner=self.title)


def public_set_names() -> tuple[str, ...]:
    """Return the names of the public sets.

    Returns
    -------
    tuple of str
        In alphabetical order.
    """
    files = resources.files("sigdb.public_sets").joinpath("sets").iterdir()
    return tuple(sorted(file.name.removesuffix(".toml") for file in files if file.name.endswith(".toml")))


def load_public_set(name: str) -> PublicSet:
    """Return the description of a public set.

    Parameters
    ----------
    name : str
        Its name, see :func:`public_set_names`.

    Returns
    -------
    PublicSet
        Statements with their sources.

    Raises
    ------
    InputError
        If there is no such set.

    Examples
    --------
    >>> from sigdb.public_sets import load_public_set
    >>> load_public_set("phm2009").settings["reading"]["pulses_per_rev"]
    10
    """
    if name not in public_set_names():
        raise InputError(f"{name!r} is no public set{suggestion(name, public_set_names())}")
    with resources.as_file(resources.files("sigdb.public_sets").joinpath("sets", f"{name}.toml")) as path:
        content = read_toml(path)
    return validated(PublicSet, content, owner=f"public set {name}")
