"""The size of a model on disk."""

from pathlib import Path

from hemline.errors import BadModel


def model_mb(path: str | Path) -> float:
    """Size of a file [MB, 10^6 bytes].

    Raises:
        BadModel: There is no such file.
    """
    try:
        return Path(path).stat().st_size / 1e6
    except OSError as error:
        raise BadModel(f"cannot read {path}", error.strerror or error, "name a model file") from error
