"""Resolves names of files that another file refers to, which must lie in its folder or below."""

from pathlib import Path, PureWindowsPath

from hemline.errors import BadInput


def beside(path: str | Path, name: str, what: str, *, error: type[BadInput], cure: str) -> Path:
    """Returns the path of a file that another file names.

    The sender of a file must not choose which other files of this machine are read. Therefore names that are absolute,
    have a drive or lead upwards are refused, and so are links that lead out of the folder. Nothing is opened.

    Args:
        path: The file that contains the name.
        name: The name, with `/` between folders.
        what: Purpose of the named file for the message, such as "a mesh".
        error: Class of the exception.
        cure: Cure for the message.

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
