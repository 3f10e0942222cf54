"""Size of a model file."""

from pathlib import Path

from hemline.errors import BadModel


def model_mb(path: str | Path) -> float:
    """Returns the size of a file [MB, 10^6 bytes].

    Raises:
        BadModel: The file does not exist.
    """
    try:
        return Path(path).stat().st_size / 1e6
    except OSError as error:
        raise BadModel(f"cannot read {path}", error.strerror or error, "name a model file") from error
