"""Changes of what a recording says about its scene, which a test then expects to be found or refused."""

from __future__ import annotations

import json
from typing import Any

import h5py
from numpy.typing import NDArray

from supple.results.checkpoint.values import encoded
from supple.scene.joints.joint import Function


def set_in_scene(file: h5py.File, where: str, value: Any) -> None:
    """Replace a value of the description, such as "joints/0/limits"; of arrays, see `replace_array`."""
    tree, inner, last = _found(file, where)
    inner[last] = encoded(value, {"Function": Function})[0]
    _write(file, tree)


def remove_from_scene(file: h5py.File, where: str) -> None:
    """Remove an item of a tuple, such as "details/fields/3"."""
    tree, inner, last = _found(file, where)
    del inner[last]
    _write(file, tree)


def _found(file: h5py.File, where: str) -> tuple[Any, Any, Any]:
    """The tree, and in it what holds the value, under which key."""
    *path, last = where.split("/")
    tree = json.loads(file["supple/header"][()])
    inner = _inside(tree)
    for key in path:
        inner = _inside(inner[int(key) if isinstance(inner, list) else key])
    return tree, inner, int(last) if isinstance(inner, list) else last


def _inside(tree: Any) -> Any:
    """The fields of a class, or the items of a tuple or mapping."""
    if "fields" in tree:
        return tree["fields"]
    (content,) = tree.values()
    return content


def _write(file: h5py.File, tree: Any) -> None:
    del file["supple/header"]
    file["supple/header"] = json.dumps(tree)


def replace_array(file: h5py.File, where: str, values: NDArray[Any]) -> None:
    """Write an array of any shape in the place of one of the description."""
    del file[f"supple/{where}"]
    file[f"supple/{where}"] = values
