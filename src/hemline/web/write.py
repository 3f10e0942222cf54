"""A page as one file or as a folder, written whole or not at all."""

import base64
import gzip
import json
import shutil
import tempfile
from contextlib import suppress
from html import escape
from importlib.resources import files
from pathlib import Path

from hemline.errors import BadOutput
from hemline.files import check_folder, check_writable, written_whole
from hemline.files.tensors import tensor_bytes

from .contents import PageContents

ENDING = ".html"
MEGABYTE = 1_000_000
_PAGE = files("hemline.web") / "page"
_CORE = "./three.core.min.js"
_MODULES = {
    "three": "three.module.min.js",
    "three/core": "three.core.min.js",
    "three/OrbitControls.js": "OrbitControls.js",
}
"""Names by which modules import three.js, and its files."""


def check_page(path: str | Path) -> None:
    """Refuse a path that no page can be written to, before the work is done.

    Args:
        path: A file that ends in `.html`, or a folder.

    Raises:
        BadOutput: Another ending, or it cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() == ENDING:
        check_writable(path)
    elif path.suffix and not path.is_dir():
        raise BadOutput(
            f"no page is written to {path}", f"the ending '{path.suffix}'", "end in .html, or name a folder"
        )
    else:
        check_folder(path)


def write_page(
    path: str | Path, contents: PageContents, *, title: str, most_mb: float | None = None
) -> tuple[Path, ...]:
    """Write a page that plays models with no server.

    Args:
        path: A file that ends in `.html`, which opens by itself; or a folder, made if need be, for a static web host.
        contents: What it plays.
        title: Its title.
        most_mb: Refuse to write more than this [1,000,000 bytes]; None: any size.

    Returns:
        The files written.

    Raises:
        BadOutput: The page is larger than asked, the path has another ending or cannot be written, or the folder holds
            what is no page.
    """
    path = Path(path)
    check_page(path)
    data = _zipped(tensor_bytes(contents.arrays, contents.metadata))
    made = {"": _file(title, data)} if path.suffix.lower() == ENDING else _folder(title, data)
    size = sum(map(len, made.values())) / MEGABYTE
    if most_mb is not None and size > most_mb:
        cure = "name fewer models or clips, or allow more with --most-mb"
        raise BadOutput(f"the page must be of {most_mb:g} MB at most", f"{size:.1f} MB", cure)
    if path.suffix.lower() == ENDING:
        with written_whole(path) as temporary:
            temporary.write_bytes(made[""])
        return (path,)
    return _write_folder(path, made)


def _file(title: str, data: bytes) -> bytes:
    modules = json.dumps(_sources(), sort_keys=True).encode()
    held = {"modules": _zipped(modules), "contents": data, "kernels": _zipped((_PAGE / "kernels.wasm").read_bytes())}
    scripts = [
        f'<script type="application/octet-stream" id="{name}">{base64.b64encode(content).decode()}</script>'
        for name, content in held.items()
    ]
    return _html(title, "\n".join([*scripts, f"<script>\n{_text('boot_file.js')}</script>"]))


def _folder(title: str, data: bytes) -> dict[str, bytes]:
    """Content by name within the folder."""
    own = {
        f"js/{name.removeprefix('hemline/')}": text for name, text in _sources().items() if name.startswith("hemline/")
    }
    parts = {name: text.encode() for name, text in own.items()}
    parts |= {f"three/{name}": (_PAGE / "three" / name).read_bytes() for name in (*_MODULES.values(), "LICENSE")}
    parts |= {"contents.bin": data, "kernels.wasm": (_PAGE / "kernels.wasm").read_bytes()}
    imports = {"hemline/": "./js/"} | {name: f"./three/{file}" for name, file in _MODULES.items()}
    maps = f'<script type="importmap">{json.dumps({"imports": imports})}</script>'
    return parts | {"index.html": _html(title, f'{maps}\n<script type="module">\n{_text("boot_folder.js")}</script>')}


def _write_folder(path: Path, made: dict[str, bytes]) -> tuple[Path, ...]:
    """Beside the folder first; what was a page there is replaced as a whole."""
    if path.is_dir() and any(path.iterdir()) and not (path / "contents.bin").is_file():
        raise BadOutput(f"{path} holds something else than a page", "a folder that is not empty", "name another folder")
    cure = "name a folder that can be made and written to"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        whole = Path(tempfile.mkdtemp(prefix=f".{path.name}-", dir=path.parent))
        try:
            for name, content in made.items():
                (whole / name).parent.mkdir(exist_ok=True)
                (whole / name).write_bytes(content)
            whole.chmod(0o755)
            if path.exists():
                shutil.rmtree(path)
            whole.replace(path)
        finally:
            with suppress(OSError):
                shutil.rmtree(whole)
    except OSError as error:
        raise BadOutput(f"cannot write {path}", error.strerror or error, cure) from error
    return tuple(path / name for name in sorted(made))


def _sources() -> dict[str, str]:
    """All modules by the names that import them."""
    own = {
        f"hemline/{each.name}": each.read_text("utf-8")
        for each in (_PAGE / "js").iterdir()
        if each.name.endswith(".js")
    }
    three = {name: (_PAGE / "three" / file).read_text("utf-8") for name, file in _MODULES.items()}
    return own | three | {"three": three["three"].replace(_CORE, "three/core")}


def _html(title: str, boot: str) -> bytes:
    held = {"title": escape(title), "style": _text("page.css"), "boot": boot}
    text = _text("page.html")
    for name, content in held.items():
        text = text.replace("{{" + name + "}}", content)
    return text.encode()


def _text(name: str) -> str:
    return (_PAGE / name).read_text("utf-8")


def _zipped(content: bytes) -> bytes:
    return gzip.compress(content, 9, mtime=0)
