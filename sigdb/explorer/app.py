"""The server of the page: on the loopback interface only, with a token, and nothing loaded from elsewhere.

The page itself holds no data and needs no token. Every other route needs the token of this run in the header
``X-Sigdb-Token``. The address of the page never holds the token after its first load.

Packages that a page does not need at first are imported where they are used, so that the server starts soon.
"""

import io
import json
import struct
from collections.abc import Awaitable, Callable
from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import BaseRoute, Route

from sigdb.core import FloatArray, InputError, SigdbError, __version__, plain
from sigdb.explorer.code import command_code, python_code, recipe_code, recipe_cost
from sigdb.explorer.controls import Control, controls_of, first_view
from sigdb.explorer.guard import Guard
from sigdb.explorer.live import LiveRig, Shown
from sigdb.explorer.recordings import MOST_BYTES, Recordings, average_in, shown_average
from sigdb.explorer.static_page import page_text, script_hashes
from sigdb.explorer.view import View, settings_in

if TYPE_CHECKING:
    from sigdb.database import Database
    from sigdb.explorer.stored import StoredRows

_MOST_JSON = 4 * 2**20
"""Bytes of a request that is no recording."""
_MOST_CASES = 6
"""Cases side by side in a picture."""


class Explorer:
    """The rig, the database and the recordings that the routes of a page share.

    Parameters
    ----------
    live : LiveRig
        The rig.
    source : str
        Name or file of the rig.
    database : Database, optional
        The database.
    row : int, optional
        The row that the page shows first.
    recordings : Recordings
        Recordings of the page.
    offered : dict, optional
        Names of recordings that the command line gave, by their keys.
    """

    def __init__(
        self,
        live: LiveRig,
        source: str,
        *,
        database: "Database | None" = None,
        row: int | None = None,
        recordings: Recordings | None = None,
        offered: dict[str, str] | None = None,
    ) -> None:
        self.live, self.source, self.row = live, source, row
        self.stored = None if database is None else _stored_rows(database)
        self.recordings = recordings or Recordings()
        self._offered = offered or {}

    def start(self, wanted: dict[str, Any]) -> Shown:
        """Return what the page needs at first, and the picture of the view of its ``address``.

        A view that cannot be shown has no picture here: the page asks for it, and shows what is wrong.
        """
        try:
            settings = settings_in(wanted.get("address", {})) or first_view(self._controls)
            shown = self.live_view(settings)
        except SigdbError:
            return Shown(facts={"start": self._start}, arrays={})
        return Shown(facts={"start": self._start, "shown": shown.facts}, arrays=shown.arrays)

    @cached_property
    def _controls(self) -> list[Control]:
        return controls_of(self.live)

    @cached_property
    def _start(self) -> dict[str, Any]:
        """Rig, controls, sensors, database and recordings."""
        rig, live = self.live.rig, self.live
        return {
            "version": __version__,
            "rig": {"name": rig.name, "source": self.source, "gear": live.gear, "teeth": live.teeth},
            "sensors": [{"name": name, "unit": sensor.unit} for name, sensor in rig.sensors.items()],
            "controls": [asdict(control) for control in self._controls],
            "database": None if self.stored is None else self.stored.facts(),
            "row": self.row,
            "offered": self._offered,
        }

    def live_view(self, settings: dict[str, Any]) -> Shown:
        """Return the picture of a view."""
        return self.live.show(View.of(settings))

    def stability(self, settings: dict[str, Any]) -> dict[str, Any]:
        """Return the largest Floquet multiplier of a view, and whether the rig is stable."""
        multiplier = self.live.floquet_multiplier(View.of(settings))
        return {"multiplier": multiplier, "stable": multiplier < 1}

    def code(self, settings: dict[str, Any]) -> dict[str, str]:
        """Return a view as Python, recipe and command."""
        view = View.of(settings)
        return {
            "python": python_code(self.live, view, self.source),
            "recipe": recipe_code(self.live, view, self.source),
            "command": command_code(settings, self.source),
        }

    def recipe(self, wanted: dict[str, Any]) -> dict[str, Any]:
        """Return a recipe of ranges with its size."""
        text = recipe_code(self.live, View.of(wanted.get("view", {})), self.source, _table(wanted, "ranges"))
        return {"recipe": text} | recipe_cost(text, Path.cwd())

    def table(self, wanted: dict[str, Any]) -> dict[str, Any]:
        """Return the result of a SQL statement."""
        return self._stored().table(_text(wanted, "sql"))

    def stored_row(self, wanted: dict[str, Any]) -> Shown:
        """Return the picture of a row."""
        return self._stored().row(_whole(wanted, "id"), wanted.get("sensor"))

    def map(self, wanted: dict[str, Any]) -> dict[str, Any]:
        """Return an indicator over two axes."""
        x, value = (_text(wanted, name) for name in ("x", "value"))
        y, where = (_text(wanted, name) if wanted.get(name) else None for name in ("y", "where"))
        return self._stored().map(x, y, value, where)

    def nearest(self, wanted: dict[str, Any]) -> dict[str, Any]:
        """Return the nearest templates of a row, of a view or of numbers."""
        stored, sensor = self._stored(), wanted.get("sensor")
        tsa = self._case_of(wanted).arrays["tsa"]
        return stored.nearest(tsa, sensor if sensor in stored.database.sensors else None)

    def diagnosis(self, wanted: dict[str, Any]) -> Shown:
        """Return the diagnosis of a recording, or a dropped average."""
        key = _text(wanted, "recording")
        teeth = wanted.get("teeth")
        tsa = average_in(self.recordings.path(key), self.live.teeth)
        if tsa is not None:
            return shown_average(tsa, self.live.teeth)
        rig = self.live.rig
        healthy = wanted.get("healthy", [])
        if not isinstance(healthy, list) or not all(isinstance(each, str) for each in healthy):
            raise InputError(f"healthy = {healthy!r}: give a list of recordings")
        shown, _ = self.recordings.diagnose(key, healthy, rig, teeth, _table(wanted, "options"))
        return shown

    def picture(self, wanted: dict[str, Any]) -> tuple[bytes, str]:
        """Return the picture of a row, a view or numbers as a file of a format, and its media type."""
        from sigdb.report import Case, comparison_figure

        form = wanted.get("format")
        if form not in ("png", "svg"):
            raise InputError(f"format = {form!r} is not png or svg")
        cases = [self._case_of(each) for each in self._wanted(wanted)]
        stiffness = all("stiffness" in shown.arrays for shown in cases)
        figure = comparison_figure(
            [
                Case(
                    title=f"row {shown.facts['id']}" if "id" in shown.facts else "",
                    teeth=shown.facts["teeth"],
                    tsa=shown.arrays["tsa"],
                    damaged=tuple(shown.facts["damaged"]),
                    healthy=shown.arrays.get("tsa_healthy"),
                    stiffness=shown.arrays.get("stiffness"),
                    healthy_stiffness=shown.arrays.get("stiffness_healthy"),
                )
                for shown in cases
            ],
            sensor=cases[0].facts["sensor"],
            unit=cases[0].facts["unit"],
            panels=(*(("stiffness",) if stiffness else ()), "signal", "spectrum", "distribution"),
            title=str(wanted.get("title", self.source)),
        )
        file = io.BytesIO()
        figure.savefig(file, format=form, dpi=110)
        return file.getvalue(), {"png": "image/png", "svg": "image/svg+xml"}[form]

    def drawing(self) -> bytes:
        """Return the drawing of the rig as SVG."""
        from sigdb.report import rig_figure

        file = io.BytesIO()
        rig_figure(self.live.rig).savefig(file, format="svg")
        return file.getvalue()

    def _stored(self) -> "StoredRows":
        if self.stored is None:
            raise InputError("no database is open; give one to sigdb explore")
        return self.stored

    def _wanted(self, wanted: dict[str, Any]) -> list[dict[str, Any]]:
        """Return one request for each row of a list of ``ids``, or the request itself."""
        ids = wanted.get("ids")
        if ids is None:
            return [wanted]
        if not isinstance(ids, list) or not 1 <= len(ids) <= _MOST_CASES:
            raise InputError(f"ids = {ids!r}: give a list of 1 to {_MOST_CASES} rows")
        return [{"id": each, "sensor": wanted.get("sensor")} for each in ids]

    def _case_of(self, wanted: dict[str, Any]) -> Shown:
        """Return the picture of a row, of numbers, or of a view."""
        if "id" in wanted:
            return self.stored_row(wanted)
        if "tsa" not in wanted:
            return self.live_view(wanted.get("view", {}))
        facts = {"sensor": str(wanted.get("sensor", "")), "unit": str(wanted.get("unit", ""))}
        tsa, teeth = _numbers(wanted, "tsa"), _whole(wanted, "teeth")
        if not 1 <= teeth <= len(tsa) // 4:
            raise InputError(f"tsa has {len(tsa)} numbers, which are no revolution of {teeth} teeth")
        shown = shown_average(tsa, teeth)
        healthy = {"tsa_healthy": _numbers(wanted, "healthy")} if "healthy" in wanted else {}
        return Shown(facts=shown.facts | facts, arrays=shown.arrays | healthy)


