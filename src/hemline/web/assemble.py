"""The files of a page as bytes: one `.html` with everything, or an index and the parts that it loads."""

import base64
import gzip
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from html import escape
from importlib.resources import files

_PAGE = files("hemline.web") / "page"
_CORE = "./three.core.min.js"
_MODULES = {
    "three": "three.module.min.js",
    "three/core": "three.core.min.js",
    "three/OrbitControls.js": "OrbitControls.js",
}
"""Names by which modules import three.js, and the files of three.js."""
PARTS_PREFIX = "hemline-"
"""Prefix of the folder of parts; twelve digits follow, a hash of all contents of the page."""


@dataclass(frozen=True)
class FolderPage:
    """A page for a folder.

    Attributes:
        index: Content of `index.html`.
        place: Name of the folder of the parts, beside `index.html`; it is unique to the contents.
        parts: Content of each part, by its path in that folder.
    """

    index: bytes
    place: str
    parts: Mapping[str, bytes]


def one_file(title: str, data: bytes) -> bytes:
    """Makes a page in a single file.

    Args:
        title: Title of the page, plain text.
        data: Contents of the page, zipped.
    """
    modules = json.dumps(_sources(), sort_keys=True).encode()
    embedded = {
        "modules": gzip_bytes(modules),
        "contents": data,
        "kernels": gzip_bytes((_PAGE / "kernels.wasm").read_bytes()),
    }
    scripts = [
        f'<script type="application/octet-stream" id="{name}">{base64.b64encode(content).decode()}</script>'
        for name, content in embedded.items()
    ]
    return _html(title, "\n".join([*scripts, f"<script>\n{_text('boot_file.js')}</script>"]))


def folder_page(title: str, data: bytes) -> FolderPage:
    """Makes a page for a static web host.

    Args:
        title: Title of the page, plain text.
        data: Contents of the page, zipped.
    """
    own = {
        f"js/{name.removeprefix('hemline/')}": text for name, text in _sources().items() if name.startswith("hemline/")
    }
    parts = {name: text.encode() for name, text in own.items()}
    parts |= {f"three/{name}": (_PAGE / "three" / name).read_bytes() for name in (*_MODULES.values(), "LICENSE")}
    parts |= {"contents.bin": data, "kernels.wasm": (_PAGE / "kernels.wasm").read_bytes()}
    digest = sha256()
    for name, content in (("index.html", _index(title, PARTS_PREFIX)), *sorted(parts.items())):
        digest.update(f"{name} {len(content)}\n".encode() + content)
    place = PARTS_PREFIX + digest.hexdigest()[:12]
    return FolderPage(_index(title, place), place, parts)


def gzip_bytes(content: bytes) -> bytes:
    """Compresses bytes with gzip; equal inputs give equal outputs."""
    return gzip.compress(content, 6, mtime=0)


def _index(title: str, place: str) -> bytes:
    imports = {"hemline/": f"./{place}/js/"} | {name: f"./{place}/three/{file}" for name, file in _MODULES.items()}
    maps = f'<script type="importmap">{json.dumps({"imports": imports})}</script>'
    boot = _fill(_text("boot_folder.js"), {"parts": f"./{place}"})
    return _html(title, f'{maps}\n<script type="module">\n{boot}</script>')


def _sources() -> dict[str, str]:
    """Returns the text of all modules, by the names under which they are imported."""
    own = {
        f"hemline/{each.name}": each.read_text("utf-8")
        for each in (_PAGE / "js").iterdir()
        if each.name.endswith(".js")
    }
    three = {name: (_PAGE / "three" / file).read_text("utf-8") for name, file in _MODULES.items()}
    return own | three | {"three": three["three"].replace(_CORE, "three/core")}


def _html(title: str, boot: str) -> bytes:
    values = {"title": escape(title), "style": _text("page.css"), "boot": boot}
    return _fill(_text("page.html"), values).encode("utf-8", "replace")  # a title from undecodable bytes has "?"


def _fill(template: str, values: Mapping[str, str]) -> str:
    """Replaces names in double braces by their values, in one pass: braces in the values remain."""
    return re.sub(r"\{\{(\w+)\}\}", lambda match: values[match[1]], template)


def _text(name: str) -> str:
    return (_PAGE / name).read_text("utf-8")
