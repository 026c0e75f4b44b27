"""The lock files, which ./scripts/dev/lock writes, pin the requirements' versions with hashes."""

import json
import pathlib
import re

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[3]
LOCKS = [path for folder in ("docs", "scripts", "test") for path in (ROOT / folder).rglob("*.lock")]


def locked(path):
    entries = re.split(r"\n(?=\S)", path.read_text(encoding="utf-8").strip())
    return {
        re.match(r"[^ ;\\]+==[^ ;\\]+", entry)[0]: re.findall(
            r"--hash=sha256:[0-9a-f]{64}\b", entry
        )
        for entry in entries
    }


def test_every_file_of_requirements_has_one():
    pinned = {
        path
        for folder in ("docs", "scripts", "test")
        for path in (ROOT / folder).rglob("*.txt")
        if re.search(r"^[\w-]+(\[\w+\])?==", path.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert {path.with_suffix(".lock") for path in pinned} == set(LOCKS)


@pytest.mark.parametrize("path", LOCKS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_it_has_every_requirement_with_hashes(path):
    text = path.with_suffix(".txt").read_text(encoding="utf-8")
    lines = [line.partition("#")[0].strip() for line in text.splitlines()]
    wanted = {line.partition(";")[0].strip().lower() for line in lines if line}
    entries = locked(path)
    assert {re.sub(r"\[.*\]", "", each).replace("_", "-") for each in wanted} <= set(entries)
    assert all(entries.values())


def test_npm_has_every_requirement_with_hashes():
    """The lock has no URLs: each machine uses the registry that its npm is configured for."""
    folder = ROOT / "test/python/rosnodejs"
    wanted = json.loads((folder / "package.json").read_text(encoding="utf-8"))["dependencies"]
    lock = json.loads((folder / "package-lock.json").read_text(encoding="utf-8"))
    itself = lock["packages"].pop("")
    assert itself["dependencies"] == wanted
    found = {name: package["version"] for name, package in lock["packages"].items()}
    assert all(found[f"node_modules/{name}"] == version for name, version in wanted.items())
    for package in lock["packages"].values():
        assert package["integrity"].startswith("sha512-")
        assert "resolved" not in package


def test_go_has_the_pinned_actionlint_with_hashes():
    folder = ROOT / "scripts/dev/actionlint"
    (tool,) = re.findall(r"^tool (.+)/cmd/\w+$", (folder / "go.mod").read_text(), re.MULTILINE)
    modules = re.findall(r"^\t(\S+) (v\S+)", (folder / "go.mod").read_text(), re.MULTILINE)
    assert tool in dict(modules)
    hashes = (folder / "go.sum").read_text(encoding="utf-8").splitlines()
    for name, version in modules:
        assert any(line.startswith(f"{name} {version} h1:") for line in hashes), name
