"""Dotted paths into the data of a scene file: `bodies.bear.material.youngs`."""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping
from typing import Any

from supple.app.scene_file.document import json_schema
from supple.errors import SceneError
from supple.kinds.suggestion import suggestion

_UNIT = re.compile(r"\[([^\[\]\d,][^\[\],]*)\]")


def with_values(data: Any, values: Mapping[str, Any]) -> Any:
    """A copy of the data with the value at each path replaced, or added to its mapping.

    A path consists of keys with points between them. An entry of a list is given by its number, from 0, or by its
    `name`. Mappings that are absent in the data are made.

    Raises
    ------
    SceneError : where a path leads to no place in the data; the text begins with the path.
    """
    data = copy.deepcopy(data)
    for path, value in values.items():
        keys = path.split(".")
        place = data
        for k, key in enumerate(keys[:-1]):
            place = _below(place, key, path, ".".join(keys[:k]))
        _set(place, keys[-1], copy.deepcopy(value), path, ".".join(keys[:-1]))
    return data


def value_at(data: Any, path: str) -> Any:
    """The value at a path, as `with_values` has paths; None where the data has none.

    Raises
    ------
    SceneError : where a path leads to no place in the data; the text begins with the path.
    """
    place, keys = data, path.split(".")
    for k, key in enumerate(keys):
        above = ".".join(keys[:k])
        if isinstance(place, list):
            place = place[_entry(place, key, path, above)]
        elif isinstance(place, dict):
            place = place.get(key)
        elif place is not None:
            raise _no_place(path, above, place)
    return place


def _below(place: Any, key: str, path: str, above: str) -> Any:
    if isinstance(place, list):
        return place[_entry(place, key, path, above)]
    if isinstance(place, dict):
        if place.get(key) is None:
            place[key] = {}
        return place[key]
    raise _no_place(path, above, place)


def _set(place: Any, key: str, value: Any, path: str, above: str) -> None:
    if isinstance(place, list):
        place[_entry(place, key, path, above)] = value
    elif isinstance(place, dict):
        place[key] = value
    else:
        raise _no_place(path, above, place)


def _entry(entries: list[Any], key: str, path: str, above: str) -> int:
    names = [str(entry["name"]) if isinstance(entry, dict) and "name" in entry else "" for entry in entries]
    if key in names:
        return names.index(key)
    if key.isdecimal() and len(key) < 10 and int(key) < len(entries):
        return int(key)
    known = [name for name in names if name] or [str(k) for k in range(len(entries))]
    raise SceneError(f"{path}: {above} has no entry {key!r}; {suggestion(key, known)}")


def _no_place(path: str, above: str, place: Any) -> SceneError:
    kind = "a text" if isinstance(place, str) else "a single value"
    return SceneError(f"{path}: {above or 'the file'} is {kind}, which has nothing below it; give a shorter path")


def unit_of(path: str) -> str:
    """The unit of the value at a path, as the format's description has it; empty where it is not unique.

    The kind of an entry is not looked at: `youngs` has the same unit in every material that has it.
    """
    schema = json_schema()
    places = [schema]
    for key in path.split("."):
        places = [below for place in places for below in _schemas_below(place, key, schema)]
    return _unit_of_all(places)


def _unit_of_all(places: list[dict[str, Any]]) -> str:
    units = {match[1] for place in places for match in _UNIT.finditer(place.get("description", ""))}
    return units.pop() if len(units) == 1 else ""


def _schemas_below(place: dict[str, Any], key: str, schema: dict[str, Any]) -> list[dict[str, Any]]:
    found = []
    for alternative in _alternatives(place, schema):
        if key in alternative.get("properties", {}):
            found.append(alternative["properties"][key])
        elif "items" in alternative:
            # An entry of a list of numbers has the list's description, an entry of a list of bodies its own.
            found.append({"description": place.get("description", ""), **alternative["items"]})
    return found


def _alternatives(place: dict[str, Any], schema: dict[str, Any]) -> list[dict[str, Any]]:
    if "$ref" in place:
        return _alternatives(schema["$defs"][place["$ref"].rpartition("/")[2]], schema)
    choices = [*place.get("anyOf", []), *place.get("oneOf", [])]
    return [one for choice in choices for one in _alternatives(choice, schema)] if choices else [place]
