"""What MkDocs is told at build time: all pages of the repository at their own paths, and pages of the Python interface.

Pages stay where they are read on GitHub, and so their links hold: a page of the site has the path that it has in the
repository. What a page links to and is no page (a script, a licence) goes along as a file; a folder becomes a list of
what is in it.
"""

import ast
import re
from pathlib import Path

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[2]
PLACES = (
    "*.md",
    "docs/**/*.md",
    "src/hemline/**/README.md",
    "papers/**/*.md",
    "integrations/**/README.md",
    "tests/**/README.md",
)
"""Where pages are."""
EXTRA = ("site.css", "formulas.js")
"""What mkdocs.yml adds to each page."""
LINK = re.compile(r"\]\(([^)\s#]+)(?:#[^)\s]*)?\)")
_FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)


def on_files(files: Files, config) -> Files:
    """Put the repository's pages in the place of those of `docs`, and expand the patterns of the navigation."""
    kept = Files([file for file in files if not (ROOT / "docs" / file.src_uri).exists()])  # those of the theme
    paths = {path for place in PLACES for path in ROOT.glob(place)}
    along = {each for page in paths for each in _linked(page)} | {ROOT / "docs/site" / name for name in EXTRA}
    for path in sorted(paths | along):
        name = path.relative_to(ROOT).as_posix()
        if path.is_dir():
            kept.append(File.generated(config, f"{name}/index.md", content=_listed(path)))
        else:
            kept.append(File.generated(config, name, abs_src_path=str(path)))
    for room, names in public().items():
        kept.append(File.generated(config, f"api/{room}.md", content=_described(room, names)))
    pages = [file.src_uri for file in kept if file.is_documentation_page()]
    config.nav = _expanded(config.nav, pages, _named(config.nav))
    return kept


def on_page_markdown(markdown: str, page, config, files) -> str:
    """Links to folders lead to their lists."""
    folder = (ROOT / page.file.src_uri).parent

    def led(link: re.Match) -> str:
        target = (folder / link[1]).resolve()
        if "://" in link[1] or not target.is_dir():
            return link[0]
        readme = f"{link[1].rstrip('/')}/{'README' if (target / 'README.md').exists() else 'index'}.md"
        return link[0].replace(link[1], readme)

    return LINK.sub(led, markdown)


def public() -> dict[str, list[str]]:
    """Rooms that promise names in `__all__`, the package itself first, each with its names.

    Names that a room passes on from other packages are described there.
    """
    doors = [ROOT / "src/hemline/__init__.py", *sorted(ROOT.glob("src/hemline/*/__init__.py"))]
    found = {}
    for door in doors:
        foreign: set[str] = set()
        for node in ast.parse(door.read_text()).body:
            if isinstance(node, ast.ImportFrom) and node.level == 0 and not node.module.startswith("hemline"):
                foreign |= {alias.asname or alias.name for alias in node.names}
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
                found[door.parent.name] = [name for name in ast.literal_eval(node.value) if name not in foreign]
    return found


def _described(room: str, names: list[str]) -> str:
    """A page of the Python interface: each name with its docstring."""
    module = "hemline" if room == "hemline" else f"hemline.{room}"
    if room == "hemline":
        rooms = public()
        names = [name for name in names if name not in rooms and not name.startswith("__")]
        door = [f"- [`hemline.{each}`]({each}.md)" for each in rooms if each != "hemline"]
        head = ["# hemline", "", "What `import hemline` gives; its rooms:", "", *door]
    else:
        head = [f"# hemline.{room}", "", f"::: {module}", "    options:", "      members: []"]
    parts = [f"## `{name}`\n\n::: {module}.{name}\n    options:\n      heading_level: 3" for name in names]
    return "\n".join(head) + "\n\n" + "\n\n".join(parts) + "\n"


def _linked(page: Path) -> set[Path]:
    """What a page links to that is no page."""
    text = _FENCE.sub("", page.read_text())
    found = {(page.parent / link).resolve() for link in LINK.findall(text) if "://" not in link}
    found = {path for path in found if path.exists() and path.suffix != ".md" and path != ROOT}
    return {path for path in found if not (path.is_dir() and (path / "README.md").exists())}


def _listed(folder: Path) -> str:
    """A page for a folder: the files in it, with the first lines of scripts."""
    lines = [f"# {folder.relative_to(ROOT).as_posix()}", ""]
    for path in sorted(folder.iterdir()):
        said = (ast.get_docstring(ast.parse(path.read_text())) or "") if path.suffix == ".py" else ""
        lines.append(f"- `{path.name}`" + (f": {said.splitlines()[0]}" if said else ""))
    return "\n".join(lines) + "\n"


def _named(nav) -> set[str]:
    """Pages that the navigation names one by one."""
    if isinstance(nav, str):
        return set() if "*" in nav else {nav}
    return {name for each in (nav.values() if isinstance(nav, dict) else nav) for name in _named(each)}


def _expanded(nav, pages: list[str], named: set[str]):
    """The navigation with pages in the place of patterns; a page stands where a pattern finds it first."""
    if isinstance(nav, dict):
        return {title: _expanded(each, pages, named) for title, each in nav.items()}
    if isinstance(nav, str) and "*" not in nav:
        return nav
    if isinstance(nav, str):
        found = [page for page in pages if _fits(page, nav) and page not in named]
        named.update(found)
        return found
    made = []
    for each in nav:
        part = _expanded(each, pages, named)
        made += part if isinstance(each, str) and "*" in each else [part]
    return made


def _fits(page: str, pattern: str) -> bool:
    """Whether a path is one of a pattern, where `*` stays within a folder."""
    plain = re.escape(pattern).replace(r"\*\*/", "(?:.*/)?").replace(r"\*", "[^/]*")
    return re.fullmatch(plain, page) is not None
