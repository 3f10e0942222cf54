"""Copies files so that each is complete at every moment."""

import os
import shutil
import tempfile
from pathlib import Path


def copy_files(sources: list[str], targets: list[Path]) -> None:
    """Copies files, all or none; each target is complete at every moment, either old or new."""
    with tempfile.TemporaryDirectory(dir=targets[0].parent) as waiting:
        copies = [
            shutil.copyfile(source, Path(waiting) / target.name)
            for source, target in zip(sources, targets, strict=True)
        ]
        before = [link_or_copy(target, Path(waiting) / f"{target.name}.before") for target in targets]
        try:
            for copy, target in zip(copies, targets, strict=True):
                os.replace(copy, target)
        except OSError:
            for copy, target, old in zip(copies, targets, before, strict=True):
                if not copy.exists() and old is None:
                    os.unlink(target)
                elif not copy.exists():
                    os.replace(old, target)
            raise


def link_or_copy(path: Path, name: Path) -> Path | None:
    """Links a file to a second name, or copies it where the disk has no links; returns None without a file."""
    if not path.is_file():
        return None
    try:
        os.link(path, name)
    except OSError:
        shutil.copyfile(path, name)
    return name
