"""Who may open the page of `play --web`."""

import http.client
import socket

import pytest
from walker_sim.web import server as web
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

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
    return response.status, response.read().decode(errors="replace"), response.headers


def joins(port, path="/", **headers):
    """Whether a websocket is opened."""
    try:
        connect(f"ws://127.0.0.1:{port}{path}", additional_headers=headers).close()
    except InvalidStatus as error:
        assert error.response.status_code == 403
        return False
    return True


def test_this_machine_needs_no_token(serve):
    port, address = serve()
    assert address == f"http://127.0.0.1:{port}/"
    assert get(port)[0] == 200
    assert joins(port)


def test_a_page_of_another_origin_is_refused(serve):
    port, _ = serve()
    assert not joins(port, Origin="http://example.org")
    assert joins(port, Origin=f"http://127.0.0.1:{port}")
    status, text, _ = get(port, Origin="http://example.org")
    assert (status, text) == (403, "origin http://example.org: must be the page's own\n")


def test_other_machines_need_the_token(serve):
    port, address = serve("0.0.0.0")
    assert address.startswith(f"http://0.0.0.0:{port}/?token=")
    for path in ("/", "/?token=", "/?token=wrong", "/?token=%C3%A9"):
        status, text, _ = get(port, path)
        assert (status, text) == (403, "token: missing or wrong; the server printed the address\n")
    assert not joins(port)
    status, _, headers = get(port, "/" + address.split("/")[-1])
    assert status == 200
    cookie = headers["Set-Cookie"]
    assert "HttpOnly" in cookie and "SameSite=Strict" in cookie
    assert joins(port, Cookie=cookie.split(";")[0])
    assert get(port, Cookie=cookie.split(";")[0])[0] == 200
    assert not joins(port, Cookie=f"{web.COOKIE}=wrong")


def test_two_servers_have_different_tokens(serve):
    assert len({serve("0.0.0.0")[1].split("=")[-1] for _ in range(2)}) == 2


def test_error_names_a_port_in_use_and_an_unknown_address():
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(web.CannotServe, match=f"127.0.0.1, port {port}: cannot be listened at"):
            web.serve("a walker", web.LOOPBACK, port)
    with pytest.raises(web.CannotServe, match=r"no\.such\.host\.invalid: cannot be"):
        web.serve("a walker", "no.such.host.invalid")


def test_a_browser_cannot_make_the_page_public(serve):
    server, _ = web.serve("a walker")
    assert server.request_share_url() is None
    server.stop()
