"""Files that another file names: beside it or below its folder, and nowhere else."""

from pathlib import Path, PureWindowsPath

from hemline.errors import BadInput


def beside(path: str | Path, name: str, what: str, *, error: type[BadInput], cure: str) -> Path:
    """The place of a file that another one names.

    Who sends a file must not choose which others of this machine are read. So names that are absolute, have a drive or
    lead upwards are refused, and links that lead out of the folder are as well. Nothing is opened.

    Args:
        path: The file that names it.
        name: What it is called there, with `/` between folders.
        what: What it is for, for the message, such as "a mesh".
        error: The class to raise.
        cure: What to do about it.

    Raises:
        error: The name leads out of the folder of `path`.
    """
    path = Path(path)
    windows = PureWindowsPath(name)
    outside = "\0" in name or ":" in name or windows.drive or windows.root or ".." in windows.parts
    try:
        folder, found = path.parent.resolve(), (path.parent / name).resolve()
        outside = outside or Path(name).is_absolute() or not found.is_relative_to(folder)
    except (OSError, RuntimeError, ValueError):  # a circle of links, or letters that no name can have
        outside = True
    if outside:
        raise error(f"{path} names {what} that is not beside it", f"'{name[:60]}'", cure)
    return path.parent / name
