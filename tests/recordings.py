"""Changes of what a recording says about its scene, which a test then expects to be found or refused."""

import json
from typing import Any

import h5py

from supple.kinds.codec import decoded, encoded, kinds_by_name
from supple.model.system import System, build_system
from supple.results.recording import description


def set_in_scene(file: h5py.File, where: str, value: Any) -> None:
    """Replace a value of the description, such as "scene/joints/0/limits"; of arrays, see `replace_array`."""
    tree, inner, last = _found(file, where)
    inner[last] = encoded(value, kinds_by_name(), inline=1 << 20)[0]
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


def system_in(file: h5py.File) -> System:
    """The flat arrays of the scene that an open file describes."""
    arrays = {path: item[()] for path, item in _datasets(file["supple"])}
    tree = json.loads(file["supple/header"][()])["fields"]["scene"]
    return build_system(decoded(tree, arrays, description._classes(), lambda number: None))


def _datasets(group: h5py.Group) -> list[tuple[str, h5py.Dataset]]:
    found: list[tuple[str, h5py.Dataset]] = []
    group.visititems(lambda name, item: found.append((name, item)) if isinstance(item, h5py.Dataset) else None)
    return found
