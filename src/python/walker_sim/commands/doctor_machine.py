"""What `doctor` examines outside this package: the machine, ROS and its master, limits."""

from __future__ import annotations

import contextlib
import ctypes
import http.client
import importlib.util
import ipaddress
import os
import platform
import re
import resource
import socket
import sys
import urllib.parse
from pathlib import Path
from typing import Iterator, NamedTuple

OK, NOTE, FAULT = "ok", "note", "FAULT"
PATIENCE = 0.6  # for each connection to a master and each of its answers [s]
MIN_STACK, MIN_FILES = 128 * 1024, 256  # [bytes], open files of a process
DEFAULT_MASTER = "http://localhost:11311"
ALONE = f"export ROS_HOSTNAME=localhost ROS_MASTER_URI={DEFAULT_MASTER}"
LOCAL = f"If all nodes are on this machine: {ALONE}"
OTHERS = "else ROS_HOSTNAME or ROS_IP is a name or an address of this machine that the others reach"


class Finding(NamedTuple):
    level: str
    subject: str
    text: str
    remedy: str = ""


Findings = Iterator[Finding]


def examine_system() -> Findings:
    release = Path("/etc/os-release")
    text = release.read_text(encoding="utf-8") if release.exists() else ""
    system = re.findall(r'^(?:ID|VERSION_ID)="?([^"\n]*)', text, re.MULTILINE) or [sys.platform]
    flags = re.search(r"^flags\s*:(.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    known = [
        name for name in ("avx512f", "avx2", "avx", "fma") if flags and name in flags[1].split()
    ]
    libc = " ".join(platform.libc_ver())
    machine = platform.machine()
    described = f"{' '.join(sorted(system, reverse=True))}, {libc}, {machine} {' '.join(known)}"
    if machine == "x86_64":
        yield Finding(OK, "system", described)
    else:
        yield Finding(NOTE, "system", f"{described}: the bits are tested on x86_64 only")
    if importlib.util.find_spec("rospy") and "bullseye" in text:
        yield Finding(
            NOTE, "rospy", "Debian 11's prints an AttributeError about isAlive at exit; ignore it"
        )


def examine_options() -> Findings:
    missing = [
        name for name in ("pygame", "matplotlib", "tqdm") if not importlib.util.find_spec(name)
    ]
    if missing:
        remedy = "pip install 'walker_sim[window,commands]'"
        yield Finding(NOTE, "options", f"no {', '.join(missing)} for windows and plots", remedy)
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        yield Finding(NOTE, "display", "there is none: `play` and rviz need one")
    for walkers, names, packages in (
        ("BipedalWalker", ("libcairo.so.2",), "libcairo2"),
        (
            "Walker2d and Hopper",
            ("libEGL.so.1", "libOSMesa.so.8"),
            "libegl1 libegl-mesa0 libgl1-mesa-dri, or libosmesa6",
        ),
    ):
        if not any(map(can_load, names)):
            text = f"{walkers} cannot be drawn without {' or '.join(names)}"
            yield Finding(NOTE, "pictures", text, f"apt-get install {packages}")


