"""The page's server: who may open the page."""

from __future__ import annotations

import contextlib
import functools
import http.cookies
import importlib
import io
import ipaddress
import logging
import secrets
import socket
from typing import Any, Callable
from urllib.parse import parse_qs, urlsplit

PORT = 8080
LOOPBACK = "127.0.0.1"
COOKIE = "walker_sim_token"


class CannotServe(Exception):
    """The page cannot be served. The message says why, and what to do."""


def serve(label: str, host: str = LOOPBACK, port: int | None = None) -> tuple[Any, str]:
    """Starts a server in threads of its own.

    Parameters
    ----------
    label
        Title of the page.
    host
        Address to listen at. At another one than this machine's own only browsers with the token
        are answered: the page's address sets it as a cookie.
    port
        Port to listen at; None: the first free one from `PORT` on.

    Returns
    -------
    The `viser.ViserServer`, and the page's address.

    Raises
    ------
    CannotServe
        Without viser, or if the address cannot be listened at.
    """
    try:
        viser: Any = importlib.import_module("viser")
        websockets: Any = importlib.import_module("websockets.asyncio.server")
    except ImportError as error:
        raise CannotServe(f'a page needs viser: pip install "walker_sim[web]" ({error})') from error
    # Browsers open connections that they do not use, which it would report as errors.
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    token = "" if is_loopback(host) else secrets.token_urlsafe()
    _check_free(host, port)

    # viser has no place for a check of its own, so its server gets one when it is made.
    original = websockets.serve

    def guarded(*arguments: Any, process_request: Any, **keywords: Any) -> Any:
        check = functools.partial(answer, process_request, token)
        return original(*arguments, process_request=check, **keywords)

    websockets.serve = guarded
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # viser's address lacks the token
            server = viser.ViserServer(
                host, PORT if port is None else port, label=label, verbose=False
            )
    finally:
        websockets.serve = original
    server.request_share_url = lambda verbose=True: None  # a browser cannot make the page public
    if host in ("0.0.0.0", "::"):  # every address of this machine: browsers know it by its name
        host = socket.gethostname()
    shown = f"[{host}]" if ":" in host else host
    address = f"http://{shown}:{server.get_port()}/"
    return server, f"{address}?token={token}" if token else address


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches the address."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def answer(serve_file: Callable[..., Any], token: str, connection: Any, request: Any) -> Any:
    """Answers a request: None if it becomes a websocket, else a response.

    A page of another origin in the same browser could open a websocket here. Browsers say so by
    `Origin`, and such a request is refused, as is one without the token.
    """
    headers = request.headers
    origin = headers.get("Origin")
    if origin is not None and urlsplit(origin).netloc != headers.get("Host"):
        return connection.respond(403, f"origin {origin}: must be the page's own\n")
    if not token:
        host = urlsplit("//" + headers.get("Host", "")).hostname or ""
        if not is_loopback(host):  # a site whose name leads here would be its page's own origin
            return connection.respond(403, f"host {host}: must be this machine's own address\n")
        return serve_file(connection, request)
    given = parse_qs(urlsplit(request.path).query).get("token", [""])[0]
    cookies = http.cookies.SimpleCookie(headers.get("Cookie", ""))
    kept = cookies[COOKIE].value if COOKIE in cookies else ""
    if not any(secrets.compare_digest(each.encode(), token.encode()) for each in (given, kept)):
        return connection.respond(403, "token: missing or wrong; the server printed the address\n")
    response = serve_file(connection, request)
    if response is not None and given:
        response.headers["Set-Cookie"] = f"{COOKIE}={token}; HttpOnly; SameSite=Strict"
    return response


def _check_free(host: str, port: int | None) -> None:
    """viser would take the next free port instead, and retry for ever at a wrong address."""
    try:
        family = socket.getaddrinfo(host, port)[0][0]
        with socket.socket(family) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port or 0))
    except OSError as error:
        where = host if port is None else f"{host}, port {port}"
        raise CannotServe(f"{where}: cannot be listened at: {error.strerror or error}") from error
