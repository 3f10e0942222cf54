"""Works that docstrings name stand in docs/references.bib, by their real titles, and the other way round.

Two forms are read. In a `Source:`: authors, "Title", perhaps where, year; several works are separated by semicolons,
and of a title what stands before its colon will do. Elsewhere, for
a work that is known from a `Source:` or from the list alone: `Surname et al. 2020`, `Surname and Surname 1988`.
"""

import ast
import re
import unicodedata
from pathlib import Path

import pytest

from tests.promises.import_graph import files, name_of

ROOT = Path(__file__).parents[2]
SOURCE = re.compile(r"Source: (.*?)(?=Differs:|Source:|\n\s*\n|\Z)", re.DOTALL)
WORK = re.compile(r"^(?P<authors>[^\";]+), \"(?P<title>[^\"]+)\",(?: [^\";]+?,?)? (?P<year>[12]\d{3}|undated)\b")
MENTION = re.compile(r"\b([A-ZÀ-Ž](?=[\w-]*[a-z])[\w-]+)(?: et al\.,?| and [A-Z][\w-]+)? ((?:19|20)\d\d)\b")
PAGES = [ROOT / "README.md", ROOT / "NOTICE", *sorted((ROOT / "docs").glob("*.md"))]


def plain(text: str) -> str:
    """Without accents, TeX and case, as titles and names are compared."""
    text = re.sub(r"\\[\"'`^vcr=.~]?\{?|[{}\\]", "", text.replace("{\\ae}", "ae"))
    text = text.replace("æ", "ae").replace("ø", "o")
    return "".join(c for c in unicodedata.normalize("NFKD", text) if not unicodedata.combining(c)).lower()


def listed() -> dict[tuple[str, str], tuple[str, str]]:
    """Title and year of each entry: its key, and the surname of its first author."""
    found = {}
    for entry in (ROOT / "docs/references.bib").read_text().split("\n@")[0:]:
        field = dict(re.findall(r"^\s+(\w+)\s+= \{(.*)\},?$", entry, re.MULTILINE))
        surname = plain(field.get("author", "")).split(",")[0]
        key = re.findall(r"\w+\{(\w+),", entry)[0]
        found[plain(field["title"]), field["year"]] = (key, surname)
    return found


LISTED = listed()


def docstrings(path: Path) -> list[str]:
    """All texts that stand alone in a file: docstrings of modules, classes, functions and constants."""
    nodes = ast.walk(ast.parse(path.read_text()))
    return [n.value.value for n in nodes if isinstance(n, ast.Expr) and isinstance(getattr(n.value, "value", 0), str)]


def cited(path: Path) -> list[tuple[str, str, str]]:
    """Authors, title and year of each work of a file's sources; a clause that cannot be read is an error."""
    works = []
    for clause in (c for text in docstrings(path) for source in SOURCE.findall(text) for c in source.split("; ")):
        clause = " ".join(clause.split())
        match = WORK.match(clause)
        if match is None and '"' not in clause and works:
            continue  # a remark after a semicolon
        assert match, f'{name_of(path)}: write "Source: Authors, "Title", year", not "{clause}"'
        title = plain(match["title"])
        whole = [each for each, year in LISTED if each.startswith(f"{title}: ") and year == match["year"]]
        works.append((plain(match["authors"]), (whole or [title])[0], match["year"]))
    return works


READ = [*files(), *sorted((ROOT / "papers").rglob("*.py"))]
"""The package, and the experiments beside it."""
CITING = [path for path in READ if any("Source: " in text for text in docstrings(path))]


@pytest.mark.parametrize("path", CITING, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_sources_stand_in_the_list(path):
    for authors, title, year in cited(path):
        assert (title, year) in LISTED, f"{title}, {year}: add it to docs/references.bib"
        surname = LISTED[title, year][1]
        assert surname in authors, f"{title} is by {surname}, not by {authors}"


@pytest.mark.parametrize("path", [path for path in files() if "make" not in path.parts], ids=name_of)
def test_works_that_are_mentioned_stand_in_the_list(path):
    known = {(surname, year) for (_, year), (_, surname) in LISTED.items()}
    for surname, year in (found for text in docstrings(path) for found in MENTION.findall(text)):
        assert (plain(surname), year) in known, f"{surname} {year}: add it to docs/references.bib"


def test_works_in_the_list_are_named_somewhere():
    titles = {(title, year) for path in CITING for _, title, year in cited(path)}
    mentioned = {(plain(s), year) for path in READ for text in docstrings(path) for s, year in MENTION.findall(text)}
    pages = plain(" ".join(" ".join(path.read_text() for path in PAGES).split()))
    for (title, year), (key, surname) in LISTED.items():
        assert (title, year) in titles or (surname, year) in mentioned or title in pages, f"nobody names {key}"


def test_the_reader_sees_all_forms():
    assert len(CITING) > 20 and len(LISTED) > 20
    known = {key: surname for key, surname in LISTED.values()}
    assert known["baerentzen2005pseudonormal"] == "baerentzen" and known["bregier2025anny"] == "bregier"
    assert MENTION.findall("friction (Li et al. 2020, Eq. 14)") == [("Li", "2020")]
    assert WORK.match('Bishop, "Training", 1995.') and not WORK.match("Bishop 1995")
