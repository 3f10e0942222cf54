"""`hemline warmup`."""

import time
from dataclasses import dataclass

from .progress import note


@dataclass(frozen=True)
class Arguments:
    """Compile all kernels now."""


def run(arguments: Arguments) -> int:
    """Run each stage once, on what ships, so that numba compiles and caches it."""
    from hemline.compiled import cache_folder
    from hemline.playback.warmup import STAGES

    for name, stage in STAGES.items():
        began = time.perf_counter()
        stage()
        note(f"{name:<12}{time.perf_counter() - began:6.1f} s")
    print(cache_folder())
    return 0
