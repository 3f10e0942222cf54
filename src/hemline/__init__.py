"""hemline: garments that move on virtual humans in real time, on an ordinary CPU, with no cloth inside the body.

```python
import hemline
body = hemline.bodies.load("anny24").shaped(betas=[0.5, -1.0])
cape = hemline.load("cape")
run = hemline.motions.load("run")
for frame in hemline.play(cape, body, run, fps=60):
    draw(frame.vertices, cape.garment.faces)
```
Importing hemline is light: each name below is loaded when it is first used.
"""

import importlib
from typing import TYPE_CHECKING, Any

from .version import VERSION as __version__

if TYPE_CHECKING:
    from . import bodies as bodies
    from . import datasets as datasets
    from . import errors as errors
    from . import export as export
    from . import garments as garments
    from . import metrics as metrics
    from . import motions as motions
    from . import pictures as pictures
    from . import sim as sim
    from .animators import fit as fit
    from .animators import load as load
    from .errors import HemlineError as HemlineError
    from .playback import Player as Player
    from .playback import crowd as crowd
    from .playback import detail_for as detail_for
    from .playback import evaluate as evaluate
    from .playback import play as play
    from .playback import record as record
    from .tryon import open_garment as open_garment

_ROOMS = ("bodies", "datasets", "errors", "export", "garments", "metrics", "motions", "pictures", "sim")
_NAMES = {
    "HemlineError": "errors",
    "Player": "playback",
    "crowd": "playback",
    "detail_for": "playback",
    "evaluate": "playback",
    "fit": "animators",
    "load": "animators",
    "open_garment": "tryon",
    "play": "playback",
    "record": "playback",
}

__all__ = [
    "HemlineError",
    "Player",
    "__version__",
    "bodies",
    "crowd",
    "datasets",
    "detail_for",
    "errors",
    "evaluate",
    "export",
    "fit",
    "garments",
    "load",
    "metrics",
    "motions",
    "open_garment",
    "pictures",
    "play",
    "record",
    "sim",
]


def __getattr__(name: str) -> Any:
    if name in _NAMES:
        value = getattr(importlib.import_module(f"hemline.{_NAMES[name]}"), name)
        globals()[name] = value
        return value
    if name in _ROOMS:
        return importlib.import_module(f"hemline.{name}")
    raise AttributeError(f"module 'hemline' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
