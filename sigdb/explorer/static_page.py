"""The page as one text: for the server, or as a file without one, in which a grid of simulated cases answers."""

import base64
import hashlib
import json
import re
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from sigdb.core import FloatArray, InputError, __version__, plain, publish
from sigdb.explorer.controls import Control, controls_of
from sigdb.explorer.live import LiveRig
from sigdb.explorer.view import View
from sigdb.transmission import Transmission

STATIC = Path(__file__).parent / "static"
_MODULES = (
    "api.js", "address.js", "plots.js", "controls.js", "database.js", "measurement.js", "recipe.js", "main.js",
)  # fmt: skip
"""Modules in an order in which each uses only those before it."""
_LOSSES = tuple(np.round(np.arange(0, 0.91, 0.1), 3).tolist())
_SHIFTS = 5
"""Phase shifts of the grid, from none to half a tooth pass late."""
_SATURATION = 0.2
"""Share of the greatest magnitude of a distribution at which its colours saturate, here and on the page."""


def write_static(rig: Transmission, source: str, path: Path, *, gear: str | None = None) -> None:
    """Write a page without a server into one file.

    Parameters
    ----------
    rig : Transmission
        The rig; damage at one tooth must be that at another, turned.
    source : str
        Name or file of the rig.
    path : pathlib.Path
        The file.
    gear : str, optional
        The damaged gear; the driving gear of the first mesh if left out.

    Raises
    ------
    InputError
        If the rig does not turn exactly, so that each tooth would need its own cases.
    """
    live = LiveRig(rig, gear)
    if not rig.turns_exactly(live.gear):
        raise InputError(
            f"rig {rig.name!r}: damage at another tooth of {live.gear!r} is not the same damage turned, so one file "
            "cannot hold all cases; open the page with sigdb explore"
        )
    shifts = np.round(np.linspace(0, 180 / live.teeth, _SHIFTS), 3).tolist()
    cases = [_case(live, sensor, loss, shift) for sensor in rig.sensors for shift in shifts for loss in _LOSSES]
    data = {"start": _start(live, source, shifts), "cases": cases, "facts": {"teeth": live.teeth}}
    cases_text = json.dumps(plain(data), allow_nan=False).replace("</", "<\\/")
    server = (STATIC / "static.js").read_text(encoding="utf-8")
    text = page_text(f"window.sigdbCases = {cases_text};\n{{\n{server}}}")
    publish(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def _case(live: LiveRig, sensor: str, loss: float, shift: float) -> dict[str, Any]:
    shown = live.show(View.of({"tooth": 1, "stiffness_loss": loss, "phase_shift_deg": shift, "sensor": sensor}))
    kept = ("tsa", "stiffness", "spectrum", "orders", "wigner_ville")
    return {
        "sensor": sensor,
        "unit": shown.facts["unit"],
        "stiffness_loss": loss,
        "phase_shift_deg": shift,
        "least_force": shown.facts["least_force"],
        "least_compression": shown.facts["least_compression"],
        "indicators": shown.facts["indicators"],
        "arrays": {name: _quantised(shown.arrays[name], 8 if name == "wigner_ville" else 16) for name in kept},
    }


def _quantised(array: FloatArray, bits: int) -> dict[str, Any]:
    """Return an array as whole numbers of 8 or 16 bits; one of 8 bits saturates as its colours do."""
    highest, most = float(np.abs(array).max()) or 1.0, 2 ** (bits - 1) - 1
    scale = highest * (_SATURATION if bits == 8 else 1) / most
    whole = np.clip(np.round(array / scale), -most, most).astype("<i1" if bits == 8 else "<i2")
    return {
        "shape": list(array.shape), "scale": scale, "bits": bits, "data": base64.b64encode(whole.tobytes()).decode(),
    }  # fmt: skip


def _start(live: LiveRig, source: str, shifts: list[float]) -> dict[str, Any]:
    ranges = {"tooth": (0.0, float(live.teeth), 1.0), "stiffness_loss": (0.0, 0.9, 0.1),
              "phase_shift_deg": (0.0, shifts[-1], shifts[1])}  # fmt: skip
    controls: list[Control] = [
        replace(each, low=ranges[each.name][0], high=ranges[each.name][1], step=ranges[each.name][2])
        for each in controls_of(live)
        if each.name in ranges
    ]
    return {
        "version": __version__,
        "rig": {"name": live.rig.name, "source": source, "gear": live.gear, "teeth": live.teeth},
        "sensors": [{"name": name, "unit": sensor.unit} for name, sensor in live.rig.sensors.items()],
        "controls": [asdict(control) for control in controls],
        "database": None,
        "row": None,
        "offered": {},
    }


def page_text(first: str = "") -> str:
    """Return the page with its styles and scripts inlined.

    Parameters
    ----------
    first : str
        A script that runs before those of the page.

    Returns
    -------
    str
    """
    vendor = STATIC / "vendor"
    styles = "\n".join(file.read_text(encoding="utf-8") for file in (vendor / "uPlot.min.css", STATIC / "style.css"))
    modules = "\n".join(_joinable((STATIC / name).read_text(encoding="utf-8")) for name in _MODULES)
    # The page asks the server before the browser runs the library of plots, which takes some time.
    plots = (vendor / "uPlot.iife.min.js").read_text(encoding="utf-8")
    head = f"<style>{styles}</style>\n"
    if first:
        head += f"<script>{first}</script>\n"
    head += f'<script type="module">\n{modules}\n{plots}</script>\n'
    return (STATIC / "index.html").read_text(encoding="utf-8").replace("</head>", head + "</head>")


def script_hashes(page: str) -> str:
    """Return the hashes of the scripts of a page as a content security policy has them.

    Examples
    --------
    >>> script_hashes("<script>alert(1)</script>")
    "'sha256-bhHHL3z2vDgxUt0W3dWQOrprscmda2Y5pLsLg4GF+pI='"
    """
    scripts = re.findall(r"<script[^>]*>(.*?)</script>", page, flags=re.DOTALL)
    digests = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts]
    return " ".join(f"'sha256-{digest}'" for digest in digests)


def _joinable(module: str) -> str:
    """Return a module without its imports and exports; the names of all modules differ."""
    module = re.sub(r"^import .*?;\n", "", module, flags=re.MULTILINE)
    return re.sub(r"^export ", "", module, flags=re.MULTILINE)
