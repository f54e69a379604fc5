"""The guard of the server: requests of other pages and other programs are refused."""

import secrets
from typing import Any

from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Receive, Scope, Send

TOKEN_HEADER = "x-sigdb-token"
_POLICY = (
    "default-src 'self'; img-src 'self' blob: data:; style-src 'unsafe-inline'; frame-ancestors 'none'; script-src "
)


class Guard:
    """Refuse requests of other pages and other programs.

    Parameters
    ----------
    app : ASGI application
        The application that is guarded.
    hosts : tuple of str
        Values of the header ``Host`` that are taken.
    token : str
        The token of this run.
    scripts : str
        Hashes of the scripts that a page may run.
    """

    def __init__(self, app: ASGIApp, hosts: tuple[str, ...], token: str, scripts: str) -> None:
        self._app, self._hosts, self._token, self._policy = app, hosts, token, (_POLICY + scripts).encode()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it with 403."""
        if scope["type"] != "http":
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        origin = headers.get("origin")
        reason = None
        if headers.get("host") not in self._hosts:
            reason = "this address is not that of the explorer"
        elif origin is not None and origin not in {f"http://{host}" for host in self._hosts}:
            reason = "another page may not ask the explorer"
        elif scope["path"].startswith("/api/") and not secrets.compare_digest(
            headers.get(TOKEN_HEADER, "").encode(), self._token.encode()
        ):
            reason = "open the page by the address that sigdb explore prints"
        if reason is not None:
            await JSONResponse({"error": reason}, status_code=403)(scope, receive, send)
            return

        async def with_policy(message: Any) -> None:
            if message["type"] == "http.response.start":
                kept = [(b"content-security-policy", self._policy), (b"referrer-policy", b"no-referrer")]
                kept += [(b"x-content-type-options", b"nosniff"), (b"cache-control", b"no-store")]
                message = message | {"headers": [*message["headers"], *kept]}
            await send(message)

        await self._app(scope, receive, with_policy)
