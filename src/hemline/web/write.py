"""Writing of a page, as one file or into a folder, whole or not at all."""

from pathlib import Path

from hemline.errors import BadOutput
from hemline.files import atomic_write, check_writable
from hemline.files.tensors import tensor_bytes

from .assemble import folder_page, gzip_bytes, one_file
from .contents import PageContents
from .folder import check_page_folder, write_page_folder

PAGE_ENDING = ".html"
MEGABYTE = 1_000_000


def check_page(path: str | Path) -> None:
    """Refuses a path to which no page can be written, before any work is done.

    Args:
        path: A file that ends in `.html`, or a folder.

    Raises:
        BadOutput: The path has another ending or cannot be written, or hemline did not write the `index.html` in it.
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
    """Writes a page that plays models without a server.

    Args:
        path: A file that ends in `.html`, or a folder for a static web host, which is created if needed. Other files in
            the folder are kept; a page that hemline wrote there before is replaced.
        contents: Contents of the page.
        title: Title of the page, plain text.
        most_mb: Largest size of the page [1,000,000 bytes]; None: any size.

    Returns:
        The files written.

    Raises:
        BadOutput: The page is too large, the path has another ending or cannot be written, or hemline did not write the
            `index.html` in the folder.
    """
    path = Path(path)
    check_page(path)
    data = gzip_bytes(tensor_bytes(contents.arrays, contents.metadata))
    if path.suffix.lower() == PAGE_ENDING:
        content = one_file(title, data)
        _check_size(len(content), most_mb)
        with atomic_write(path) as temporary:
            temporary.write_bytes(content)
        return (path,)
    page = folder_page(title, data)
    _check_size(len(page.index) + sum(map(len, page.parts.values())), most_mb)
    return write_page_folder(path, page)


def _check_size(size: int, most_mb: float | None) -> None:
    if most_mb is not None and size > most_mb * MEGABYTE:
        cure = "name fewer models or clips, or allow more with --most-mb"
        raise BadOutput(f"the page must be of {most_mb:g} MB at most", f"{size / MEGABYTE:.1f} MB", cure)
