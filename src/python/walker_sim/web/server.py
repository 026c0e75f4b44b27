"""The page's server: who may open the page."""

from __future__ import annotations

import contextlib
import functools
import importlib
import io
import logging
import os
import secrets
import socket
from typing import Any, Callable
from urllib.parse import parse_qs, urlsplit

PORT = 8080
MAX_PORT = 65535
LOOPBACK = "127.0.0.1"


class CannotServe(Exception):
    """The page cannot be served. The message says why, and what to do."""


def serve(label: str, host: str = LOOPBACK, port: int | None = None) -> tuple[Any, str]:
    """Starts a server in threads of its own.

    Parameters
    ----------
    label
        Title of the page.
    host
        Address to listen on.
    port
        Port to listen on; None: the first free one from `PORT` on.

    Returns
    -------
    The `viser.ViserServer`, and the page's address with its token. Opening it stores the token in
    the browser as a cookie; a request without the token is refused, also on this machine, which
    other users and other sites in the browser reach too.

    Raises
    ------
    CannotServe
        Without viser, or if the address cannot be listened on.
    """
    try:
        viser: Any = importlib.import_module("viser")
        websockets: Any = importlib.import_module("websockets.asyncio.server")
    except ImportError as error:
        raise CannotServe(f'a page needs viser: pip install "walker_sim[web]" ({error})') from error
    # Browsers open connections that they do not use, which it would report as errors.
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    _check_free(host, port)
    os.environ.pop("_VISER_PORT_OVERRIDE", None)
    guard = Guard(secrets.token_urlsafe())
    # viser has no place for a check of its own, so its server gets one when it is made.
    original = websockets.serve

    def guarded(*arguments: Any, process_request: Any, **keywords: Any) -> Any:
        guard.is_used = True
        check = functools.partial(guard.answer, process_request)
        return original(*arguments, process_request=check, **keywords)

    websockets.serve = guarded
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # viser's address lacks the token
            server = viser.ViserServer(
                host, PORT if port is None else port, label=label, verbose=False
            )
    finally:
        websockets.serve = original
    if not guard.is_used:
        server.stop()
        raise CannotServe(f"viser {viser.__version__}: not supported")
    guard.cookie += f"_{server.get_port()}"
    server.request_share_url = lambda verbose=True: None  # a browser cannot make the page public
    if host in ("0.0.0.0", "::"):  # every address of this machine: browsers know it by its name
        host = socket.gethostname()
    shown = f"[{host}]" if ":" in host else host
    return server, f"http://{shown}:{server.get_port()}/?token={guard.token}"


class Guard:
    """Answers only requests with the token, by a cookie or in the page's address."""

    def __init__(self, token: str) -> None:
        self.token = token
        self.cookie = "walker_sim"  # its name; cookies are a host's, not a port's
        self.is_used = False

    def answer(self, serve_file: Callable[..., Any], connection: Any, request: Any) -> Any:
        """Answers a request: None if it becomes a websocket, else a response.

        Other parameters than the token are refused: by them viser's page would take its contents,
        scripts included, from another server.
        """
        headers = request.headers
        query = parse_qs(urlsplit(request.path).query, keep_blank_values=True)
        cookies = [part.strip().partition("=") for part in headers.get("Cookie", "").split(";")]
        given = query.pop("token", [])
        kept = [value for name, _, value in cookies if name == self.cookie]
        if not any(self._is_token(text) for text in (*given, *kept)):
            text = "token: missing or wrong; the server printed the page's address\n"
            return connection.respond(403, text)
        origin = headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc != headers.get("Host"):
            return connection.respond(403, f"origin {origin}: must be the page's own\n")
        if query:
            return connection.respond(403, "query: must be the token alone\n")
        response = serve_file(connection, request)
        if response is not None:
            response.headers["Content-Security-Policy"] = "frame-ancestors 'none'"
            cookie = f"{self.cookie}={self.token}; HttpOnly; SameSite=Strict"
            response.headers["Set-Cookie"] = cookie
        return response

    def _is_token(self, text: str) -> bool:
        return secrets.compare_digest(text.encode(), self.token.encode())


def _check_free(host: str, port: int | None) -> None:
    """viser would take the next free port instead, and retry without end at a wrong address."""
    if port is not None and not (isinstance(port, int) and 0 <= port <= MAX_PORT):
        raise CannotServe(f"port = {port}: must be a whole number from 0 to {MAX_PORT}")
    try:
        for family, kind, _, _, address in socket.getaddrinfo(
            host, port or 0, type=socket.SOCK_STREAM
        ):
            with socket.socket(family, kind) as probe:
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                probe.bind(address)
    except OSError as error:
        where = host if port is None else f"{host}, port {port}"
        raise CannotServe(f"{where}: cannot listen: {error.strerror or error}") from error
