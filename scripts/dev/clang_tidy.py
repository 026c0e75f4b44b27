#!/usr/bin/python3
"""Runs clang-tidy on our files that the build compiles: clang_tidy.py ROOT COMMANDS CHOICE JOBS

COMMANDS is the build's compile_commands.json. CHOICE is all, PART/PARTS, or changed: since the
merge base with origin's main branch.

Most of clang-tidy's time goes to reading the libraries' headers. So files with equal flags are
read as one, and the halves of such a group only if that finds something or does not compile. The
static analyzer skips headers by itself, so it reads each file alone: those in src/ only, as
test/.clang-tidy says, and without inlining templates, because the libraries' make it five times as
slow. The compiler's precompiled headers are omitted: only the compiler can read them.
"""

import concurrent.futures
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile

GROUP = 20  # files
# The compiler, its precompiled header, its outputs and options of code generation. Shadowed names
# are left to GCC: in a group they would include those of other files' unnamed namespaces.
NOT_FOR_CLANG = re.compile(
    r"^.*?(?= -)|-Winvalid-pch|-include \S*cmake_pch\.hxx| -o \S+ -c \S+"
    r"| -(?:O\d|Wshadow|fPI[CE]|fvisibility\S*|D\w+_EXPORTS)\b"
)
NAMESPACE = re.compile(r"^namespace [\w:]+", re.MULTILINE)
# A name that a file defines in an unindented line, so outside classes and functions; no tests.
TOP_LEVEL_NAME = re.compile(
    r"^(?:struct|class|enum class|enum|union) (\w+)|^using (\w+) =|"
    r"^(?!namespace|TEST)\w[^\n(={]*?(?<!::)\b(\w+)(?:\(|\{|\[.*\] = | = )",
    re.MULTILINE,
)


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def read_commands(root, path):
    """Returns the build's (directory, flags) for each file of ours."""
    # A file of several programs is read once, not with ThreadSanitizer's flags if it has others.
    entries = sorted(json.loads(read(path)), key=lambda e: "_race.dir" not in e["command"])
    commands = {}
    for entry in entries:
        file = os.path.realpath(entry["file"])
        if file.startswith((f"{root}/src/", f"{root}/test/")):
            flags = re.sub(NOT_FOR_CLANG, "", entry["command"])
            commands[file] = entry["directory"], tuple(shlex.split(flags))
    return dict(sorted(commands.items()))


def changed(root, commands):
    """Returns the changed files and, for each changed header, the first file that includes it."""

    def git(*arguments, may_fail=False):
        command = ["git", "-C", root, *arguments]
        errors = subprocess.DEVNULL if may_fail else None
        done = subprocess.run(
            command, stdout=subprocess.PIPE, stderr=errors, text=True, check=False
        )
        if done.returncode != 0 and not may_fail:
            sys.exit(f"git {arguments[0]} failed, so what has changed is not known; all: --all")
        return done.stdout.split()

    branches = ("origin/HEAD", "origin/main", "main")  # a clone may lack some
    bases = [base for name in branches for base in git("merge-base", "HEAD", name, may_fail=True)]
    names = git("diff", "--name-only", bases[0] if bases else "HEAD")
    names += git("ls-files", "--others", "--exclude-standard")
    chosen = {os.path.join(root, name) for name in names}
    for header in [name for name in names if name.endswith(".h")]:
        name = re.sub(r"^(include|src|test)/", "", header)
        chosen |= set([file for file in commands if f'#include "{name}"' in read(file)][:1])
    return [file for file in commands if file in chosen]


def grouped(files, commands):
    """Returns lists of files with equal flags and, apparently, no name in common."""
    groups = []
    for file in files:
        text = read(file)
        namespace = "".join(NAMESPACE.findall(text)[:1])
        found = map("".join, TOP_LEVEL_NAME.findall(text))
        names = {name if name == "main" else namespace + name for name in found}
        for command, members, taken in groups:
            if command == commands[file] and len(members) < GROUP and not names & taken:
                members.append(file)
                taken |= names
                break
        else:
            groups.append((commands[file], [file], names))
    return [members for _, members, _ in groups]


def complaints_of(root, file, checks, directory, flags):
    """Returns clang-tidy's output for a file; '' if it has no complaint."""
    filters = f"--header-filter=^{root}/(include|src|test)/"
    command = ["clang-tidy", "--quiet", filters, f"--checks={checks}", file]
    command += ["--", *flags, "-Wno-unknown-warning-option", "-Wno-deprecated-declarations"]
    done = subprocess.run(command, cwd=directory, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr if done.returncode != 0 else ""


def complaints_of_group(root, group, *command):
    checks = "-clang-analyzer-*"
    if len(group) == 1:
        return complaints_of(root, group[0], checks, *command)
    with tempfile.TemporaryDirectory() as folder:
        # clang-tidy finds this file; the option --config-file would make it five times as slow.
        os.symlink(f"{root}/.clang-tidy", f"{folder}/.clang-tidy")
        with open(f"{folder}/group.cpp", "w", encoding="utf-8") as joined:
            joined.writelines(f'#include "{file}"  // NOLINT\n' for file in group)
        if not complaints_of(root, joined.name, checks, *command):
            return ""
    middle = len(group) // 2
    halves = group[:middle], group[middle:]
    return "".join(complaints_of_group(root, half, *command) for half in halves)


def complaints_of_analyzer(root, file, directory, flags):
    flags += ("-Xclang", "-analyzer-config", "-Xclang", "c++-template-inlining=false")
    return complaints_of(root, file, "-*,clang-analyzer-*", directory, flags)


def main():
    root, path, choice, jobs = sys.argv[1:]
    commands = read_commands(root, path)
    files = list(commands)
    if choice == "changed":
        files = changed(root, commands)
        if not files:
            print("no source file has changed")
            return 0
    if not files:
        print("no file to look at")
        return 1
    groups = grouped(files, commands)
    tasks = [(complaints_of_group, group, *commands[group[0]]) for group in groups]
    ours = [file for file in files if file.startswith(f"{root}/src/")]
    tasks += [(complaints_of_analyzer, file, *commands[file]) for file in ours]
    if "/" in choice:
        part, parts = map(int, choice.split("/"))
        tasks = tasks[part - 1 :: parts]
    status = 0
    with concurrent.futures.ThreadPoolExecutor(int(jobs)) as pool:
        for complaints in pool.map(lambda task: task[0](root, *task[1:]), tasks):
            print(complaints, end="", flush=True)
            status |= complaints != ""
    return status


if __name__ == "__main__":
    sys.exit(main())
