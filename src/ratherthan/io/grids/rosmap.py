"""A map of the ROS map server enters (a YAML file that names an image); the ground leaves, with its place in the world.

A pixel's *shade* is the mean of its colours from 0 (black) to 1 (white); its *occupancy* p is 1 - shade, or shade with ``negate``.

========== ========================================================================================================
mode       a cell is
========== ========================================================================================================
trinary    occupied where p > ``occupied_thresh``, free where p < ``free_thresh``, else unknown
scale      the same, but between the thresholds its chance to be occupied rises from 0 to 1; unknown where the image is
           transparent
raw        occupied with p = value / 100, the value of a pixel as stored from 0 to 100; unknown above
========== ========================================================================================================

A robot can be where a cell is free, or occupied with a chance of at most one half; unknown cells count as occupied, unless it is asked otherwise. The first row of
the image is the top of the map, and the bottom of the world's frame is the lower edge of its last row: ``origin`` is the pose of the
lower left corner, in metres and radians.

References
----------
ROS 2 Navigation, nav2_map_server.
"""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError
from ratherthan.io._files import open_source
from ratherthan.io.grids.ground import Ground
from ratherthan.model.world import Frame

__all__ = ["read_rosmap"]

KINDS = ("open ground", "wall", "unknown")
KEYS = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode")
MODES = ("trinary", "scale", "raw")
LIKELY = 0.5
"""Above which chance to be occupied a cell is closed."""
MOST_PIXELS = 400_000_000


def read_rosmap(path: str | os.PathLike[str], *, unknown_free: bool = False) -> Ground:
    """Return the ground of a map of the map server.

    Parameters
    ----------
    path : path
        The YAML file; its image is looked for beside it.
    unknown_free : bool
        Whether unknown cells are free, occupied with a chance of one half.

    Raises
    ------
    SourceError
        If a file cannot be read, or says something that cannot be.
    """
    source = os.fspath(path)
    words = _words(source)
    mode = str(words.get("mode", "trinary")).lower()
    if mode not in MODES:
        raise SourceError(f"{source}: 'mode' must be one of {', '.join(MODES)}, got '{mode}'.", source=source)
    resolution = _number(words, "resolution", source)
    if not 0.0 < resolution < math.inf:
        raise SourceError(f"{source}: 'resolution' must be above 0 metres, got {resolution:g}.", source=source)
    frame = _frame(words, resolution, source)
    occupied, free = (_number(words, key, source) for key in ("occupied_thresh", "free_thresh"))
    if mode != "raw" and not 0.0 <= free < occupied <= 1.0:
        raise SourceError(
            f"{source}: 'free_thresh' must be below 'occupied_thresh', both from 0 to 1; got {free:g} and {occupied:g}.",
            source=source,
        )
    name = words.get("image")
    if not isinstance(name, str) or not name:
        raise SourceError(f"{source}: 'image' must name the file with the map's image, got {name!r}.", source=source)
    value, shade, opaque = _pixels(Path(source).parent / name, source)
    chance = shade if _truth(words.get("negate", 0), source) else 1.0 - shade
    if mode == "raw":
        unknown, chance = value > 100.0, np.minimum(value, 100.0) / 100.0
    elif mode == "scale":
        unknown = ~opaque
        chance = np.clip((chance - free) / (occupied - free), 0.0, 1.0)
    else:
        unknown = (chance <= occupied) & (chance >= free) | ~opaque
        chance = (chance > occupied).astype(np.float64)
    if unknown_free:
        chance = np.where(unknown, LIKELY, chance)
    opened = (unknown_free | ~unknown) & (chance <= LIKELY)
    return Ground(
        kinds=KINDS,
        kind=np.where(unknown, 2, np.where(opened, 0, 1)).astype(np.uint8),
        open=opened,
        water=np.zeros(opened.shape, dtype=np.bool_),
        doubt=np.where(opened, chance, 0.0),
        frame=frame,
        title=Path(source).stem,
    )


def _words(source: str) -> dict[str, Any]:
    """Return what the YAML file says."""
    import yaml

    with open_source(source) as file:
        data = file.read()
    try:
        words = yaml.safe_load(data.decode("utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        place = getattr(error, "problem_mark", None)
        line = "" if place is None else f", line {place.line + 1}"
        raise SourceError(
            f"{source}{line}: A map must be described in YAML, and this is none.", source=source
        ) from error
    if not isinstance(words, dict) or "image" not in words:
        raise SourceError(
            f"{source}: A map of the map server must say {', '.join(KEYS[:-1])}; got no 'image'.", source=source
        )
    return words


def _number(words: dict[str, Any], key: str, source: str) -> float:
    value = words.get(key)
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number) or isinstance(value, bool):
        raise SourceError(f"{source}: '{key}' must be a number, got {value!r}.", source=source, key=key)
    return number


def _frame(words: dict[str, Any], resolution: float, source: str) -> Frame:
    origin = words.get("origin")
    if not isinstance(origin, list) or len(origin) not in (2, 3):
        raise SourceError(f"{source}: 'origin' must be [x, y, yaw], got {origin!r}.", source=source)
    x, y, yaw = (_number({"origin": part}, "origin", source) for part in [*origin, 0.0][:3])
    return Frame(resolution=resolution, x=x, y=y, yaw=yaw)


def _truth(value: object, source: str) -> bool:
    if value in (0, 1, True, False):
        return bool(value)
    raise SourceError(f"{source}: 'negate' must be 0 or 1, got {value!r}.", source=source)


def _pixels(path: Path, source: str) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Return the stored value (of 0 to 255), the shade from 0 to 1, and whether it is opaque, of every pixel."""
    from PIL import Image, UnidentifiedImageError

    if not path.is_file():
        raise SourceError(
            f"{source}: 'image' must be a file beside it, but there is no '{path}'. Put it there, or mend the name.",
            source=source,
            path=str(path),
        )
    try:
        with Image.open(path) as image:
            if image.width * image.height > MOST_PIXELS:
                raise SourceError(
                    f"'{path}': An image must have at most {MOST_PIXELS} pixels, it has {image.width} × {image.height}.",
                    path=str(path),
                )
            image.load()
            deep = image.mode.startswith("I") or image.mode == "F"
            opaque = np.ones((image.height, image.width), dtype=np.bool_)
            if "A" in image.getbands() or "transparency" in image.info:
                opaque = np.asarray(image.convert("RGBA"))[:, :, 3] == 255
            if deep:
                stored = np.asarray(image, dtype=np.float64)
                most = 65535.0 if stored.max(initial=0.0) > 255.0 or image.mode.startswith("I;16") else 255.0
                shade = stored / most
            else:
                colours = np.asarray(image.convert("L" if image.mode in ("1", "L", "LA") else "RGB"), dtype=np.float64)
                shade = (colours if colours.ndim == 2 else colours.mean(axis=2)) / 255.0
    except (UnidentifiedImageError, OSError, ValueError, Image.DecompressionBombError) as error:
        raise SourceError(
            f"'{path}': The image of a map must be readable, but it is not ({error}).", path=str(path)
        ) from error
    return np.rint(shade * 255.0), shade, opaque
