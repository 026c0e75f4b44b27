"""Description of the machine that runs the benchmark."""

import datetime
import importlib.metadata
import os
import pathlib
import platform
import re
import subprocess

PACKAGES = {"envpool": ("envpool",), "gymnasium": ("gymnasium", "box2d", "mujoco", "numpy")}


def describe_machine(root, leave_out=()):
    cpuinfo = pathlib.Path("/proc/cpuinfo").read_text()
    model = re.search(r"^model name\s*: (.*)$", cpuinfo, re.MULTILINE)
    kind = "virtual machine" if " hypervisor " in cpuinfo else "machine"
    names = [name for peer, names in PACKAGES.items() if peer not in leave_out for name in names]
    versions = [f"{name} {importlib.metadata.version(name)}" for name in names]
    return {
        "date": datetime.date.today().isoformat(),
        "CPU": model.group(1) if model else platform.machine(),
        "cores": f"{os.cpu_count()} ({kind})",
        "kernel": platform.release(),
        "system": first_line("sh", "-c", '. /etc/os-release && echo "$PRETTY_NAME"'),
        "compiler": first_line("c++", "--version"),
        "walker_sim": first_line("git", "-C", root, "describe", "--always", "--dirty"),
        "peers": ", ".join(versions),
        "load average before": f"{os.getloadavg()[0]:.2f}",
    }


def first_line(*command):
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, encoding="utf-8", check=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return done.stdout.splitlines()[0]
