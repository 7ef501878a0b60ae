"""What the site has beside `docs/`: the repository's READMEs, a reference page for every module.

Links are written so that they work in the repository, and are turned here into the site's: to a
README, to a picture, or to a function's place in the reference, where [`name`](path/to/module.py)
is the anchor `module.name`. A link to what the site does not have stays as its text. Formulas
become MathML, which browsers draw without a script.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.structure.files import File

ROOT = Path(__file__).parents[1]
PACKAGES = ("flexsim", "controllers", "studies")
READMES = ("README.md", "controllers/README.md", "models/README.md", "studies/**/README.md")
PICTURES = (".png", ".gif", ".svg")
HERE, THERE, REFERENCE = "docs/", "repository/", "reference/"
LINK = re.compile(r"(!?)\[((?:`[^`]*`|[^\[\]`])*)\]\(([^()\s]+)\)")
FENCE = re.compile(r"^(```|~~~)")
BLOCK = re.compile(r'<(div|span) class="arithmatex">\\([\[(])(.*?)\\[\])]</\1>', re.S)
ENTITIES = {"&amp;": "&", "&lt;": "<", "&gt;": ">"}


def readmes() -> list[str]:
    """Return the READMEs' paths from the root."""
    found = [path for pattern in READMES for path in sorted(ROOT.glob(pattern))]
    return [path.relative_to(ROOT).as_posix() for path in found]


def modules() -> list[str]:
    """Return the modules' paths from the root."""
    found = (path for name in PACKAGES for path in sorted((ROOT / name).rglob("*.py")))
    return [path.relative_to(ROOT).as_posix() for path in found if path.name != "__main__.py"]


def dotted(module: str) -> str:
    """Return the dotted name of a module's path."""
    return module.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def on_config(config: Any) -> Any:
    """Add READMEs and reference to the navigation."""
    titles = {"README.md": "The front page", "controllers/README.md": "Controllers"}
    titles |= {"models/README.md": "Models", "studies/README.md": "All studies"}
    pages = [{titles.get(r) or r.split("/")[-2]: THERE + r} for r in readmes()]
    config.nav.append({"Findings": pages})
    config.nav.append({"Reference": [{name: _rooms(name)} for name in PACKAGES]})
    return config


def _rooms(package: str) -> list[dict[str, Any]]:
    """Return a package's pages, its own modules first, then room by room."""
    rooms: dict[str, list[dict[str, str]]] = {"": []}
    for module in modules():
        parts = module.split("/")
        if parts[0] == package:
            room = parts[1] if len(parts) > 2 else ""
            name = dotted(module).removeprefix(f"{package}.").removeprefix(f"{room}.")
            page = {name: REFERENCE + module.removesuffix(".py") + ".md"}
            rooms.setdefault(room, []).append(page)
    own = rooms.pop("")
    return [*own, *({room: pages} for room, pages in rooms.items())]


def on_files(files: Any, config: Any) -> Any:
    """Add the pages themselves, and the pictures that READMEs show."""
    for readme in readmes():
        text = (ROOT / readme).read_text(encoding="utf-8")
        files.append(File.generated(config, THERE + readme, content=text))
    for path in sorted(p for name in ("pictures", "studies", "models") for p in _pictures(name)):
        place = THERE + path.relative_to(ROOT).as_posix()
        files.append(File.generated(config, place, abs_src_path=str(path)))
    for module in modules():
        place = REFERENCE + module.removesuffix(".py") + ".md"
        text = f"# {dotted(module)}\n\n::: {dotted(module)}\n"
        files.append(File.generated(config, place, content=text))
    return files


def _pictures(folder: str) -> list[Path]:
    return [path for path in (ROOT / folder).rglob("*") if path.suffix in PICTURES]


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Turn links that work in the repository into links that work in the site."""
    place = page.file.src_uri
    if place.startswith(REFERENCE):
        return markdown
    source = place.removeprefix(THERE) if place.startswith(THERE) else HERE + place
    lines, fenced = [], False
    for line in markdown.split("\n"):
        if FENCE.match(line):
            fenced = not fenced
        code = fenced or line.startswith("    ")
        lines.append(line if code else LINK.sub(lambda m: _linked(m, source, place), line))
    return "\n".join(lines)


def _linked(found: re.Match[str], source: str, place: str) -> str:
    mark, text, target = found.groups()
    if re.match(r"[a-z]+:|#", target):
        return found.group()
    path, _, anchor = target.partition("#")
    path = posixpath.normpath(posixpath.join(posixpath.dirname(source), path))
    if path.startswith(HERE):
        to = path.removeprefix(HERE)
    elif path in readmes() or path.endswith(PICTURES):
        to = THERE + path
    elif path in modules():
        to = REFERENCE + path.removesuffix(".py") + ".md"
        name = text.strip("`") if text.startswith("`") else ""
        own = dotted(path)
        anchor = f"{own}.{name}" if name.isidentifier() or "." in name else own
    else:
        return text  # a file or folder that the site has no page of
    end = f"#{anchor}" if anchor else ""
    return f"{mark}[{text}]({posixpath.relpath(to, posixpath.dirname(place) or '.')}{end})"


def on_page_content(html: str, page: Any, config: Any, files: Any) -> str:
    """Turn formulas into MathML."""
    return BLOCK.sub(_formula, html)


def _formula(found: re.Match[str]) -> str:
    _, bracket, latex = found.groups()
    for entity, letter in ENTITIES.items():
        latex = latex.replace(entity, letter)
    return convert(latex.strip(), display="block" if bracket == "[" else "inline")
