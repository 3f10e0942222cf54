"""`hemline demo --out DIR`."""

import json
import time
from dataclasses import dataclass
from pathlib import Path

from .evaluate import table
from .progress import note


@dataclass(frozen=True)
class DemoOptions:
    """Play the shipped cape on a shipped run, and the shipped T-shirt on bodies of three shapes."""

    out: Path = Path("out/demo")
    """Folder to write the .glb and .webp files and report.json to."""
    from_nothing: bool = False
    """Simulate, fit, animate and evaluate a light cape instead. It takes two to ten minutes on two cores and needs
    PyTorch."""
    json: bool = False
    """Print the figures of report.json as one JSON object."""


def run(options: DemoOptions) -> int:
    """Play, write, print the figures; status 1 if a vertex was inside the body."""
    from hemline.playback.demo import demo, demo_from_nothing

    began = time.perf_counter()
    make = demo_from_nothing if options.from_nothing else demo
    figures = make(options.out, say=note)
    if options.json:
        print(json.dumps(figures))
    else:
        print(table(figures))
        note(f"{time.perf_counter() - began:.1f} s")
    return 0 if all(each["inside_percent"]["after"] == 0 for each in figures.values()) else 1
