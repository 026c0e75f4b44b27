"""Who may open the page of `play --web`."""

import http.client
import socket

import pytest
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


@pytest.mark.parametrize("name", ["localhost", "127.0.0.1", "[::1]"])
def test_a_tunnel_may_call_this_machine_by_each_of_its_names(serve, name):
    port, _ = serve()
    assert get(port, Host=f"{name}:8080")[0] == 200
    assert joins(port, Host=f"{name}:8080", Origin=f"http://{name}:8080")


def test_a_name_that_leads_to_this_machine_is_refused(serve):
    port, _ = serve()
    status, text, _ = get(port, Host="example.org:8080")
    assert (status, text) == (403, "host example.org: must be this machine's own address\n")
    assert not joins(port, Host="example.org", Origin="http://example.org")


def test_other_machines_need_the_token(serve):
    port, address = serve("0.0.0.0")
    assert address.startswith(f"http://{socket.gethostname()}:{port}/?token=")
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