def explorer_app(explorer: Explorer, *, token: str, hosts: tuple[str, ...]) -> Starlette:
    """Return the web application of a page.

    Parameters
    ----------
    explorer : Explorer
        The rig, the database and the recordings of the page.
    token : str
        The token of this run.
    hosts : tuple of str
        Hosts with port by which it may be reached, such as ``127.0.0.1:8765``.

    Returns
    -------
    starlette.applications.Starlette
    """
    page = page_text()
    post = {
        "start": explorer.start,
        "live": explorer.live_view,
        "stability": explorer.stability,
        "code": explorer.code,
        "recipe": explorer.recipe,
        "table": explorer.table,
        "row": explorer.stored_row,
        "map": explorer.map,
        "nearest": explorer.nearest,
        "diagnosis": explorer.diagnosis,
        "picture": explorer.picture,
    }
    routes: list[BaseRoute] = [Route(f"/api/{name}", _answer(work), methods=["POST"]) for name, work in post.items()]
    routes += [
        Route("/api/upload", _upload(explorer.recordings), methods=["POST"]),
        Route("/api/drawing", _drawing(explorer), methods=["POST"]),
        Route("/", _page(page)),
    ]
    guard = Middleware(Guard, hosts=hosts, token=token, scripts=script_hashes(page))
    return Starlette(routes=routes, middleware=[guard])


