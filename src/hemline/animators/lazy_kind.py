"""An animator by name: its options now, its fit and its model files when they are first used."""

import importlib
from collections.abc import Callable, Mapping
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np

from .base import Progress


class LazyKind:
    """An `AnimatorKind` whose code is imported on first use, so that playing an animator does not import its fit.

    Args:
        name: Name of the animator in model files and on the command line.
        Config: Class of the options of its fit.
        fit: What `AnimatorKind.fit` calls: a function, or `module:function` to import it on first use.
        of: What `AnimatorKind.of` calls: a function, or `module:Class.of` to import it on first use.
    """

    def __init__(self, name: str, Config: type, *, fit: str | Callable[..., Any], of: str | Callable[..., Any]):
        self.name, self.Config = name, Config
        self._fit, self._of = fit, of

    def fit(
        self,
        data: Any,
        config: Any = None,
        *,
        seed: int = 0,
        progress: Progress | None = None,
        checkpoints: Path | None = None,
    ) -> Any:
        """Fits the animator to data; see the function named by `fit` for what it returns and raises."""
        return _function(self._fit)(data, config, seed=seed, progress=progress, checkpoints=checkpoints)

    def of(self, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Any:
        """Reads the animator from the arrays and metadata of a model file; raises BadModel before anything runs."""
        return _function(self._of)(arrays, metadata)


def import_object(path: str) -> Any:
    """Imports the object that `module:name` or `module:Class.name` names, as entry points write it."""
    module, _, attributes = path.partition(":")
    return reduce(getattr, attributes.split("."), importlib.import_module(module))


def _function(named: str | Callable[..., Any]) -> Callable[..., Any]:
    return import_object(named) if isinstance(named, str) else named
