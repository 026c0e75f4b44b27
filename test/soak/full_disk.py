"""The disk is full during a recording: the error says so, and the walker walks on."""

import contextlib
import os
import pathlib
import resource
import signal
import subprocess
import tempfile

from walk import Pair

SMALL = 64 << 10  # size of the disk [bytes]


@contextlib.contextmanager
def small_disk():
    """Yields a small folder and the preexec_fn of its processes: root gets a tmpfs, other users a
    limit on the file size."""
    with tempfile.TemporaryDirectory(prefix="walker_sim_soak_") as folder:
        mounts = (
            os.geteuid() == 0
            and not subprocess.run(
                ["mount", "-t", "tmpfs", "-o", f"size={SMALL}", "tmpfs", folder],
                stderr=subprocess.DEVNULL,
                check=False,
            ).returncode
        )
        try:
            yield pathlib.Path(folder), None if mounts else limit_files
        finally:
            if mounts:
                subprocess.run(["umount", folder], check=True)


def limit_files():
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # write() fails, as on a full disk
    resource.setrlimit(resource.RLIMIT_FSIZE, (SMALL, SMALL))


def full_disk(soak):
    with soak.graph() as graph, small_disk() as (folder, prepare):
        server = graph.server()
        pair = Pair(server.name, graph.uri, 10.0)
        for number in soak.rounds():
            file = folder / "walk.npz"
            episodes = ("BipedalWalker-v3", "--seeds", f"{number}:{number + 4}")
            done = graph.run("record", "--output", file, *episodes, preexec_fn=prepare)
            soak.check(
                "record ends with status 2 and one line that says why",
                done.returncode == 2
                and done.stderr.count("\n") == 1
                and ("No space left" in done.stderr or "too large" in done.stderr),
                f"status {done.returncode}: {done.stdout}{done.stderr}",
            )
            checked = graph.run("record", "--check", file)
            soak.check(
                "what is left of the file is not taken for a recording",
                checked.returncode == 2 and checked.stderr.count("\n") == 1,
                f"status {checked.returncode}: {checked.stdout}{checked.stderr}",
            )
            file.unlink(missing_ok=True)
            record_bag(soak, graph, folder, prepare, pair, number)
            for left in folder.iterdir():
                left.unlink()
        pair.close()


def record_bag(soak, graph, folder, prepare, pair, number):
    command = ["rosbag", "record", "-b", "1", "-O", folder / "walk.bag", "/transition", "/tf"]
    recorder = graph.start(command, preexec_fn=prepare)
    equal = pair.reset(number) and pair.steps(1500)
    soak.check("beside a recorder without room the bits are right", equal, recorder.output())
    recorder.end()
