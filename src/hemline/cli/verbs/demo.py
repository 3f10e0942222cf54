"""`hemline demo --out DIR`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hemline.cli.progress import note, steps


@dataclass(frozen=True)
class DemoOptions:
    """Play the shipped cape, the shipped T-shirt on bodies of three shapes, and a dress without a fit."""

    out: Path = Path("out/demo")
    """Folder to write the .glb and .webp files, report.json and index.html to."""
    from_nothing: bool = False
    """Simulate, fit, animate and evaluate a light cape instead.
    It takes two to ten minutes on two cores and needs PyTorch."""
    json: bool = False
    """Print the figures of report.json as one JSON object."""


def run(options: DemoOptions) -> int:
    """Plays the models and prints a summary; returns status 1 if a vertex was inside the body."""
    from hemline.playback.demo import DEMO_STEPS, demo, demo_from_nothing
    from hemline.web import write_demo_page

    if options.from_nothing:
        figures = demo_from_nothing(options.out, say=note)
    else:
        with steps(DEMO_STEPS + 1) as begin:
            figures = demo(options.out, say=begin)
            begin("writing a page that plays in a browser")
            write_demo_page(options.out, figures)
    print(json.dumps(figures) if options.json else summary(figures, options.out))
    return 0 if all(row["inside_percent"]["after"] == 0 for row in figures.values()) else 1


def summary(figures: dict[str, Any], folder: Path) -> str:
    """Formats the figures of a demo as six lines, with a column for each garment that was played.

    Args:
        figures: Figures by garment, as in `report.json`.
        folder: Folder of the files.
    """
    rows = figures.values()
    lines = {
        "played": list(figures),
        "ms per frame": [f"{row['frame_ms']['median']:.2f}" for row in rows],
        "vertices inside": [f"{row['inside_percent']['after']:.3g} %" for row in rows],
        "stretch (p99)": [f"{row['stretch_percent']['p99_mean']:.2g} %" for row in rows],
    }
    table = [f"{name:<17}" + "".join(f"{value:<14}" for value in values) for name, values in lines.items()]
    lines = [*(line.rstrip() for line in table), f"{'files':<17}{folder}, with all figures in report.json"]
    page = folder / "index.html"
    return "\n".join([*lines, f"{'open':<17}{page}"] if page.exists() else lines)
