"""An in-process server and master with answers that a test defines."""

import contextlib
import socket
import struct
import threading
import xmlrpc.server

from walker_sim import _core

ENV = "Walker2d-v5"  # has info names
NUM_ENVS = 2
LOCAL = _core.Pool(ENV, {}).specification
WIDTH, INFO = len(LOCAL["observation_low"]), len(LOCAL["info_names"])


# ---------------------------------------------------------------- wire format


def text(value):
    data = value if isinstance(value, bytes) else value.encode()
    return struct.pack("<I", len(data)) + data


def texts(values):
    return struct.pack("<I", len(values)) + b"".join(map(text, values))


def array(kind, values):
    if kind == "text":
        return texts(values)
    return struct.pack(f"<I{len(values)}{kind}", len(values), *values)


def outcome(success=True, words=""):
    return struct.pack("<?", success) + text(words)


def specification(**changes):
    sizes = {"observation_size": WIDTH, "action_size": len(LOCAL["action_low"])}
    modes = {"mode": "lockstep", "autoreset_mode": "same_step"}
    fields = {**LOCAL, "num_envs": NUM_ENVS, **sizes, **modes, **changes}
    parts = [
        struct.pack("<I", 1),
        text(fields["id"]),
        struct.pack("<I", fields["num_envs"]),
        texts(list(fields["parameters"])),
        texts(list(fields["parameters"].values())),
        text("gymnasium") + struct.pack("<I", 0),  # the world
        struct.pack("<I", fields["observation_size"]),
        text(fields["observation_dtype"]),
        array("d", fields["observation_low"]),
        array("d", fields["observation_high"]),
        struct.pack("<I", fields["action_size"]),
        array("d", fields["action_low"]),
        array("d", fields["action_high"]),
        struct.pack("<dId", fields["dt"], fields["max_episode_steps"], fields["reward_threshold"]),
        texts(fields["joint_names"]),
        texts(fields["info_names"]),
    ]
    names = ("mode", "autoreset_mode", "engine", "engine_version", "engine_path", "version")
    return b"".join(parts + [text(fields[name]) for name in names])


def transition(step=1, **changes):
    """Response of ~reset or ~step."""
    fields = {"observation": [0.5] * WIDTH, "info": [0.0] * INFO, "error": "", **changes}
    parts = [
        outcome(),
        struct.pack("<III", 1, 2, 3),
        text("odom"),
        struct.pack("<III", 0, 1, step),
        array("d", [0.0] * 6 if step > 0 else []),
        array("d", fields["observation"]),
        struct.pack("<dd??", 1.0, 1.0, bool(fields["error"]), False),
        array("d", fields["info"]),
        text(fields["error"]),
        b"" if step > 0 else struct.pack("<I", 0),  # the world that a reset draws
    ]
    return b"".join(parts)


BATCH_RESET = {
    "observations": ("d", [0.5] * (NUM_ENVS * WIDTH)),
    "info": ("d", [0.0] * (NUM_ENVS * INFO)),
    "failed_environments": ("I", []),
    "failures": ("text", []),
    "worlds": ("I", []),
}
BATCH_STEP = {  # the second environment's episode has ended
    "observations": ("d", [0.5] * (NUM_ENVS * WIDTH)),
    "rewards": ("d", [1.0, 2.0]),
    "terminated": ("B", [0, 1]),
    "truncated": ("B", [0, 0]),
    "episodes": ("I", [1, 2]),
    "steps": ("I", [1, 0]),
    "info": ("d", [0.0] * (NUM_ENVS * INFO)),
    "failed_environments": ("I", []),
    "failed_at_reset": ("B", []),
    "failures": ("text", []),
    "final_environments": ("I", [1]),
    "final_observations": ("d", [0.25] * WIDTH),
    "final_info": ("d", [0.0] * INFO),
    "worlds": ("I", []),
}


def batch(table, changes):
    arrays = (array(kind, changes.get(name, values)) for name, (kind, values) in table.items())
    return outcome() + b"".join(arrays)


def batch_reset(**changes):
    return batch(BATCH_RESET, changes)


def batch_step(**changes):
    return batch(BATCH_STEP, changes)


def picture(width=3, height=2, encoding="rgb8", data=bytes(range(18))):
    """Response of ~render."""
    parts = [
        outcome(),
        struct.pack("<III", 1, 2, 3),
        text("camera"),
        struct.pack("<II", height, width),
        text(encoding),
        struct.pack("<?I", False, 3 * width % 2**32),
        text(data),
    ]
    return b"".join(parts)


RIGHT = {
    "get_spec": specification(),
    "reset": transition(step=0),
    "step": transition(),
    "reset_batch": batch_reset(),
    "step_batch": batch_step(),
    "render": picture(),
}


# ---------------------------------------------------------------- server


def take(connection, size):
    data = b""
    while len(data) < size:
        part = connection.recv(size - len(data))
        if not part:
            raise ConnectionResetError
        data += part
    return data


def take_frame(connection):
    return take(connection, *struct.unpack("<I", take(connection, 4)))


class FakeServer:
    """A server and its master. Tests may change `answers`, keyed by service, between calls."""

    def __init__(self):
        self.answers = dict(RIGHT)
        self.asked = threading.Event()  # set when a request waits for may_answer
        self.may_answer = threading.Event()
        self.may_answer.set()
        self._socket = socket.create_server(("127.0.0.1", 0))
        self._master = xmlrpc.server.SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
        uri = f"rosrpc://127.0.0.1:{self._socket.getsockname()[1]}"
        self._master.register_function(lambda *_: [1, "", uri], "lookupService")
        self.master_uri = f"http://127.0.0.1:{self._master.server_address[1]}"
        threading.Thread(target=self._accept, daemon=True).start()
        threading.Thread(
            target=self._master.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True
        ).start()

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                connection, _ = self._socket.accept()
                threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection):
        with connection, contextlib.suppress(OSError):
            header = take_frame(connection)
            service = next(name for name in RIGHT if f"/{name}\0".encode() in header_fields(header))
            connection.sendall(text(text("callerid=/walker_sim")))
            while True:
                take_frame(connection)
                if not self.may_answer.is_set():
                    self.asked.set()
                    self.may_answer.wait()
                connection.sendall(b"\1" + text(self.answers[service]))

    def close(self):
        self._socket.close()
        self._master.shutdown()
        self._master.server_close()


def header_fields(header):
    """Returns the fields of a TCPROS header, each with a terminating zero byte."""
    fields = b""
    while header:
        (size,) = struct.unpack("<I", header[:4])
        fields += header[4 : 4 + size] + b"\0"
        header = header[4 + size :]
    return fields
