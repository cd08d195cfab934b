"""Sphinx turns the pages of this folder into the book: `make book`. It needs `pip install 'photosite[book]'`."""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from sphinx.util.docutils import SphinxDirective

import photosite

if TYPE_CHECKING:
    from docutils import nodes
    from sphinx.application import Sphinx

HERE = Path(__file__).parent
MEASUREMENT = "photosite.measurement"

project = "Photosite"
author = "the Photosite authors"
copyright = f"{author}. BSD-3-Clause"
release = version = photosite.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.autosummary"]
exclude_patterns = ["_build", "images"]
suppress_warnings = ["myst.header"]  # pages may begin a part below a deeper heading
nb_execution_mode = "off"  # notebooks are committed with what they print: `make notebooks`
myst_heading_anchors = 4  # as GitHub gives them, so that links lead to the same place on both
autosummary_generate = False
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
toc_object_entries_show_parents = "hide"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88

highlight_language = "text"  # of blocks that name none, such as commands

html_theme = "pydata_sphinx_theme"
html_title = "Photosite"
html_show_sourcelink = False
html_theme_options = {
    "navbar_align": "left",
    "header_links_before_dropdown": 7,
    "show_prev_next": True,
    "show_toc_level": 2,
    "footer_start": ["copyright"],
    "footer_end": [],
}


def stand_in(name: str, *classes: str) -> ModuleType:
    """Return a module with empty classes, for PyTorch, which is large: annotations need its classes, the book nothing else."""
    module = ModuleType(name)
    for one in classes:
        setattr(module, one, type(one, (), {"__module__": name, "__class_getitem__": classmethod(lambda cls, item: cls)}))
    return module


for found in (
    stand_in("torch", "Tensor"),
    stand_in("torch.utils"),
    stand_in("torch.utils.data", "DataLoader", "Dataset", "Sampler"),
):
    sys.modules[found.__name__] = found


class PublicNames(SphinxDirective):
    """A table of the public names of a module, then each with its docstring. The `.pyi` file beside the module lists them."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Write the directives of autodoc for each name."""
        module = self.arguments[0]
        names = public_names(module)
        if module != MEASUREMENT:  # studies hand on some of its names
            names = [name for name in names if name not in public_names(MEASUREMENT)]
        lines = [f".. currentmodule:: {module}", "", ".. autosummary::", "   :nosignatures:", ""]
        lines += [*(f"   {name}" for name in names), ""]
        for name in names:
            kind = "autoclass" if name[0].isupper() else "autofunction"
            lines += [f".. {kind}:: {name}", *(["   :members:"] * (kind == "autoclass")), ""]
        return self.parse_text_to_nodes("\n".join(["```{eval-rst}", *lines, "```"]))


def public_names(module: str) -> list[str]:
    """Return the names that the stub of a module hands on, modules left out."""
    folder = HERE.parent / module.replace(".", "/")
    stub = folder / "__init__.pyi" if folder.is_dir() else folder.with_suffix(".pyi")
    imports = [node for node in ast.parse(stub.read_text(encoding="utf-8")).body if isinstance(node, ast.ImportFrom)]
    return sorted({alias.name for node in imports if node.module != "photosite" for alias in node.names}, key=str.lower)


def mark_up(docstring: list[str]) -> list[str]:
    """Turn a docstring of plain text into reStructuredText: what is indented becomes a block, what has a name an item.

    >>> mark_up(["One * two.", "", "time_s: of `Shot`, > 0."])
    ['One \\\\* two.', '', '- **time_s**: of ``Shot``, > 0.', '']
    """
    found: list[str] = []
    for paragraph in re.split(r"\n\s*\n", "\n".join(docstring).strip("\n")):
        lines = paragraph.splitlines()
        if lines and all(line.startswith(" ") for line in lines):
            found += ["::", "", *(f"   {line}" for line in lines), ""]
        elif lines and lines[0].startswith(">>>"):
            found += [*lines, ""]
        else:
            whole = re.sub(r"`[^`]*`", lambda span: " ".join(span[0].split()), paragraph)  # a span in one line is not cut
            for item in re.split(r"\n(?=[\w, ]+: |- )", whole):
                text = " ".join(item.removeprefix("- ").split())
                named = re.fullmatch(r"([a-z]\w*(?:, [a-z]\w*)*): (.*)", text)
                bullet = "- " if named or item.startswith("- ") else ""
                found += [f"{bullet}**{named[1]}**: {escape(named[2])}" if named else bullet + escape(text), ""]
    return found


def escape(text: str) -> str:
    """Escape what reStructuredText would read as marks, outside of spans of code."""
    parts = re.split(r"`+([^`]+)`+", text)
    return "".join(f"``{part}``" if number % 2 else re.sub(r"([\\*|_])", r"\\\1", part) for number, part in enumerate(parts))


def mark_up_docstring(app: Sphinx, what: str, name: str, found: object, options: object, lines: list[str]) -> None:
    """Change the lines of a docstring in place, as autodoc asks for."""
    lines[:] = mark_up(lines)


def mark_up_page(app: Sphinx, name: str, text: list[str]) -> None:
    """Make targets of MyST from the anchors of a page, and let it link to the book's copies of the files above this folder."""
    text[0] = re.sub(r'<a id="(\w+)"></a>', r"(\1)=", text[0])
    for file in ("CHANGELOG", "CONTRIBUTING"):
        text[0] = text[0].replace(f"](../{file}.md", f"]({file.lower()}.md")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive and the docstrings' mark-up."""
    app.add_directive("public-names", PublicNames)
    app.connect("autodoc-process-docstring", mark_up_docstring)
    app.connect("source-read", mark_up_page)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
