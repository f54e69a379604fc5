"""Kinds of gear damage by the names of ISO 10825:1995, and the words that files and tables use for them.

The names are headings of the contents of ISO 10825:1995 [1]_ [2]_, in the singular, and four words for several headings
(:data:`KINDS`). They were not checked against its text. ISO 10825-1:2022 [3]_ has replaced it; only the scope of that
edition could be read, and its names were not compared.

References
----------
.. [1] ISO 10825:1995, Gears - Wear and damage to gear teeth - Terminology, contents in the sample at
   https://standards.iteh.ai/catalog/standards/iso/0dd1f686-d997-4424-8385-f02185b8eb7b/iso-10825-1995.
.. [2] Failure mode classification for gears (ISO 10825), a list of the headings at
   http://werktuigbouw.nl/abc/ISO10825-1.htm.
.. [3] ISO 10825-1:2022, Gears - Wear and damage to gear teeth - Part 1: Nomenclature and characteristics, scope at
   https://standards.iteh.ai/catalog/standards/iso/183dbb21-7022-442c-aaad-ab240de89aaa/iso-10825-1-2022.
"""

import re

from sigdb.core import InputError, suggestion

NONE, UNKNOWN, OTHER = "none", "unknown", "other"

KINDS = (
    *("wear", "polishing", "abrasive wear", "excessive wear", "scratching", "moderate scratching", "severe scratching"),
    *("interference wear", "corrosion", "chemical corrosion", "fretting corrosion", "scaling", "overheating"),
    *("cavitation erosion", "hydraulic erosion", "electric erosion", "scuffing", "indentation", "plastic deformation"),
    *("rippling", "ridging", "burrs", "pitting", "initial pitting", "progressive pitting", "micropitting"),
    *("flake pitting", "spalling", "case crushing", "crack", "hardening crack", "grinding crack", "fatigue crack"),
    *("breakage", "overload breakage", "brittle fracture", "ductile fracture", "semi-brittle fracture", "tooth shear"),
    *("smeared fracture", "fatigue breakage", "tooth end breakage"),
)
"""Headings of ISO 10825:1995 in its order. ``wear``, ``scratching``, ``crack`` and ``breakage`` stand for a heading and
all below it where no more is stated: sliding wear, both scratchings, cracks and tooth breakage."""

KIND_NAMES = (NONE, *KINDS, OTHER, UNKNOWN)
"""Values of the column ``kind``: no damage, a kind, something that ISO 10825:1995 has no name for, or unknown."""

_HEALTHY = (
    "healthy",
    "health",
    "normal",
    "good",
    "ok",
    "intact",
    "undamaged",
    "no damage",
    "no fault",
    "baseline",
    NONE,
)
_WORDS = {
    "worn": "wear",
    "surface wear": "wear",
    "tooth wear": "wear",
    "pit": "pitting",
    "pitted": "pitting",
    "spall": "spalling",
    "spalled": "spalling",
    "scoring": "moderate scratching",
    "sliding wear": "wear",
    "quench crack": "hardening crack",
    "scuffed": "scuffing",
    "cracked": "crack",
    "tooth crack": "crack",
    "root crack": "crack",
    "root": "crack",
    "chip": "breakage",
    "chipped": "breakage",
    "chipping": "breakage",
    "chipped tooth": "breakage",
    "broken": "breakage",
    "broken tooth": "breakage",
    "miss": "breakage",
    "missing": "breakage",
    "missing tooth": "breakage",
    "tooth breakage": "breakage",
    "tooth fracture": "breakage",
}
"""Kind by a word for a state; part of a tooth or all of it is missing after a breakage."""


def kind_of(state: str) -> str:
    """Return the kind of damage that a word for a state means: one of :data:`KIND_NAMES`.

    Examples
    --------
    >>> kind_of("Chipped_Tooth"), kind_of("normal"), kind_of("state 3")
    ('breakage', 'none', 'unknown')
    """
    word = _plain(state)
    if word in _HEALTHY:
        return NONE
    return _KINDS_BY_WORD.get(word) or _WORDS.get(word, UNKNOWN)


def _plain(words: str) -> str:
    return re.sub(r"[\s_-]+", " ", words).strip().lower()


_KINDS_BY_WORD = {_plain(kind): kind for kind in KIND_NAMES}


def checked_kind(text: str) -> str:
    """Return a kind of damage that a table states as such.

    Raises
    ------
    InputError
        If it is no kind; the message names the nearest.
    """
    kind = kind_of(text)
    if kind == UNKNOWN and text.strip().lower() != UNKNOWN:
        raise InputError(f"kind = {text!r} is no kind of damage of ISO 10825:1995{suggestion(text, KIND_NAMES)}")
    return kind
