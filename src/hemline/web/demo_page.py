"""The page of the demo: what was played, its figures, and a page to play with. It opens without a server."""

import html
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hemline import animators, bodies, motions
from hemline.files import atomic_write

from .contents import page_contents
from .write import write_page

MODELS, CLIPS = ("cape", "tshirt-light"), ("walk", "dance")
"""Models and clips of the page to play with."""
CAPTIONS = {
    "cape": "The shipped cape on a run, by rope chains.",
    "tshirt": "The shipped T-shirt on three bodies, by AgentDress.",
    "dress": "A dress that no model was fitted to, simulated while it is shown (live).",
}
"""Captions of the moving pictures, by the name of the file."""
COLUMNS = {
    "frame, median [ms]": lambda row: f"{row['frame_ms']['median']:.2f}",
    "vertices inside the body [%]": lambda row: f"{row['inside_percent']['after']:.3g}",
    "stretch, p99 [%]": lambda row: f"{row['stretch_percent']['p99_mean']:.1f}",
    "vertices": lambda row: f"{row['vertices']}",
}
"""Figures of a garment by heading."""
COMMANDS = (
    "hemline animate --garment my_dress.obj -m dance -o dance.glb",
    "hemline make my_dress.obj -o dress.safetensors",
    "hemline view cape",
)
"""Commands to try next."""
STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #222 }
table { border-collapse: collapse } td, th { padding: .3rem .7rem; border-bottom: 1px solid #ddd; text-align: right }
td:first-child, th:first-child { text-align: left } figure { margin: 1rem 0 } img { max-width: 100% }
figcaption { color: #555 } pre { background: #f5f5f5; padding: .7rem; white-space: pre-wrap }
"""


def write_demo_page(folder: Path, figures: Mapping[str, Mapping[str, Any]]) -> Path:
    """Writes `index.html`, and `play.html`, on which visitors play with the cape and the T-shirt; returns the first.

    Args:
        folder: Folder of the files of the demo.
        figures: Figures of each garment by name, as in `report.json`.

    Raises:
        BadOutput: The folder cannot be written.
    """
    shown = {name: animators.load(name) for name in MODELS}
    clips = {name: motions.load(name) for name in CLIPS}
    contents = page_contents(shown, clips, bodies.load("anny24").shaped())
    write_page(folder / "play.html", contents, title="hemline")
    page = "\n".join(
        [
            f"<title>hemline</title><style>{STYLE}</style>",
            "<h1>hemline</h1>",
            "<p><a href='play.html'>Play with the cape and the T-shirt</a> in this browser: change the motion, the "
            "speed, the shape of the body.</p>",
            *(_picture(folder, name, caption) for name, caption in CAPTIONS.items()),
            _table(figures),
            f"<h2>Files</h2><ul>{''.join(map(_file, sorted(folder.glob('*.glb'))))}</ul>",
            f"<h2>Next</h2><pre>{html.escape(chr(10).join(COMMANDS))}</pre>",
        ]
    )
    path = folder / "index.html"
    with atomic_write(path) as temporary:
        temporary.write_text(f'<!doctype html><html lang="en"><meta charset="utf-8">\n{page}\n</html>\n', "utf-8")
    return path


def _picture(folder: Path, name: str, caption: str) -> str:
    """Returns a moving picture with its caption; nothing if it was not made."""
    file = f"{name}.webp"
    if not (folder / file).exists():
        return ""
    return f"<figure><img src='{file}' alt=''><figcaption>{html.escape(caption)}</figcaption></figure>"


def _table(figures: Mapping[str, Mapping[str, Any]]) -> str:
    head = "".join(f"<th>{heading}</th>" for heading in COLUMNS)
    rows = "".join(
        f"<tr><td>{html.escape(name)}</td>{''.join(f'<td>{cell(row)}</td>' for cell in COLUMNS.values())}</tr>"
        for name, row in figures.items()
    )
    return f"<table><tr><th>garment</th>{head}</tr>{rows}</table>"


def _file(path: Path) -> str:
    size = path.stat().st_size / 1e6
    return f"<li><a href='{path.name}'>{path.name}</a>, {size:.0f} MB: for Blender, Unity, Godot and the web</li>"
