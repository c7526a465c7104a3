"""Requests that the page refuses: other hosts, other origins, and those without the token.

Everything but the page's own files needs the token of the URL. The content security policy (W3C,
Level 3) forbids everything that does not come from this server.
"""

from __future__ import annotations

import secrets
from urllib.parse import parse_qsl, urlsplit

from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {
    "content-security-policy": _POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-store",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
}
_HOSTS = {"127.0.0.1", "localhost", "[::1]"}


class Guard:
    """Refuses foreign hosts, foreign origins and missing tokens, and sets the headers."""

    def __init__(self, app: ASGIApp, token: str) -> None:
        self.app = app
        self.token = token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it with 403."""
        if scope["type"] not in {"http", "websocket"}:
            await self.app(scope, receive, send)
            return
        refusal = self._refusal(scope)
        if refusal and scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008, "reason": refusal})
            return

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                present = list(message.get("headers", []))
                present += [(k.encode(), v.encode()) for k, v in _HEADERS.items()]
                message = {**message, "headers": present}
            await send(message)

        if refusal:
            await PlainTextResponse(refusal, 403)(scope, receive, with_headers)
            return
        await self.app(scope, receive, with_headers)

    def _refusal(self, scope: Scope) -> str:
        headers = {
            key.decode("latin-1"): value.decode("latin-1") for key, value in scope["headers"]
        }
        host = headers.get("host", "")
        if _without_port(host) not in _HOSTS:
            return "this page answers on the loopback address only"
        origin = headers.get("origin")
        if origin is not None and urlsplit(origin).netloc != host:
            return "the request comes from another page"
        if not scope["path"].startswith(("/api/", "/live")):
            return ""
        query = dict(parse_qsl(scope.get("query_string", b"").decode("latin-1")))
        given = headers.get("x-winchkit-token") or query.get("token") or ""
        if not secrets.compare_digest(given.encode(), self.token.encode()):
            return "the token is missing or wrong; open the URL that 'winchkit serve' printed"
        return ""


def _without_port(host: str) -> str:
    return host.rpartition(":")[0] if host.rpartition(":")[2].isdigit() else host
