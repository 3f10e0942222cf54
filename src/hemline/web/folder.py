"""A page in a folder that may hold other things: nothing is lost there, and visitors never meet half a page.

The parts of a page lie in a folder whose name depends on what they hold, so those of a new page come to lie beside
those of the old one. `index.html`, replaced as a whole when all parts are there, decides which page is shown. Only then
do the parts of the old page go, those that hemline wrote and nobody changed.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from hemline.errors import BadOutput
from hemline.files import check_folder, written_together, written_whole
from hemline.files.atomic import make_names_lasting
from hemline.files.waiting import held, release

from .assemble import FolderPage
from .file_list import INDEX, LIST, FileList, hash_of, is_file, is_our_index, part_folders, remove_listed


def check_page_folder(path: Path) -> None:
    """Refuse a folder that no page can be written to; nothing is made.

    Raises:
        BadOutput: It is the root or the home folder, it cannot be made or written to, or its `index.html` is not one
            that hemline wrote, or was changed since.
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
    """Write a page into a folder, made if need be; of what lies there, only an earlier page goes.

    Returns:
        The files of the page.

    Raises:
        BadOutput: As `check_page_folder`; or another hemline is writing a page there, or links lie where parts must.
    """
    folder, listed = Path(os.path.realpath(path)), FileList.of(page)
    place, contents = folder / page.place, {LIST: listed.as_bytes()} | dict(page.parts)
    try:
        with _create_folder(folder), _lock_folder(folder):
            check_page_folder(path)
            earlier = {each: old for each, old in part_folders(folder).items() if each != place}
            with _create_part_folders(place, listed):
                with written_together([place / name for name in contents], waiting_in=folder) as temporaries:
                    for temporary, content in zip(temporaries, contents.values(), strict=True):
                        temporary.write_bytes(content)
                for each in (place, folder):
                    make_names_lasting(each)
                with written_whole(folder / INDEX) as temporary:
                    temporary.write_bytes(page.index)
            for each, old in earlier.items():
                with suppress(OSError):  # the new page is there; the next one tries again
                    remove_listed(each, old)
    except OSError as error:
        raise _output_error(path, error) from error
    return tuple(sorted([path / INDEX, *(path / page.place / name for name in contents)]))


@contextmanager
def _create_folder(folder: Path) -> Iterator[None]:
    """Make a folder; where the work in it fails, folders that were made and are empty go again."""
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
    """Keep other hemlines from writing a page into a folder, or refuse where one does."""
    try:
        lock = held(folder)
    except BlockingIOError as error:
        got = "another hemline, which writes a page there"
        raise BadOutput(f"cannot write {folder}", got, "wait until it has ended") from error
    try:
        yield
    finally:
        release(lock)


@contextmanager
def _create_part_folders(place: Path, listed: FileList) -> Iterator[None]:
    """Make the folders of the parts; where the work fails before `index.html` leads to them, parts that are new go."""
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
