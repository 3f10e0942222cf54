"""What SECURITY.md says can be looked up: files, tests and pages that it names are there, and it invents no address."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "SECURITY.md").read_text()


def test_what_it_names_is_there():
    named = re.findall(r"`((?:tests|bodies)/[\w/.]+)`", TEXT)
    assert len(named) > 10
    for path in named:
        assert (ROOT / path).exists() or (ROOT / "src" / "hemline" / path).exists(), path
    for link in re.findall(r"\]\((?!https?:)([^)#]+)", TEXT):
        assert (ROOT / link).exists(), link


def test_each_promise_names_its_tests():
    promised = TEXT.split("## Promises")[1].split("## Limits")[0]
    for paragraph in promised.split("\n\n**")[1:]:
        assert "tests/" in paragraph, paragraph[:60]


def test_weaknesses_are_reported_in_private_and_to_no_made_up_address():
    assert "Report a vulnerability" in TEXT
    assert not re.search(r"[\w.+-]+@[\w-]+\.\w+", TEXT)
