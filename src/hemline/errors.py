"""The tree of exceptions and warnings.

```
HemlineError
├── BadInput (also a ValueError)     the user's file or argument: exit status 2
│   ├── BadBody       betas, body files
│   ├── BadMotion     clips
│   ├── BadMesh       triangles
│   ├── BadGarment    mesh + TOML, pins, chains, materials
│   │   └── OffBody   a garment that is not on the body
│   ├── BadDataset    folders of takes
│   │   └── DamagedTake  a take that was read to its end and is incomplete; it can be made again
│   ├── BadModel      model files
│   ├── BadAnswer     answers from the page of a study
│   ├── BadCluster    a scheduler, its workers, the processes of a training
│   └── BadOutput     paths that cannot be written, unknown formats
├── MissingExtra (also an ImportError)   an optional library is not installed: exit status 2
└── SimulationFailed                     a take that could not be finished: exit status 1

HemlineWarning (a UserWarning)           the work continues with a worse result: one line on stderr
```

Every message states what is wrong, what was found and the cure: `skirt.toml: pins name vertex 4120; the mesh has 3980
vertices; count from 0`.
"""

from collections.abc import Sequence


class HemlineError(Exception):
    """Base class of all exceptions that hemline raises on purpose."""


class BadInput(HemlineError, ValueError):
    """Input that cannot be used as it is.

    Args:
        what: What is wrong, and where.
        got: What was found.
        cure: What the user can do about it.
    """

    def __init__(self, what: str, got: object, cure: str):
        self.what, self.got, self.cure = what, got, cure
        super().__init__(_one_line(what, got, cure))

    def __reduce__(self):
        return type(self), (self.what, self.got, self.cure)


class BadBody(BadInput):
    """Betas have the wrong length, or a file is not a body file."""


class BadMotion(BadInput):
    """A clip cannot be read or lacks a joint."""


class BadMesh(BadInput):
    """Cloth cannot be made of a triangle mesh."""


class BadGarment(BadInput):
    """Mesh, unit, pins, chains or material of a garment contradict each other."""


class OffBody(BadGarment):
    """A garment is not on the body; trying it on may help."""


class BadDataset(BadInput):
    """A dataset is damaged, or was made for something else."""


class DamagedTake(BadDataset):
    """A take was read and is truncated or damaged.

    A file that cannot be read at all (no permission, a failing disk), that a newer hemline wrote, or that holds another
    take than its name says raises `BadDataset` instead, since it may be intact.
    """


class BadModel(BadInput):
    """A file is damaged, of a future version, or not a model file."""


class BadAnswer(BadInput):
    """An answer from the page of a study cannot be stored. The page shows the message, so it names no clip."""


class BadCluster(BadInput):
    """A scheduler does not answer, workers cannot do the work, or processes do not fit a training."""


class BadOutput(BadInput):
    """A path cannot be written, or an ending names no known format."""


class MissingExtra(HemlineError, ImportError):
    """An optional library is needed and not installed.

    Args:
        module: The library's import name.
        extra: The extra of hemline that brings it.
        need: The purpose that needs the library.
    """

    def __init__(self, module: str, extra: str, need: str):
        self.module, self.extra, self.need = module, extra, need
        super().__init__(f"{need} needs {module}; it is not installed; run: pip install 'hemline[{extra}]'")

    def __reduce__(self):
        return type(self), (self.module, self.extra, self.need)


class SimulationFailed(HemlineError):
    """A step failed even at the smallest substep; the message names frame and reason."""


class HemlineWarning(UserWarning):
    """Input can be used, but the result will be worse.

    Args:
        what: What is doubtful; or the whole line, if a library that captured the warning issues it again by its text.
        got: What was found.
        cure: What the user can do about it.
    """

    def __init__(self, what: str, got: object = "", cure: str = ""):
        self.what, self.got, self.cure = what, got, cure
        super().__init__(_one_line(what, got, cure) if cure else what)

    def __reduce__(self):
        return type(self), (self.what, self.got, self.cure)


def list_names(names: Sequence[str], most: int = 12) -> str:
    """Returns names as text with commas, such as "a, b and 3 more" if there are more than `most`."""
    shown = ", ".join(names[:most])
    return f"{shown} and {len(names) - most} more" if len(names) > most else shown


def _one_line(what: str, got: object, cure: str) -> str:
    """Joins the parts in one line and replaces letters that cannot be printed, which a quoted file may contain."""
    return "".join(letter if letter.isprintable() else " " for letter in f"{what}; got {got}; {cure}")