def packed(shown: Shown) -> bytes:
    """Return a picture as bytes: length of the header (uint32), header (JSON), and float32 arrays, little-endian.

    The header holds the facts and ``arrays``: name, shape and first number of each array. It is filled with spaces
    to a multiple of four bytes.
    """
    listed, first = [], 0
    for name, array in shown.arrays.items():
        listed.append([name, list(np.shape(array)), first])
        first += int(np.size(array))
    facts = shown.facts | {"arrays": listed}
    try:
        header = json.dumps(facts, allow_nan=False).encode()
    except (TypeError, ValueError):  # a number of numpy or one that is not finite
        header = json.dumps(plain(facts), allow_nan=False).encode()
    header += b" " * (-len(header) % 4)
    data = b"".join(np.ascontiguousarray(array, dtype="<f4").tobytes() for array in shown.arrays.values())
    return struct.pack("<I", len(header)) + header + data


Endpoint = Callable[[Request], Awaitable[Response]]


def _answer(work: Callable[[dict[str, Any]], Any]) -> Endpoint:
    async def endpoint(request: Request) -> Response:
        try:
            wanted = json.loads(await _body(request, _MOST_JSON) or b"{}")
            if not isinstance(wanted, dict):
                raise InputError("a request is one JSON object")
            result = await run_in_threadpool(work, wanted)
        except SigdbError as error:
            return JSONResponse({"error": str(error)}, status_code=422)
        except (json.JSONDecodeError, UnicodeDecodeError) as error:
            return JSONResponse({"error": f"a request is one JSON object: {error}"}, status_code=400)
        if isinstance(result, Shown):
            return Response(packed(result), media_type="application/octet-stream")
        if isinstance(result, tuple):
            return Response(result[0], media_type=result[1])
        return JSONResponse(result)

    return endpoint


def _page(text: str) -> Endpoint:
    async def endpoint(_: Request) -> Response:
        return HTMLResponse(text)

    return endpoint


def _upload(recordings: Recordings) -> Endpoint:
    async def endpoint(request: Request) -> Response:
        name = request.query_params.get("name", "recording")
        try:
            key = recordings.add(name, await _body(request, MOST_BYTES))
        except SigdbError as error:
            return JSONResponse({"error": str(error)}, status_code=422)
        return JSONResponse({"recording": key, "name": name})

    return endpoint


def _drawing(explorer: Explorer) -> Endpoint:
    async def endpoint(request: Request) -> Response:
        return Response(await run_in_threadpool(explorer.drawing), media_type="image/svg+xml")

    return endpoint


async def _body(request: Request, most: int) -> bytes:
    """Return the body of a request.

    Raises
    ------
    InputError
        If it has too many bytes.
    """
    content = bytearray()
    async for chunk in request.stream():
        content += chunk
        if len(content) > most:
            raise InputError(f"more than {most / 2**20:.0f} MiB are not taken; give sigdb explore --recording the file")
    return bytes(content)


def _stored_rows(database: "Database") -> "StoredRows":
    from sigdb.explorer.stored import StoredRows

    return StoredRows(database)


def _text(wanted: dict[str, Any], name: str) -> str:
    if not isinstance(wanted.get(name), str):
        raise InputError(f"{name} = {wanted.get(name)!r} is no text")
    return str(wanted[name])


def _table(wanted: dict[str, Any], name: str) -> dict[str, Any]:
    value = wanted.get(name, {})
    if not isinstance(value, dict):
        raise InputError(f"{name} = {value!r} is no table of values by name")
    return value


def _whole(wanted: dict[str, Any], name: str) -> int:
    value = wanted.get(name)
    if not isinstance(value, int) or isinstance(value, bool):
        raise InputError(f"{name} = {value!r} is no whole number")
    return value


def _numbers(wanted: dict[str, Any], name: str) -> FloatArray:
    try:
        x = np.asarray(wanted[name], dtype=float)
    except (TypeError, ValueError):
        x = np.empty(0)
    if x.ndim != 1 or not x.size or not np.isfinite(x).all():
        raise InputError(f"{name} is no list of finite numbers")
    return x
