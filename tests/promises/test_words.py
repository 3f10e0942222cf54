"""The package speaks plain English: names, docstrings and pages that a reader who knows only the field understands."""

import re

import pytest

from benchmarks.figures import PAGE, SOURCE, page, read_tables
from tests.promises.pages import ROOT
from tests.promises.words import BANNED, ELLIPTIC, PARTICIPLE, banned, ellipses, participles, shared_names

SHARED: dict[str, str] = {}
"""Names that several classes may have, each with its reason; four at most."""


def test_few_functions_are_named_by_a_participle():
    found, count = participles()
    assert count > 2500
    assert len(found) <= 0.05 * count, "\n".join(found)


def test_every_docstring_can_be_read_alone():
    assert ellipses() == []


def test_no_two_classes_share_a_name():
    assert len(SHARED) <= 4
    assert {name: at for name, at in shared_names().items() if name not in SHARED} == {}


def test_no_name_holds_a_private_word():
    assert banned() == []


@pytest.mark.parametrize("text, elliptic", [("Of no pairs.", True), ("Official.", False), ("As the paper.", True)])
def test_the_reader_knows_an_ellipsis(text, elliptic):
    assert bool(ELLIPTIC.match(text)) == elliptic


def test_the_reader_knows_a_participle_and_a_private_word():
    assert PARTICIPLE.fullmatch("told") and PARTICIPLE.fullmatch("settled") and not PARTICIPLE.fullmatch("settle")
    assert "told" in BANNED


def test_the_glossary_is_short_and_sorted():
    page = (ROOT / "docs" / "glossary.md").read_text()
    terms = re.findall(r"^\| ([\w -]+) \| [A-Z]", page, re.MULTILINE)
    assert 10 < len(terms) <= 20 and terms == sorted(terms)


@pytest.mark.parametrize("name, most", [("README.md", 80), ("docs/design.md", 80)])
def test_pages_that_all_read_are_short(name, most):
    assert len((ROOT / name).read_text().splitlines()) <= most


def test_tables_of_figures_have_one_number_a_cell():
    for name in ("README.md", "docs/figures.md"):
        rows = [line for line in (ROOT / name).read_text().splitlines() if line.startswith("|") and "---" not in line]
        for row in rows:
            cells = [cell.strip() for cell in row.strip("|").split("|")]
            assert not any(re.search(r"\d[^|]*;[^|]*\d", cell) for cell in cells), row


def test_the_page_of_figures_is_what_its_source_says():
    tables = read_tables(SOURCE.read_text())
    assert sum(len(table.rows) for table in tables) > 60
    assert page(tables) == PAGE.read_text()
