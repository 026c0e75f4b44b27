"""Settings of Sphinx, which ./scripts/docs calls. The pages are those of the repository, where they
stand: links between them lead to the same places on GitHub and on the site."""

import pathlib
import re
import sys
import types

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "src" / "python"))

import walker_sim  # noqa: E402

# In place of the extension module, which need not be built to read what calls it.
sys.modules["walker_sim._core"] = core = types.ModuleType("walker_sim._core")
core.__version__ = walker_sim.__version__

project = "walker_sim"
author = "walker_sim developers"
release = re.search("<version>(.*)</version>", (ROOT / "package.xml").read_text())[1]
extensions = ["breathe", "myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
include_patterns = [
    "*.md",
    "CHANGELOG.rst",
    "docs/*.md",
    "docs/policies/*.md",
    "docs/*.rst",
    "examples/*.md",
    "examples/*/*.md",
]
exclude_patterns = ["build", "devel", ".*"]
root_doc = "README"

myst_heading_anchors = 3
default_role = "code"
highlight_language = "text"  # of blocks that name none
add_module_names = False
toc_object_entries_show_parents = "hide"
autodoc_member_order = "bysource"
TYPES = ("ArrayLike", "Infos", "NDArray", "Picture", "Seeds")
autodoc_type_aliases = {name: name for name in TYPES}  # shown by name
autodoc_mock_imports = ["stable_baselines3"]
breathe_projects = {"walker_sim": str(ROOT / "build" / "docs" / "xml")}
breathe_default_project = "walker_sim"
suppress_warnings = ["duplicate_declaration.cpp"]  # of the namespace, in each header
linkcheck_ignore = ["http://localhost"]
html_theme = "furo"
html_title = f"{project} {release}"
html_show_copyright = False
html_show_sourcelink = False
html_static_path = ["site.css"]
html_css_files = ["site.css"]

# What README has no room for: the order of the pages.
TREE = {
    "Use": "ros_guide ros_interface python cli worlds training policies robustness custom_model "
    "install",
    "Shipped policies": " ".join(
        f"policies/{path.stem}" for path in sorted((ROOT / "docs/policies").glob("*.md"))
    ),
    "Evidence": "fidelity compatibility reliability security benchmark engines",
    "Reference": "python_api cpp_api",
    "Work on it": "architecture adding_an_environment testing releasing"
    " /CONTRIBUTING /SECURITY /CHANGELOG",
    "Speed, in depth": "box2d_speed mujoco_speed pool transport",
    "Examples": "/examples/README /examples/my_walker_pkg/README",
}


def tree():
    for caption, pages in TREE.items():
        names = [page if page[0] == "/" else f"docs/{page}" for page in pages.split()]
        yield from ("", "```{toctree}", ":hidden:", f":caption: {caption}", "", *names, "```")


# All but what is private.
SECTIONS = "briefdescription detaileddescription innernamespace innerclass enum typedef func"
SECTIONS += " public-type public-func public-attrib public-static-func public-static-attrib"


def headers():
    """A section for each public one, whose first lines say what it is for."""
    for path in sorted(ROOT.glob("include/walker_sim/*.h")):
        title = f"walker_sim/{path.name}"
        about = path.read_text().partition("\n#pragma once")[0].replace("// ", "")
        yield from ("", title, "-" * len(title), "", about, "")
        yield from (f".. doxygenfile:: {path.name}", f"   :sections: {SECTIONS}")


def add_lines(_app, name, source):
    lines = {root_doc: tree, "docs/cpp_api": headers}.get(name, tuple)()
    source[0] += "\n".join([*lines, ""])


def shorten(_app, _what, _name, _object, _options, *signature):
    """Types by name, where Sphinx wraps it or tells the module too."""
    long_name = r"TypeAliasForwardRef\('(\w+)'\)|stable_baselines3(?:\.\w+)*\.(\w+)"
    return tuple(text and re.sub(long_name, r"\1\2", text) for text in signature)


def setup(app):
    app.connect("source-read", add_lines)
    app.connect("autodoc-process-signature", shorten)
