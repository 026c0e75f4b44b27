"""Files that contributors and GitHub read: they parse, and agree with the package."""

import pathlib
import re
import subprocess
import xml.etree.ElementTree as ElementTree

import pytest
import yaml

ROOT = pathlib.Path(__file__).resolve().parent.parent
DOCTOR = "python3 -m walker_sim doctor"
FORMS = sorted(set(ROOT.glob(".github/ISSUE_TEMPLATE/*.yml")) - {*ROOT.glob("**/config.yml")})


def read(name):
    return yaml.safe_load((ROOT / name).read_text(encoding="utf-8"))


def test_pre_commit_runs_every_lint():
    (repository,) = read(".pre-commit-config.yaml")["repos"]
    assert repository["repo"] == "local"
    lints = re.search(r"^lints=\((.*)\)$", (ROOT / "scripts/dev/lint").read_text(), re.MULTILINE)
    assert sorted(hook["id"] for hook in repository["hooks"]) == sorted(lints[1].split())
    for hook in repository["hooks"]:
        assert hook["entry"] == f"./scripts/dev/lint {hook['id']}"
        assert (hook["language"], hook["pass_filenames"]) == ("system", False)
        re.compile(hook.get("files", ""))


def test_the_citation_is_of_this_version():
    citation = read("CITATION.cff")
    package = ElementTree.parse(ROOT / "package.xml")
    for key in ("cff-version", "message", "title", "authors"):  # which the format requires
        assert citation[key]
    assert str(citation["version"]) == package.findtext("version")
    assert citation["license"] == package.findtext("license")
    assert f"{citation['repository-code']}.git" in [url.text for url in package.findall("url")]
    changes = (ROOT / "CHANGELOG.rst").read_text(encoding="utf-8")
    assert f"\n{citation['version']} ({citation['date-released']})\n" in changes


@pytest.mark.parametrize("path", FORMS, ids=lambda path: path.name)
def test_forms_ask_for_the_doctor(path):
    form = read(path)
    assert form["name"]
    assert form["description"]
    fields = {field["id"]: field for field in form["body"]}
    assert len(fields) == len(form["body"])
    assert all(field["attributes"]["label"] for field in fields.values())
    assert DOCTOR in fields["doctor"]["attributes"]["description"]


def test_there_are_forms():
    assert [path.name for path in FORMS] == ["bug.yml", "wish.yml"]
    assert DOCTOR in (ROOT / ".github/PULL_REQUEST_TEMPLATE.md").read_text(encoding="utf-8")
    (link,) = read(".github/ISSUE_TEMPLATE/config.yml")["contact_links"]
    assert {"name", "url", "about"} == link.keys()


def test_the_security_policy_links_the_page():
    text = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    (page,) = re.findall(r"\]\(([^)]+)\)", text)
    assert (ROOT / page).is_file()


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="there is no repository")
@pytest.mark.parametrize(
    ("file", "attributes"),
    [
        ("test/recordings/episodes.txt", {"diff": "unset", "linguist-generated": "set"}),
        ("assets/policies/Hopper-v5.safetensors", {"diff": "unset"}),
        ("scripts/requirements.lock", {"diff": "unspecified", "linguist-generated": "set"}),
        ("docs/cli.md", {"diff": "unspecified", "linguist-generated": "unspecified"}),
    ],
)
def test_git_attributes(file, attributes):
    assert (ROOT / file).is_file()
    command = ["git", "-c", f"safe.directory={ROOT}", "-C", str(ROOT), "check-attr", *attributes]
    lines = subprocess.check_output([*command, "--", file], text=True).splitlines()
    assert lines == [f"{file}: {name}: {value}" for name, value in attributes.items()]
