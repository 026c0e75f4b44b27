"""Who may open the page of `play --web`."""

import http.client
import socket

import pytest
import viser
import viser._messages
import viser._viser
from walker_sim.web import server as web

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")


@pytest.fixture
def serve():
    servers = []

    def start(*arguments):
        server, address = web.serve("a walker", *arguments)
        servers.append(server)
        return server.get_port(), address

    yield start
    for server in servers:
        server.stop()


def get(port, path="/", **headers):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    connection.request("GET", path, headers=headers)
    response = connection.getresponse()
    text = "" if response.status == 101 else response.read().decode(errors="replace")
    connection.close()
    return response.status, text, response.headers


def joins(port, path="/", **headers):
    """Whether a websocket is opened."""
    wish = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13"}
    status, _, _ = get(
        port, path, **wish, **{"Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA=="}, **headers
    )
    assert status in (101, 403)
    return status == 101


def token_of(address):
    return address.split("?token=")[1]


def test_only_a_request_with_the_token_is_answered(serve):
    port, address = serve()
    assert address.startswith(f"http://127.0.0.1:{port}/?token=")
    for path in ("/", "/?token=", "/?token=wrong", "/?token=%C3%A9", "/?token=wrong&token="):
        status, text, _ = get(port, path)
        assert (status, text) == (
            403,
            "token: missing or wrong; the server printed the page's address\n",
        )
    assert not joins(port)
    status, text, headers = get(port, f"/?token={token_of(address)}")
    assert status == 200 and "<html" in text
    cookie = headers["Set-Cookie"]
    assert "HttpOnly" in cookie and "SameSite=Strict" in cookie
    assert headers["Content-Security-Policy"] == "frame-ancestors 'none'"
    kept = cookie.split(";")[0]
    for cookies in (kept, f"a@b=1; p={{}}; {kept}", f"x[y]=1;{kept}"):  # others of this host
        assert joins(port, Cookie=cookies)
        assert get(port, Cookie=cookies)[0] == 200
    assert not joins(port, Cookie=f"{kept}0")


def test_a_page_of_another_origin_is_refused(serve):
    port, address = serve()
    path = f"/?token={token_of(address)}"
    assert joins(port, path, Origin=f"http://127.0.0.1:{port}")
    assert joins(port, path, Origin="http://localhost:8080", Host="localhost:8080")  # a tunnel
    assert not joins(port, path, Origin="http://example.org")
    status, text, _ = get(port, path, Origin="http://example.org")
    assert (status, text) == (403, "origin http://example.org: must be the page's own\n")


@pytest.mark.parametrize("parameter", ["websocket=ws://example.org", "playbackPath=x", "a"])
def test_the_page_takes_its_contents_from_nowhere_else(serve, parameter):
    port, address = serve()
    status, text, _ = get(port, f"/?token={token_of(address)}&{parameter}")
    assert (status, text) == (403, "query: must be the token alone\n")


def test_two_servers_have_different_tokens_and_cookies(serve):
    addresses = [serve()[1] for _ in range(2)]
    assert len({token_of(address) for address in addresses}) == 2
    ports = [int(address.split(":")[2].split("/")[0]) for address in addresses]
    names = {
        get(port, f"/?token={token_of(address)}")[2]["Set-Cookie"].split("=")[0]
        for port, address in zip(ports, addresses)
    }
    assert len(names) == 2


def test_an_address_for_all_is_printed_as_the_machines_name(serve):
    port, address = serve("0.0.0.0")
    assert address.startswith(f"http://{socket.gethostname()}:{port}/?token=")


def test_error_names_a_port_in_use_and_an_unknown_address():
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(web.CannotServe, match=f"127.0.0.1, port {port}: cannot listen: "):
            web.serve("a walker", web.LOOPBACK, port)
    for port in (-1, 65536, "8080"):
        with pytest.raises(web.CannotServe, match=f"port = {port}: must be a whole number from 0"):
            web.serve("a walker", web.LOOPBACK, port)
    with pytest.raises(web.CannotServe, match=r"no\.such\.host\.invalid: cannot listen: "):
        web.serve("a walker", "no.such.host.invalid")


def test_a_server_that_would_not_ask_for_the_token_is_ended(monkeypatch):
    class Careless:
        def __init__(self, *arguments, **keywords):
            self.stopped = False
            made.append(self)

        def stop(self):
            self.stopped = True

    made = []
    monkeypatch.setattr(viser, "ViserServer", Careless)
    with pytest.raises(web.CannotServe, match=f"viser {viser.__version__}: not supported"):
        web.serve("a walker")
    assert made[0].stopped


def test_a_browser_cannot_make_the_page_public(serve, monkeypatch):
    tunnels = []
    monkeypatch.setattr(viser._viser, "ViserTunnel", lambda *given: tunnels.append(given))
    server, _ = web.serve("a walker")
    asked = viser._messages.ShareUrlRequest
    for handler in server._websock_server._incoming_handlers[asked]:
        handler(0, asked())
    server._thread_executor.shutdown()
    server.stop()
    assert tunnels == []
