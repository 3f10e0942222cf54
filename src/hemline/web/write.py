"""A page as one file or in a folder, written whole or not at all."""

from pathlib import Path

from hemline.errors import BadOutput
from hemline.files import check_writable, written_whole
from hemline.files.tensors import tensor_bytes

from .assemble import folder_page, one_file, gzip_bytes
from .contents import PageContents
from .folder import check_page_folder, write_page_folder

PAGE_ENDING = ".html"
MEGABYTE = 1_000_000


def check_page(path: str | Path) -> None:
    """Refuse a path that no page can be written to, before the work is done.

    Args:
        path: A file that ends in `.html`, or a folder.

    Raises:
        BadOutput: Another ending, or it cannot be written, or the folder's `index.html` is not hemline's.
    """
    path = Path(path)
    if path.suffix.lower() == PAGE_ENDING:
        check_writable(path)
    elif path.suffix and not path.is_dir():
        raise BadOutput(
            f"no page is written to {path}", f"the ending '{path.suffix}'", "end in .html, or name a folder"
        )
    else:
        check_page_folder(path)


def write_page(
    path: str | Path, contents: PageContents, *, title: str, most_mb: float | None = None
) -> tuple[Path, ...]:
    """Write a page that plays models with no server.

    Args:
        path: A file that ends in `.html`, which opens by itself; or a folder, made if need be, for a static web host.
            What else lies in the folder stays; a page that hemline wrote there before is replaced.
        contents: What it plays.
        title: Its title, in plain text.
        most_mb: Refuse to write more than this [1,000,000 bytes]; None: any size.

    Returns:
        The files written.

    Raises:
        BadOutput: The page is larger than asked, the path has another ending or cannot be written, or the folder's
            `index.html` is not one that hemline wrote.
    """
    path = Path(path)
    check_page(path)
    data = gzip_bytes(tensor_bytes(contents.arrays, contents.metadata))
    if path.suffix.lower() == PAGE_ENDING:
        content = one_file(title, data)
        _check_size(len(content), most_mb)
        with written_whole(path) as temporary:
            temporary.write_bytes(content)
        return (path,)
    page = folder_page(title, data)
    _check_size(len(page.index) + sum(map(len, page.parts.values())), most_mb)
    return write_page_folder(path, page)


def _check_size(size: int, most_mb: float | None) -> None:
    if most_mb is not None and size > most_mb * MEGABYTE:
        cure = "name fewer models or clips, or allow more with --most-mb"
        raise BadOutput(f"the page must be of {most_mb:g} MB at most", f"{size / MEGABYTE:.1f} MB", cure)
