"""Writing of a page into a folder that may contain other files: none of them is lost, and no visitor sees half a page.

The parts of a page are in a folder whose name is a hash of their contents, so the parts of a new page are written
beside those of the old one. `index.html` is replaced as a whole when all parts are there. Only then are the parts of
the old page removed, as far as hemline wrote them and nobody changed them.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from hemline.errors import BadOutput
from hemline.files import atomic_write, atomic_writes, check_folder
from hemline.files.atomic import make_names_lasting
from hemline.files.waiting import release_lock, take_lock

from .assemble import FolderPage
from .file_list import INDEX, LIST, FileList, hash_of, is_file, is_our_index, part_folders, remove_listed


def check_page_folder(path: Path) -> None:
    """Refuses a folder to which no page can be written; nothing is created.

    Raises:
        BadOutput: It is the root or the home folder, it cannot be created or written to, or hemline did not write its
            `index.html`, or that was changed since.
    """
    folder = Path(os.path.realpath(path))
    if folder in (Path(folder.anchor), Path(os.path.realpath(os.path.expanduser("~")))):
        raise BadOutput("a page needs a folder of its own", folder, "name a folder in it")
    check_folder(path)
    index = path / INDEX
    try:
        if os.path.lexists(index) and not is_our_index(folder):
            changed = "a page of somebody else, of an older hemline, or one that was changed"
            got = changed if is_file(index) else "a link, or no file"
            raise BadOutput(f"{index} is not as hemline wrote it", got, "move it away, or name another folder")
    except OSError as error:
        raise _output_error(path, error) from error


def write_page_folder(path: Path, page: FolderPage) -> tuple[Path, ...]:
    """Writes a page into a folder, which is created if needed; only an earlier page in it is removed.

    Returns:
        The files of the page.

    Raises:
        BadOutput: See `check_page_folder`; or another hemline is writing a page there, or there are links in the place
            of parts.
    """
    folder, listed = Path(os.path.realpath(path)), FileList.of(page)
    place, contents = folder / page.place, {LIST: listed.as_bytes()} | dict(page.parts)
    try:
        with _create_folder(folder), _lock_folder(folder):
            check_page_folder(path)
            earlier = {each: old for each, old in part_folders(folder).items() if each != place}
            with _create_part_folders(place, listed):
                with atomic_writes([place / name for name in contents], waiting_in=folder) as temporaries:
                    for temporary, content in zip(temporaries, contents.values(), strict=True):
                        temporary.write_bytes(content)
                for each in (place, folder):
                    make_names_lasting(each)
                with atomic_write(folder / INDEX) as temporary:
                    temporary.write_bytes(page.index)
            for each, old in earlier.items():
                with suppress(OSError):  # the new page is there; the next one tries again
                    remove_listed(each, old)
    except OSError as error:
        raise _output_error(path, error) from error
    return tuple(sorted([path / INDEX, *(path / page.place / name for name in contents)]))


@contextmanager
def _create_folder(folder: Path) -> Iterator[None]:
    """Creates a folder; if the work in it fails, folders that were created and are empty are removed."""
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for each in missing:
            make_names_lasting(each.parent)
        yield
    except BaseException:
        for each in missing:
            with suppress(OSError):
                each.rmdir()
        raise


@contextmanager
def _lock_folder(folder: Path) -> Iterator[None]:
    """Locks a folder against other hemlines that write a page, or refuses where one does."""
    try:
        lock = take_lock(folder)
    except BlockingIOError as error:
        got = "another hemline, which writes a page there"
        raise BadOutput(f"cannot write {folder}", got, "wait until it has ended") from error
    try:
        yield
    finally:
        release_lock(lock)


@contextmanager
def _create_part_folders(place: Path, listed: FileList) -> Iterator[None]:
    """Creates the folders of the parts; if the work fails before `index.html` refers to them, removes new parts."""
    new = not place.exists()
    folders = [place, *(place / name for name in sorted({name.split("/")[0] for name in listed.parts if "/" in name}))]
    for each in (*folders, *(place / name for name in (LIST, *listed.parts))):
        if each.is_symlink():
            raise BadOutput(f"{each} is a link", f"one to {os.readlink(each)}", "remove it")
    try:
        for each in folders:
            each.mkdir(exist_ok=True)
        yield
    except BaseException:
        index = place.parent / INDEX
        if new and not (is_file(index) and hash_of(index) == listed.index):
            with suppress(OSError):
                remove_listed(place, listed)
        raise


def _output_error(path: Path, error: OSError) -> BadOutput:
    cure = "name a folder that can be made and written to"
    return BadOutput(f"cannot write {path}", error.strerror or error, cure)
