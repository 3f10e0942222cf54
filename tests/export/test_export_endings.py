"""The help of the program, README and docs name exactly the formats of `hemline.export.write.FORMATS`."""

import re
from pathlib import Path

import pytest

from hemline.cli.verbs.animate import AnimateOptions
from hemline.cli.verbs.export import ExportOptions
from hemline.export.write import FORMATS, PICTURES, QUANTIZED_ENDINGS, SKINNED_ENDINGS

ROOT = Path(__file__).parents[2]
ENDING = re.compile(r"(?<![\w/])\.[a-z0-9]+\b")


def help_of(options: type, field: str) -> str:
    """The help of an option: the string below its field."""
    source = (ROOT / "src" / f"{options.__module__.replace('.', '/')}.py").read_text()
    found = re.search(rf'^    {field}: [^\n]*\n    """(.*?)"""', source, re.MULTILINE | re.DOTALL)
    assert found, f"no help of {field}"
    return found[1]


def test_the_help_of_export_names_all_endings():
    assert sorted(ENDING.findall(help_of(ExportOptions, "output"))) == sorted(FORMATS)


@pytest.mark.parametrize("options", [AnimateOptions, ExportOptions])
def test_the_help_of_flags_names_the_endings_that_know_them(options):
    assert ENDING.findall(help_of(options, "skinned")) == list(SKINNED_ENDINGS)
    assert ENDING.findall(help_of(options, "quantized")) == list(QUANTIZED_ENDINGS)


def test_the_readme_names_only_formats_that_exist_and_all_but_pictures_of_them():
    (line,) = [line for line in (ROOT / "README.md").read_text().splitlines() if "also .usdc" in line]
    named = set(re.findall(r"\.[a-z0-9]+\b", line)) - {".safetensors"}
    assert named <= set(FORMATS) and set(FORMATS) - named <= set(PICTURES)


def test_the_table_of_the_docs_has_a_row_for_each_format():
    text = (ROOT / "docs/export.md").read_text()
    rows = [row.split("|")[1] for row in text.splitlines() if row.startswith("| `.")]
    assert {ending for row in rows for ending in ENDING.findall(row)} == {*FORMATS, ".vrm"}
