"""Files that contributors and GitHub read: they parse, and agree with the package."""

import pathlib
import re
import subprocess
import xml.etree.ElementTree as ElementTree

import pytest
import yaml
from catkin_pkg import changelog

ROOT = pathlib.Path(__file__).resolve().parent.parent
DOCTOR = "python3 -m walker_sim doctor"
WORKFLOWS = sorted(ROOT.glob(".github/workflows/*.yml"))
GROUPS = ("Added", "Changed", "Fixed")
FORMS = sorted(set(ROOT.glob(".github/ISSUE_TEMPLATE/*.yml")) - {*ROOT.glob("**/config.yml")})


def read(name):
    return yaml.safe_load((ROOT / name).read_text(encoding="utf-8"))


def changes():
    """Returns the change log's releases, newest first: heading, then entries by group."""
    text = (ROOT / "CHANGELOG.rst").read_text(encoding="utf-8")
    _, *parts = re.split(r"^(.+)\n-+\n", text, flags=re.MULTILINE)
    assert len(parts) % 2 == 0
    releases = []
    for heading, body in zip(parts[::2], parts[1::2]):
        groups = re.split(r"^\*\*(.+)\*\*\n", body, flags=re.MULTILINE)
        assert not groups[0].strip(), f"{heading}: text before the first group"
        entries = {
            name: re.findall(r"^\* .*(?:\n  .*)*", group, re.MULTILINE)
            for name, group in zip(groups[1::2], groups[2::2])
        }
        releases.append((heading, entries))
    return releases


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
    # A release has a date in both files; before it the change log begins with Forthcoming.
    heading = changes()[0][0]
    if heading == "Forthcoming":
        assert "date-released" not in citation
    else:
        assert heading == f"{citation['version']} ({citation['date-released']})"


def test_the_change_log_has_short_lines_in_groups():
    for heading, entries in changes():
        assert list(entries) == [name for name in GROUPS if name in entries], heading
        lines = [entry.split("\n") for group in entries.values() for entry in group]
        assert all(len(entry) <= 2 and max(map(len, entry)) <= 120 for entry in lines)


def test_catkin_reads_every_entry_of_the_change_log():
    """bloom writes Debian's change log from what catkin_pkg reads."""
    text = (ROOT / "CHANGELOG.rst").read_text(encoding="utf-8")
    text = re.sub(
        r"^Forthcoming\n-+$", "99.0.0 (2100-01-01)\n" + "-" * 19, text, flags=re.MULTILINE
    )
    log = changelog.Changelog("walker_sim")
    changelog.populate_changelog_from_rst(log, text)
    read = [
        sum(len(part.bullets) for part in parts if isinstance(part, changelog.BulletList))
        for _, _, parts in log.foreach_version(reverse=True)
    ]
    assert read == [sum(map(len, entries.values())) for _, entries in changes()]


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


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_workflows_have_limits(path):
    workflow = read(path)
    assert workflow["permissions"] == {"contents": "read"}
    assert workflow["concurrency"]["group"]
    for name, job in workflow["jobs"].items():
        assert job.get("timeout-minutes"), name
        assert "latest" not in job["runs-on"], name


def test_each_action_is_pinned_to_one_commit():
    """A tag can be moved to other code; the comment behind the commit is the tag it had."""
    pins = {}
    for path in WORKFLOWS:
        for use in re.findall(r"^ *(?:- )?uses: *(.*)$", path.read_text("utf-8"), re.MULTILINE):
            pin = re.fullmatch(r"([\w-]+/[\w-]+)@([0-9a-f]{40} # v\d+\.\d+\.\d+)", use)
            assert pin, f"{path.name}: {use}"
            assert pins.setdefault(pin[1], pin[2]) == pin[2], f"{path.name}: {use}"
    assert {"actions/checkout", "pypa/gh-action-pypi-publish"} <= pins.keys()


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
