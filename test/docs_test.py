"""Documentation: links and anchors have targets, and README is short."""

import math
import pathlib
import re

import pytest
from walker_sim import _core

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGES = sorted(
    [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.rst")]
    + [*ROOT.glob("docs/**/*.md")]
)
MAX_README_LINES = 180


def prose(path):
    text = path.read_text(encoding="utf-8")
    text = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"`[^`]+`(?!_)", "", text)


def links(path):
    pattern = r"\]\(([^)\s]+)\)"
    if path.suffix == ".rst":
        pattern = r"`[^`]*<([^>]+)>`_"
    return re.findall(pattern, prose(path))


def anchors(path):
    """Returns GitHub's anchors of a page's headings."""
    text = re.sub(r"^```.*?^```$", "", path.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
    found = []
    for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE):
        slug = re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")
        repeated = found.count(slug)
        found.append(slug)
        if repeated:
            found.append(f"{slug}-{repeated}")
    return found


def error_of(path, link):
    """Returns why the link has no target, or an empty string."""
    if re.match(r"[a-z]+:", link):
        return ""  # external links: ./scripts/docs --external
    file, _, anchor = link.partition("#")
    target = (path.parent / file).resolve() if file else path
    if ROOT not in target.parents or not target.exists():
        return f"{file} is not there"
    if anchor and (target.suffix != ".md" or anchor not in anchors(target)):
        return f"{target.name} has no heading {anchor}"
    return ""


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_every_link_has_a_target(path):
    errors = {link: error_of(path, link) for link in links(path)}
    assert not {link: why for link, why in errors.items() if why}


def test_readme_is_short_and_links_every_page():
    readme = ROOT / "README.md"
    assert len(readme.read_text(encoding="utf-8").splitlines()) <= MAX_README_LINES
    linked = {(ROOT / link.partition("#")[0]).resolve() for link in links(readme)}
    cards = set(ROOT.glob("docs/policies/*.md"))
    assert set(PAGES) - {readme} - cards <= linked
    overview = ROOT / "docs/policies.md"
    assert cards == {(overview.parent / link).resolve() for link in links(overview)} & cards


@pytest.mark.parametrize(
    ("link", "why"),
    [
        ("docs/python.md#keywords", ""),
        ("#quick-start", ""),
        ("https://gymnasium.farama.org", ""),
        ("docs/pyton.md", "docs/pyton.md is not there"),
        ("docs/python.md#no-such-thing", "python.md has no heading no-such-thing"),
        ("../elsewhere.md", "../elsewhere.md is not there"),
    ],
)
def test_link_without_a_target_is_found(link, why):
    assert error_of(ROOT / "README.md", link) == why


def test_every_parameter_of_a_world_is_listed_with_its_limits():
    rows = {}
    for line in (ROOT / "docs/worlds.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) == 7 and cells[0].startswith("`"):
            rows.update(dict.fromkeys(re.findall(r"`(\w+)`", cells[0]), cells[1:]))
    known = {}
    for column, ids in ((4, ["BipedalWalker-v3"]), (5, ["Walker2d-v5", "Hopper-v5"])):
        for env_id in ids:
            for parameter in _core.world_parameters(env_id):
                name = known.setdefault(parameter["name"], parameter["name"])
                limits = f"{parameter['minimum']:g} to {parameter['maximum']:g}"
                assert limits in rows[name][column - 1].split("; "), name
                assert rows[name][0] == (parameter["unit"] or "-")
                default = parameter["default"]
                if not math.isnan(default) and name != "lidar_range":
                    assert f"{default:g}" in rows[name][2].split("; "), name
    assert set(rows) == set(known)
    presets = re.findall(r"`(\w+)`", (ROOT / "docs/worlds.md").read_text(encoding="utf-8"))
    assert set(_core.world_presets()) <= set(presets)
