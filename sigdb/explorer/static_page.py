"""The page as one file that needs no server: a grid of simulated cases stands for the solver."""

import base64
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
_MODULES = ("api.js", "plots.js", "controls.js", "database.js", "measurement.js", "recipe.js", "main.js")
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
    text = _page(json.dumps(plain(data), allow_nan=False))
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


def _page(data: str) -> str:
    """Return the page with its styles, scripts and data inlined."""
    server = (STATIC / "static.js").read_text(encoding="utf-8")
    modules = "\n".join(_joinable((STATIC / name).read_text(encoding="utf-8")) for name in _MODULES)
    script = f"{{\n{server}}}\n{modules}"
    vendor = STATIC / "vendor"
    styles = "\n".join(file.read_text(encoding="utf-8") for file in (vendor / "uPlot.min.css", STATIC / "style.css"))
    plots = (vendor / "uPlot.iife.min.js").read_text(encoding="utf-8")
    escaped = data.replace("</", "<\\/")
    head = (
        f"<style>{styles}</style>\n<script>{plots}</script>\n"
        f"<script>window.sigdbCases = {escaped};</script>\n"
        f'<script type="module">\n{script}\n</script>\n'
    )
    page = (STATIC / "index.html").read_text(encoding="utf-8")
    page = re.sub(r"<link rel=\"stylesheet\"[^>]*>\n|<script [^>]*src=[^>]*></script>\n", "", page)
    return page.replace("</head>", head + "</head>")


def _joinable(module: str) -> str:
    """Return a module without its imports and exports; the names of all modules differ."""
    module = re.sub(r"^import .*?;\n", "", module, flags=re.MULTILINE)
    return re.sub(r"^export ", "", module, flags=re.MULTILINE)