def can_load(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def is_ros() -> bool:
    return any(os.environ.get(name) for name in ("ROS_DISTRO", "ROS_ROOT", "ROS_PACKAGE_PATH"))


def examine_ros() -> Findings:
    if not is_ros():
        yield Finding(OK, "ROS", "is not sourced; walkers in Python and our client need none")
        return
    if os.environ.get("ROS_VERSION") == "2":
        remedy = "Source ROS 1 in a new shell"
        yield Finding(FAULT, "ROS", "ROS 2 is sourced, which walker_sim does not support", remedy)
        return
    yield Finding(OK, "ROS", os.environ.get("ROS_DISTRO", "without ROS_DISTRO"))
    if not importlib.util.find_spec("walker_sim.msg"):
        remedy = "source devel/setup.bash of the workspace, last"
        yield Finding(FAULT, "messages", "walker_sim's are not on this Python's path", remedy)
    if not importlib.util.find_spec("rospy"):
        text = (
            "is not on this Python's path; rospy nodes and ROS's tools need it, our client does not"
        )
        yield Finding(NOTE, "rospy", text, "Use /usr/bin/python3 for them, not conda's or pyenv's")
    folders = os.environ.get("ROS_PACKAGE_PATH", "").split(":")
    if "/usr/share" not in folders and Path("/usr/share/std_msgs/msg").is_dir():
        text = "lacks /usr/share, where only rosnodejs looks for the distribution's messages"
        remedy = "For rosnodejs: export ROS_PACKAGE_PATH=$ROS_PACKAGE_PATH:/usr/share"
        yield Finding(NOTE, "ROS_PACKAGE_PATH", text, remedy)


def examine_names() -> Findings:
    """Examines the name under which other nodes reach this machine's."""
    names = [name for name in ("ROS_HOSTNAME", "ROS_IP") if os.environ.get(name)]
    if not names and not is_ros():
        return
    subject = names[0] if names else "host name"  # ROS_HOSTNAME precedes ROS_IP
    host = os.environ[names[0]] if names else socket.gethostname()
    remedy = f"{LOCAL}; {OTHERS}"
    try:
        is_here = names_this_machine(host)
        if subject == "ROS_IP":
            ipaddress.ip_address(host)
    except (OSError, ValueError):  # the latter for a name that cannot be one
        if subject == "ROS_IP":
            yield Finding(FAULT, subject, "is not an IP address", remedy)
            return
        yield Finding(FAULT, subject, "does not resolve: no node can reach nodes here", remedy)
        return
    if not is_here:
        yield Finding(FAULT, subject, "is another machine's: no node can reach nodes here", remedy)
    elif host not in ("localhost", "::1") and not host.startswith("127."):
        text = "is this machine's; any client that reaches it can command the nodes"
        yield Finding(OK, subject, text)
    elif is_master_elsewhere():
        text = "is for this machine alone, but the master is on another: its nodes reach none here"
        yield Finding(FAULT, subject, text, remedy)
    else:
        yield Finding(OK, subject, f"{host}: nodes listen on this machine alone")


def names_this_machine(host: str) -> bool:
    """Returns whether a socket can be bound to an address of the host; OSError if it has none."""
    for family, kind, _, _, address in socket.getaddrinfo(host, 0, type=socket.SOCK_DGRAM):
        with contextlib.suppress(OSError), socket.socket(family, kind) as bound:
            bound.bind(address)
            return True
    return False


def is_master_elsewhere() -> bool:
    """Returns False if unknown: `examine_master` reports an invalid URI."""
    try:
        host = urllib.parse.urlsplit(os.environ.get("ROS_MASTER_URI", "")).hostname
        return host is not None and not names_this_machine(host)
    except (ValueError, OSError):
        return False


def examine_master() -> Findings:
    uri = os.environ.get("ROS_MASTER_URI", "")
    if not uri and not is_ros():
        return
    try:
        parts = urllib.parse.urlsplit(uri or DEFAULT_MASTER)
        host, port = parts.hostname, parts.port
        if parts.scheme != "http" or not host or not port:
            raise ValueError(uri)
        connection = http.client.HTTPConnection(host, port, timeout=PATIENCE)
        call = "<?xml version='1.0'?><methodCall><methodName>getPid</methodName><params><param>"
        call += "<value><string>/doctor</string></value></param></params></methodCall>"
        connection.connect()
    except socket.gaierror:
        yield Finding(FAULT, "ROS_MASTER_URI", "has a host that does not resolve", LOCAL)
    except ValueError:
        yield Finding(FAULT, "ROS_MASTER_URI", "is not http://HOST:PORT", LOCAL)
    except OSError:
        text = "no master answers at ROS_MASTER_URI"
        yield Finding(NOTE, "master", text, "./scripts/run, roslaunch or roscore starts one")
    else:
        try:
            connection.request("POST", "/RPC2", call, {"Content-Type": "text/xml"})
            answers = b"<methodResponse>" in connection.getresponse().read(10_000)
        except (OSError, http.client.HTTPException):
            answers = False
        if answers:
            yield Finding(OK, "master", "answers at ROS_MASTER_URI")
        else:
            text = "what listens at ROS_MASTER_URI does not answer as a ROS master"
            yield Finding(FAULT, "master", text, "Restart the master, or choose another port")


def examine_limits() -> Findings:
    try:
        with os.fdopen(os.memfd_create("walker_sim"), "wb") as file:
            file.truncate(1 << 17)
        yield Finding(OK, "shared memory", "works (memfd; /dev/shm is not used)")
    except (OSError, AttributeError) as error:
        text = (
            f"does not work ({error}): a client on the server's machine uses TCP, which is slower"
        )
        yield Finding(NOTE, "shared memory", text)
    files, stack, memory = (
        resource.getrlimit(number)[0]
        for number in (resource.RLIMIT_NOFILE, resource.RLIMIT_STACK, resource.RLIMIT_AS)
    )
    if 0 <= files < MIN_FILES:
        text = f"{files} open files: a server accepts {files // 2} connections"
        yield Finding(FAULT, "limits", text, f"ulimit -n {4 * MIN_FILES}")
    if 0 <= stack < MIN_STACK:
        yield Finding(FAULT, "limits", f"{stack // 1024} KiB of stack", "ulimit -s 8192")
    if memory >= 0:
        text = f"{memory >> 20} MiB of address space: large pools and models may not fit"
        yield Finding(NOTE, "limits", text, "ulimit -v unlimited")


QUICK = (examine_system, examine_options, examine_ros, examine_limits)
# These may block. The values are the finding if they take too long.
SLOW = {
    examine_names: ("host name", "no name server answers", LOCAL),
    examine_master: ("ROS_MASTER_URI", "neither a name server nor a master answers", LOCAL),
}
