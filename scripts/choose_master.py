"""Chooses the ROS master for scripts/run, and a namespace in which no node name is taken.

A master has one node per name: a node that registers a taken name shuts down the other one. The
arguments are those of walker.launch. Prints the master's URI and, if one is needed, the namespace.
Messages for the user go to stderr.
"""

import http.client
import itertools
import os
import socket
import sys
import urllib.parse
import xml.etree.ElementTree
import xmlrpc.client

CALLER = "/scripts_run"
NODES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "launch", "nodes.launch")
DEFAULT = "http://localhost:11311"


def probe(uri):
    """Whether a ROS master answers at the URI; ValueError if none can be started there, either."""
    try:
        parts = urllib.parse.urlparse(uri)
        host, _ = parts.hostname, parts.port
        if parts.scheme != "http" or not host:
            raise ValueError
    except ValueError:
        raise ValueError(f"ROS_MASTER_URI = {uri}: must be http://HOST:PORT") from None
    try:
        code, _, _ = xmlrpc.client.ServerProxy(uri).getUri(CALLER)
    except ConnectionRefusedError:
        if host in {"localhost", "127.0.0.1", "::1", socket.gethostname()}:
            return False
        raise ValueError(
            f"no ROS master answers at {uri}, and none can be started there: it is another machine"
        ) from None
    except socket.gaierror:
        raise ValueError(f"ROS_MASTER_URI = {uri}: the name {host} is not known") from None
    except Exception as error:  # a program that is no master may answer anything
        raise ValueError(f"no ROS master answers at {uri} ({error})") from None
    if code != 1:
        raise ValueError(f"the program at {uri} is not a ROS master")
    return True


def choose_master(given):
    """Returns the master's URI and whether it runs; ValueError if the given URI is unusable."""
    uri = given or DEFAULT
    try:
        return uri, probe(uri)
    except ValueError as error:
        if given:
            raise
        with socket.socket() as any_port:
            any_port.bind(("localhost", 0))
            free = f"http://localhost:{any_port.getsockname()[1]}"
        say(f"{error}: starting one with ROS_MASTER_URI={free}")
        return free, False


def lives(master, node):
    """Whether a node runs. A killed one is still registered but refuses connections."""
    code, _, uri = master.lookupNode(CALLER, node)
    if code != 1:
        return False
    try:
        xmlrpc.client.ServerProxy(uri).getPid(CALLER)
    except ConnectionRefusedError:
        return False
    except (OSError, http.client.HTTPException, xmlrpc.client.Error):
        pass  # a hung node runs
    return True


def occupant(master, namespace, topic=None):
    """Returns a running node that a launch there would shut down, or that publishes the topic."""
    launched = xml.etree.ElementTree.parse(NODES).iter("node")
    names = [f"{namespace and '/' + namespace}/{node.get('name')}" for node in launched]
    names += dict(master.getSystemState(CALLER)[2][0]).get(topic, [])
    return next((name for name in dict.fromkeys(names) if lives(master, name)), None)


def choose_namespace(uri, arguments):
    """Returns a namespace, empty if none is needed; ValueError if the given one is taken."""
    master = xmlrpc.client.ServerProxy(uri)
    given = dict(argument.split(":=", 1) for argument in arguments)
    if "ns" in given:
        other = occupant(master, given["ns"].strip("/"))
        if other:
            raise ValueError(
                f"ns:={given['ns']}: {other} runs on the ROS master at {uri}; end it, or give "
                "another namespace, or none: then a free one is chosen"
            )
        return ""
    # /clock may have one publisher only: a walker in a namespace does not publish it by default.
    other = occupant(master, "", None if "publish_clock" in given else "/clock")
    if not other:
        return ""
    names = (f"walker_{number}" for number in itertools.count(2))
    free = next(name for name in names if not occupant(master, name))
    say(f"{other} runs there: this walker starts beside it, as /{free}/walker_sim (ns:={free})")
    return free


def say(text):
    print(text, file=sys.stderr)


def main():
    socket.setdefaulttimeout(5)
    try:
        uri, runs = choose_master(os.environ.get("ROS_MASTER_URI"))
        if runs:
            say(f"using the ROS master at {uri}")
        namespace = choose_namespace(uri, sys.argv[1:]) if runs else ""
    except ValueError as error:
        sys.exit(f"run: {error}")
    print(uri, namespace)


if __name__ == "__main__":
    main()
