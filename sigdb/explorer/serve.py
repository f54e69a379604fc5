"""Open the explorer: a server on this machine for one person, and a page in the browser."""

import secrets
import socket
import threading
import webbrowser
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl

from sigdb.core import InputError, SigdbError
from sigdb.explorer.controls import controls_of, first_view
from sigdb.explorer.live import LiveRig
from sigdb.explorer.recordings import Recordings
from sigdb.explorer.view import View, settings_in
from sigdb.transmission import Transmission

if TYPE_CHECKING:
    from sigdb.database import Database

DEFAULT_RIG = "nasa-spiral-bevel-identified"
"""The rig that a page shows where none is given."""
_HOST = "127.0.0.1"


def serve_explorer(
    rig: Transmission,
    source: str,
    *,
    gear: str | None = None,
    database: "Database | None" = None,
    row: int | None = None,
    recordings: Sequence[Path] = (),
    view: str = "",
    port: int = 0,
    browser: bool = True,
    on_address: Callable[[str], Any] = print,
) -> None:
    """Serve the explorer until it is interrupted.

    Parameters
    ----------
    rig : Transmission
        The rig whose damage moves.
    source : str
        Name or file of the rig.
    gear : str, optional
        The damaged gear; the driving gear of the first mesh if left out.
    database : Database, optional
        The database of the page.
    row : int, optional
        The row that is shown first.
    recordings : sequence of pathlib.Path
        Recordings that the page offers.
    view : str
        Settings as they stand in the page's address, such as ``tooth=6&stiffness_loss=0.5``.
    port : int
        Port of the server; a free one if 0.
    browser : bool
        Whether the page is opened in the browser.
    on_address : callable
        Called with the address once the server is ready; it holds the token.

    Raises
    ------
    InputError
        If Starlette or uvicorn is not installed, the port is taken, or the rig cannot be simulated.
    """
    live = LiveRig(rig, gear)
    # The first picture is computed while the server starts.
    threading.Thread(target=_first_picture, args=(live, view), daemon=True).start()
    try:
        import uvicorn

        from sigdb.explorer.app import Explorer, explorer_app
    except ImportError as error:
        raise InputError(
            f"the explorer needs the package {error.name}; install it with: pip install starlette uvicorn"
        ) from None
    kept = Recordings()
    offered = {kept.give(path): path.name for path in recordings}
    listener = _listener(port)
    host = f"{_HOST}:{listener.getsockname()[1]}"
    token = secrets.token_urlsafe(24)
    explorer = Explorer(live, source, database=database, row=row, recordings=kept, offered=offered)
    app = explorer_app(explorer, token=token, hosts=(host, host.replace(_HOST, "localhost")))
    address = f"http://{host}/#token={token}" + (f"&{view}" if view else "")

    class Server(uvicorn.Server):
        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            on_address(address)
            if browser:
                webbrowser.open(address)

    try:
        Server(uvicorn.Config(app, log_level="warning", lifespan="off")).run([listener])
    finally:
        kept.close()


def _first_picture(live: LiveRig, view: str) -> None:
    """Compute what a page shows first, which loads all that pictures need; the page shows what is wrong with a view."""
    with suppress(SigdbError):
        live.show(View.of(settings_in(dict(parse_qsl(view))) or first_view(controls_of(live))))


def _listener(port: int) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((_HOST, port))
    except OSError as error:
        listener.close()
        raise InputError(f"port {port} cannot be used ({error.strerror}); give another, or none") from None
    return listener
