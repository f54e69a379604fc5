"""Recordings that a person drops onto the page: kept in a folder for as long as the page's server runs."""

import secrets
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.explorer.live import Shown
from sigdb.explorer.panels import average_panels
from sigdb.signature import INDICATORS
from sigdb.transmission import Transmission

if TYPE_CHECKING:
    from sigdb.diagnosis import Diagnosis

MOST_BYTES = 512 * 2**20
"""Size of a recording that is taken."""
_OPTIONS = ("tacho", "sampling_rate", "channel", "mesh_phase", "constant_speed", "speed_rpm", "torque")
"""Options of a diagnosis that a page offers."""


class Recordings:
    """Recordings of a page by their keys, and the paths of others that the command line gave."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="sigdb-explore-")
        self._files: dict[str, Path] = {}

    def add(self, name: str, content: bytes) -> str:
        """Keep a file and return its key.

        Raises
        ------
        InputError
            If it is empty.
        """
        if not content:
            raise InputError(f"{name}: the file is empty")
        key = secrets.token_hex(8)
        place = Path(self._folder.name) / key
        place.mkdir()
        self._files[key] = place / (Path(name).name or "recording")
        self._files[key].write_bytes(content)
        return key

    def give(self, path: Path) -> str:
        """Return the key of a file that stays where it is."""
        key = secrets.token_hex(8)
        self._files[key] = path
        return key

    def path(self, key: str) -> Path:
        """Return the path of a recording.

        Raises
        ------
        InputError
            If it is not kept.
        """
        if key not in self._files:
            raise InputError("this recording is not kept any more; drop it again")
        return self._files[key]

    def close(self) -> None:
        """Delete what was kept."""
        self._folder.cleanup()

    def diagnose(
        self, key: str, healthy: Sequence[str], rig: Transmission | None, teeth: str | None, options: Mapping[str, Any]
    ) -> tuple[Shown, FloatArray | None]:
        """Diagnose a recording as the command line does.

        Parameters
        ----------
        key : str
            The recording.
        healthy : sequence of str
            Healthy recordings.
        rig : Transmission or None
            The rig; without it ``teeth`` are needed.
        teeth : str or None
            Tooth counts, such as 32/80.
        options : mapping
            Reading and averaging: tacho, sampling_rate, channel, mesh_phase, constant_speed, speed_rpm, torque.

        Returns
        -------
        Shown
            The answer, and the panels of the average where there is one.
        ndarray or None
            The average.

        Raises
        ------
        InputError
            If a recording cannot be read, or an option is unknown.
        """
        from sigdb.diagnosis import diagnose  # takes long to import, and most pages read no recording

        unknown = set(options) - set(_OPTIONS)
        if unknown:
            raise InputError(f"unknown options {', '.join(sorted(unknown))}; known: {', '.join(_OPTIONS)}")
        wanted: dict[str, Any] = {name: value for name, value in options.items() if value not in (None, "", False)}
        diagnosis = diagnose(
            self.path(key),
            None if teeth else rig,
            healthy=[self.path(each) for each in healthy],
            teeth=teeth or None,
            **wanted,
        )
        return _shown(diagnosis), None if diagnosis.signature is None else diagnosis.signature.tsa


def average_in(path: Path, teeth: int) -> FloatArray | None:
    """Return one revolution from a file of plain numbers, 64 samples a tooth; None if the file is not that."""
    try:
        x = np.load(path, allow_pickle=False) if path.suffix == ".npy" else np.loadtxt(path, delimiter=",", ndmin=1)
    except (ValueError, OSError, EOFError):
        return None
    x = np.asarray(x).squeeze()
    fits = x.ndim == 1 and x.dtype.kind in "iuf" and len(x) == 64 * teeth and bool(np.isfinite(x).all())
    return x.astype(float) if fits else None


def shown_average(tsa: FloatArray, teeth: int) -> Shown:
    """Return what the page draws of an average that was measured elsewhere."""
    facts: dict[str, Any] = {
        "answer": None,
        "teeth": teeth,
        "damaged": [],
        "sensor": "",
        "unit": "",
        "indicators": [],
        "notes": [],
    }
    return Shown(facts=facts, arrays=average_panels(tsa, teeth))


def _shown(diagnosis: "Diagnosis") -> Shown:
    facts: dict[str, Any] = {
        "answer": diagnosis.answer,
        "kind": diagnosis.kind,
        "diagnosis": diagnosis.as_json(),
        "notes": [note.text for note in (*diagnosis.notes, *diagnosis.missing, *diagnosis.reading)],
        "assumed": list(diagnosis.assumed),
        "damaged": list(diagnosis.candidates),
    }
    signature = diagnosis.signature
    if signature is None:
        return Shown(facts=facts | {"teeth": None, "indicators": []}, arrays={})
    facts |= {
        "teeth": signature.teeth,
        "sensor": signature.channel,
        "unit": signature.unit,
        "speed_rpm": signature.speed_rpm,
        "absolute": signature.absolute,
        "indicators": [
            {
                "name": name,
                "help": INDICATORS[name].help,
                "unit": INDICATORS[name].unit.replace("signal", signature.unit),
                "value": float(value),
                "healthy": None,
            }
            for name, value in signature.indicators.items()
        ],
    }
    return Shown(facts=facts, arrays=average_panels(signature.tsa, signature.teeth, diagnosis.reference))
