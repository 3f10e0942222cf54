"""Several files, all or none."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

from hemline.errors import BadOutput
from hemline.files import written_whole


@contextmanager
def written_together(paths: Sequence[Path]) -> Iterator[list[Path]]:
    """Yield a temporary path for each; all take their final names when all are written.

    Raises:
        BadOutput: As `hemline.files.written_whole`, or one of the names is a folder's.
    """
    for path in paths:
        if path.is_dir():
            raise BadOutput(f"cannot write {path}", "a folder of that name", "choose another name")
    with ExitStack() as stack:
        yield [stack.enter_context(written_whole(path)) for path in paths]
