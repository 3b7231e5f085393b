"""Checks that a message of a browser is one that the client of viser sends: kind, fields, types, numbers."""

from __future__ import annotations

import dataclasses
import math
import typing
from functools import cache
from types import UnionType
from typing import Any

from supple.app.viewer.protocol import limits

# The kinds that a page uses. Other kinds of viser are ignored, for example a request to share the page on a public
# server.
KINDS = frozenset(
    {
        "CommandTriggerMessage",
        "FileTransferPart",
        "FileTransferStartUpload",
        "GetRenderResponseMessage",
        "GuiButtonHoldMessage",
        "GuiFormDirtyMessage",
        "GuiFormSubmitMessage",
        "GuiUpdateMessage",
        "LocalStorageGetItemResponseMessage",
        "SceneNodeClickMessage",
        "SceneNodeDragMessage",
        "ScenePointerMessage",
        "TransformControlsDragEndMessage",
        "TransformControlsDragStartMessage",
        "TransformControlsUpdateMessage",
        "ViewerCameraMessage",
    }
)
# Kinds that may be larger than `limits.LARGEST_MESSAGE` [bytes]: pictures that the server requested, parts of files.
# `supple.app.viewer.server.uploads.transfers` decides whether a file is accepted.
LARGE_KINDS = {
    "GetRenderResponseMessage": limits.LARGEST_PICTURE,
    "FileTransferPart": limits.UPLOAD_PART + limits.LARGEST_MESSAGE,
}
DEEPEST = 8


class Malformed(Exception):
    """A message that no page sends."""


def is_wanted(raw: object) -> bool:
    """Whether to handle a message; False for kinds of viser that a page does not use.

    Raises
    ------
    Malformed : where it is not a message of viser.
    """
    if not isinstance(raw, bytes):
        raise Malformed("text instead of binary data")
    import msgspec

    try:
        message = msgspec.msgpack.decode(raw)
    except (msgspec.DecodeError, RecursionError, ValueError):
        raise Malformed("no MessagePack") from None
    if not isinstance(message, dict) or not isinstance(kind := message.pop("type", None), str):
        raise Malformed("no kind of message")
    if kind not in _known():
        raise Malformed("an unknown kind of message")
    if kind not in KINDS:
        return False
    if len(raw) > LARGE_KINDS.get(kind, limits.LARGEST_MESSAGE):
        raise Malformed(f"{len(raw)} bytes")
    _check_fields(kind, message)
    if kind == "GuiUpdateMessage" and set(message["updates"]) != {"value"}:
        # viser would set any attribute that a message names.
        raise Malformed("an update of an attribute other than the value")
    return True


@cache
def _known() -> dict[str, type]:
    from viser._messages import Message

    return {kind.__name__: kind for kind in Message.get_subclasses()}


@cache
def _fields(kind: str) -> tuple[dict[str, Any], frozenset[str]]:
    """The types of the fields of a kind of message by name, and the names of the required fields."""
    described = _known()[kind]
    hints = typing.get_type_hints(described)
    fields = dataclasses.fields(described)
    needed = {
        field.name
        for field in fields
        if field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
    }
    return {field.name: hints[field.name] for field in fields}, frozenset(needed)


def _check_fields(kind: str, message: dict[Any, Any]) -> None:
    types, needed = _fields(kind)
    if not needed <= message.keys() <= types.keys():
        raise Malformed(f"the fields are not those of {kind}")
    for name, value in message.items():
        if not _fits(value, types[name], 0):
            raise Malformed(f"{name} of {kind} has another type")


def _fits(value: object, kind_of_value: Any, depth: int) -> bool:
    """Whether a value has an annotated type. JavaScript has one type of number: 1.0 arrives as an integer."""
    if depth > DEEPEST:
        return False
    origin, arguments = typing.get_origin(kind_of_value), typing.get_args(kind_of_value)
    if kind_of_value in (float, int):
        return _is_number(value)
    if kind_of_value in (bool, str, bytes, type(None)):
        return isinstance(value, kind_of_value)
    if origin is typing.Literal:
        return isinstance(value, str | int | None) and value in arguments
    if origin in (typing.Union, UnionType):
        return any(_fits(value, each, depth + 1) for each in arguments)
    if origin is tuple:
        if not isinstance(value, list):
            return False
        if len(arguments) == 2 and arguments[1] is ...:
            return all(_fits(each, arguments[0], depth + 1) for each in value)
        return len(value) == len(arguments) and all(
            _fits(each, one, depth + 1) for each, one in zip(value, arguments, strict=True)
        )
    return _is_plain(value, depth + 1) and (origin is not dict or isinstance(value, dict))


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_plain(value: object, depth: int) -> bool:
    """Whether a value consists of strings, finite numbers, lists, and dictionaries with string keys."""
    if depth > DEEPEST:
        return False
    match value:
        case None | bool() | str() | bytes():
            return True
        case int() | float():
            return _is_number(value)
        case list():
            return all(_is_plain(each, depth + 1) for each in value)
        case dict():
            return all(isinstance(key, str) and _is_plain(each, depth + 1) for key, each in value.items())
    return False
