"""The program hemline: where it is, and the words of its commands."""

import os
import shutil
from pathlib import Path

import bpy
import numpy as np

from .mesh_files import y_up
from .refused import Refused

OF_ONE_GARMENT = ("cape", "skirt", "knee-dress", "robe", "tshirt-light", "longsleeve-light", "trousers-light")
"""Shipped models of one garment; other models, and files, may play any."""
OF_CALM_AIR = ("tshirt-light", "longsleeve-light", "trousers-light", "lag", "skinned", "swingar")
"""Shipped models whose garments wind does not move; those of other models, and of files, it may."""


def executable(context) -> str:
    """Returns the path of the program: that of the preferences, otherwise the first one on the PATH.

    Raises:
        Refused: There is no program.
    """
    addon = context.preferences.addons.get(__package__)
    named = addon.preferences.executable if addon else ""
    found = shutil.which(bpy.path.abspath(named) if named else "hemline")
    if found is None:
        got = f"'{named}' is no program" if named else "none on the PATH"
        raise Refused(f"hemline was not found; got {got}; name it in Preferences > Add-ons > hemline garments")
    return found


def absolute_name(text: str) -> str:
    """Returns a shipped name unchanged, and a file with its absolute path."""
    return os.path.abspath(bpy.path.abspath(text)) if text.startswith("//") or Path(text).suffix else text


def rate(scene) -> float:
    """Returns the frames per second of a scene."""
    return scene.render.fps / scene.render.fps_base


def takes_garment(settings) -> bool:
    """Whether the model of the settings may play any garment; otherwise garment and mesh are not used."""
    return settings.model not in OF_ONE_GARMENT


def takes_wind(settings) -> bool:
    """Whether wind may move the garment of the model of the settings; otherwise it is not used."""
    return settings.model not in OF_CALM_AIR


def animate_words(settings, scene) -> list[str]:
    """Returns the words of `hemline animate` without mesh and output: all settings that change the result."""
    words = ["animate", absolute_name(settings.model), "--motion", absolute_name(settings.motion)]
    words += ["--fps", repr(settings.fps or rate(scene)), "--detail", f"{settings.detail:.6g}"]
    words += ["--garment", absolute_name(settings.garment)] if settings.garment and takes_garment(settings) else []
    words += ["--shapes", absolute_name(settings.shapes)] if settings.shapes else []
    words += ["--material", settings.material] if settings.material != "OWN" else []
    words += wind_words(settings) if takes_wind(settings) else []
    words += ["--start", f"{settings.start:.6g}"] if settings.start else []
    words += ["--seconds", f"{settings.seconds:.6g}"] if settings.seconds else []
    return words + body_words(settings) + ([] if settings.untangle else ["--no-untangle"])


def wind_words(settings) -> list[str]:
    """Returns the flag that lets wind blow, y up; without wind there is none."""
    wind = np.array(settings.wind)
    return ["--wind", *(f"{each:.4f}" for each in y_up(wind))] if wind.any() else []


def try_on_words(settings, garment: Path) -> list[str]:
    """Returns the words of `hemline tryon` for a garment file, without output."""
    return ["tryon", str(garment), *body_words(settings)]


def body_words(settings) -> list[str]:
    """Returns the flags that choose a body and its shape."""
    betas = np.trim_zeros(np.array(settings.betas), "b")
    words = ["--betas", *(f"{beta:.6g}" for beta in betas)] if len(betas) else []
    return words + (["--body", absolute_name(settings.body)] if settings.body else [])
