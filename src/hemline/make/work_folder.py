"""The folder in which a model is made, beside the model file. It holds everything that a killed run continues with."""

import json
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hemline.errors import BadGarment, BadOutput
from hemline.files import atomic_write, check_folder, content_hash, read_bytes
from hemline.files.waiting import release_lock, take_lock

STATE_VERSION = 1
"""Version of `make.json`."""
LARGEST_MESH = 2**30
"""Largest size of a mesh file [bytes]."""
MOST_FOLDERS = 99
"""Largest number of folders for meshes that changed while a model of one name was made."""


@dataclass
class WorkFolder:
    """A folder of work in progress.

    ```
    jacket.making/
      make.json              inputs, plan, time spent
      garment.safetensors    the garment, tried on
      probe/ check/          datasets: two seconds that show what hangs; the clip on which methods are compared
      takes/ drapes/         datasets to fit to; `hemline fit` accepts them
      coarse/1500/           the same datasets of the mesh that was simulated, here of 1500 vertices, if it was coarser
      candidates/            a model of each method
    ```

    Attributes:
        folder: The folder.
        state: Contents of `make.json`.
        fresh: Whether the folder was made by this run.
    """

    folder: Path
    state: dict[str, Any]
    fresh: bool
    _since: float = 0.0

    @property
    def spent_s(self) -> float:
        """Time that this run and the runs that it continues have taken [s]."""
        return float(self.state["spent_s"]) + time.monotonic() - self._since

    def note(self, **entries: Any) -> None:
        """Writes entries and the time spent to `make.json`."""
        now = time.monotonic()
        self.state |= {"spent_s": self.state["spent_s"] + now - self._since} | entries
        self._since = now
        with atomic_write(self.folder / "make.json") as temporary:
            temporary.write_text(json.dumps(self.state, indent=1, sort_keys=True))


@contextmanager
def open_work_folder(model: Path, inputs: str) -> Iterator[WorkFolder]:
    """Opens the folder beside a model file, and locks it while it is in use.

    A folder that was made for other inputs is kept: a new one is made beside it.

    Args:
        model: The model file that will be written.
        inputs: Hash of everything that the work in the folder depends on, see `inputs_hash`.

    Raises:
        BadOutput: The folder cannot be written, or another run works in it.
    """
    for number in range(1, MOST_FOLDERS + 1):
        folder = model.with_suffix(".making" if number == 1 else f".making-{number}")
        state = _read_state(folder)
        if state is None or state["inputs"] == inputs:
            break
    else:
        raise BadOutput("too many folders of other meshes", f"{folder}", "delete the ones that are not needed")
    check_folder(folder)
    folder.mkdir(parents=True, exist_ok=True)
    try:
        lock = take_lock(folder)
    except BlockingIOError as reason:
        raise BadOutput(
            f"another run works in {folder}", "a locked folder", "wait for it, or name another -o"
        ) from reason
    try:
        new = {"version": STATE_VERSION, "inputs": inputs, "spent_s": 0.0}
        work = WorkFolder(folder, state or new, state is None, time.monotonic())
        work.note()
        try:
            yield work
        finally:
            work.note()
    finally:
        release_lock(lock)


def inputs_hash(garment: str, others: Mapping[str, Any]) -> str:
    """Returns a hash of a garment, by the bytes of its file if it is one, and of JSON-like values.

    Raises:
        BadGarment: The file cannot be read.
    """
    path = Path(garment.rpartition(":")[0] if not Path(garment).exists() and ":" in garment else garment)
    parts: list[str | bytes] = [path.name + garment.removeprefix(str(path)) if path.is_file() else garment]
    for file in (path, path.with_suffix(".toml")):
        if file.is_file():
            parts.append(read_bytes(file, LARGEST_MESH, error=BadGarment, cure="name a mesh file or a garment"))
    return content_hash(*parts, dict(others))


def _read_state(folder: Path) -> dict[str, Any] | None:
    """Returns what `make.json` holds; None if there is none, and an entry that fits no inputs if it is unreadable."""
    file = folder / "make.json"
    if not file.exists():
        return None
    try:
        state = json.loads(file.read_text())
        if state["version"] == STATE_VERSION and isinstance(state["inputs"], str) and state["spent_s"] >= 0:
            return state
    except (OSError, ValueError, KeyError, TypeError):
        pass
    return {"version": STATE_VERSION, "inputs": "", "spent_s": 0.0}
