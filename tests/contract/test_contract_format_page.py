"""docs/format.md names every array of every kind of file, with its type."""

import re
from pathlib import Path

import pytest

from hemline.files import read_tensors
from tests.contract.made_models import body, ropes_model, small_cape

PAGE = (Path(__file__).parents[2] / "docs" / "format.md").read_text()
SHORT = {
    "float16": "f16",
    "float32": "f32",
    "float64": "f64",
    "int8": "i8",
    "int16": "i16",
    "int32": "i32",
    "uint8": "u8",
    "uint16": "u16",
}


def section(kind: str) -> str:
    """The part of the page on one kind of file."""
    (text,) = re.findall(rf"\n##+ `{kind}`.*?(?=\n## |\Z)", PAGE, re.DOTALL)
    return text


def named(text: str) -> dict[str, str]:
    """Array name to the dtype cell of its row, for all rows of the tables."""
    found = {}
    for row in re.findall(r"^\| (`[^|]*) \| ([^|]*) \|", text, re.MULTILINE):
        names = re.findall(r"`([\w.]+)`", row[0])
        prefix = names[0].rpartition(".")[0]
        for name in names:
            found[name if "." in name or not prefix else f"{prefix}.{name}"] = row[1]
            found[re.sub(r"\d$", "", names[0]) + name] = row[1]  # `weight0`, `1`, `2`
    return found


@pytest.mark.parametrize("kind", ["garment", "body", "model"])
def test_every_array_is_on_the_page_with_its_type(kind, tmp_path):
    from hemline.bodies.body_file import write_body

    path = tmp_path / "file.safetensors"
    {"garment": small_cape().save, "model": ropes_model().save, "body": lambda p: write_body(p, body().body)}[kind](
        path
    )
    rows = named(section(kind))
    for name, array in read_tensors(path, kind)[0].items():
        if name.startswith(("garment.", "shape.", "shape_basis.")):
            continue  # "the same" as another table or row
        assert name in rows, f"{name} is not in docs/format.md"
        assert SHORT[array.dtype.name] in rows[name], f"{name} is {array.dtype}, the page says {rows[name]}"


@pytest.mark.parametrize("kind", ["garment", "body", "model"])
def test_every_metadata_key_is_on_the_page(kind, tmp_path):
    from hemline.bodies.body_file import write_body

    path = tmp_path / "file.safetensors"
    {"garment": small_cape().save, "model": ropes_model().save, "body": lambda p: write_body(p, body().body)}[kind](
        path
    )
    for name in read_tensors(path, kind)[1]:
        assert f"`{name}`" in section(kind) + PAGE.split("## `body`")[0], f"metadata '{name}' is not in docs/format.md"
