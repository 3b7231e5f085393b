"""pydantic's errors as errors of one line, in terms of the YAML file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from pydantic import ValidationError

from supple.app.scene_file.model import UnknownKeyError
from supple.app.scene_file.yaml_files import Key, YamlDocument, printable
from supple.errors import SceneError
from supple.kinds.suggestion import suggestion


def scene_error(document: YamlDocument, error: ValidationError) -> SceneError:
    """The first problem of the file as an error of one line, with the number of the others."""
    found = []
    for item in error.errors(include_url=False):
        keys, absent = _keys_in(document.data, item["loc"])
        found.append((document.line(keys), keys, absent, item))
    found.sort(key=lambda entry: entry[0])
    _, keys, absent, item = found[0]
    where, text = _describe(keys, absent, item)
    more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    return document.error(where, text + more)


def _keys_in(data: Any, loc: Sequence[int | str]) -> tuple[tuple[Key, ...], str | None]:
    """The keys of `loc` that are in the data, without pydantic's names of kinds; and the last key if it is absent."""
    keys: list[Key] = []
    for i, part in enumerate(loc):
        in_list = isinstance(data, list) and isinstance(part, int) and part < len(data)
        if in_list or (isinstance(data, dict) and part in data):
            keys.append(part)
            data = data[part]  # pyright: ignore[reportCallIssue, reportArgumentType]
        elif i == len(loc) - 1 and isinstance(part, str):
            return tuple(keys), part
    return tuple(keys), None


def _describe(keys: tuple[Key, ...], absent: str | None, item: Any) -> tuple[tuple[Key, ...], str]:
    kind, context, value = item["type"], item.get("ctx", {}), item.get("input")
    error = context.get("error")
    if isinstance(error, UnknownKeyError):
        return (*keys, error.key), f"unknown key; {suggestion(error.key, list(error.known))}"
    if kind == "missing":
        return keys, f"the key `{absent}` is missing; add it"
    if kind == "union_tag_not_found":
        missing = "the key `kind` is missing; add it"
        return keys, missing if isinstance(value, dict) else _give("keys and values", value)
    if kind == "union_tag_invalid":
        known = [tag.strip().strip("'") for tag in context["expected_tags"].split(",")]
        tag = str(context["tag"])
        return (*keys, "kind"), f"unknown kind {printable(tag)!r}; {suggestion(tag, known)}"
    if kind == "literal_error":
        known = [tag.strip().strip("'") for tag in context["expected"].replace(" or ", ",").split(",")]
        return keys, f"is {_value(value)}; {suggestion(str(value), known)}"
    text = _TEXTS.get(kind)
    if text is not None:
        return keys, text(value, context)
    if kind in ("value_error", "assertion_error"):
        return keys, item["msg"].removeprefix("Value error, ")
    return keys, f"is {_value(value)}: {item['msg']}"


def _value(value: Any) -> str:
    if value is None:
        return "empty"
    if isinstance(value, str):
        return f"the text {printable(value)!r}"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    return printable(str(value))


def _give(what: str, value: Any) -> str:
    if isinstance(value, str) and what in ("a number", "a whole number"):
        try:
            float(value)
        except ValueError:
            pass
        else:
            return f"is {_value(value)}; remove the quotes, so that it is {what}"
    return f"is {_value(value)}; give {what}"


def _expects(what: str) -> Callable[[Any, dict], str]:
    return lambda value, context: _give(what, value)


def _bound(word: str, key: str) -> Callable[[Any, dict], str]:
    return lambda value, context: f"is {_value(value)}; it must be {word} {context[key]:g}"


_TEXTS: dict[str, Callable[[Any, dict], str]] = {
    "float_type": _expects("a number"),
    "float_parsing": _expects("a number"),
    "finite_number": lambda value, context: f"is {_value(value)}; it must be finite",
    "int_type": _expects("a whole number"),
    "int_from_float": _expects("a whole number"),
    "int_parsing_size": lambda value, context: f"is {_value(value)}; the number is too large",
    "string_type": _expects("a text"),
    "bool_type": _expects("true or false"),
    "list_type": _expects("a list, such as [1, 2, 3]"),
    "model_type": _expects("keys and values"),
    "dict_type": _expects("keys and values"),
    "model_attributes_type": _expects("keys and values"),
    "greater_than": _bound("above", "gt"),
    "greater_than_equal": _bound("at least", "ge"),
    "less_than": _bound("below", "lt"),
    "less_than_equal": _bound("at most", "le"),
    "too_short": lambda value, context: f"has {context['actual_length']} values; give at least {context['min_length']}",
    "too_long": lambda value, context: f"has {len(value)} values; give at most {context['max_length']}",
    "string_too_short": lambda value, context: "is an empty text; give some",
    "string_too_long": lambda value, context: f"is a text of {len(value)} letters; at most {context['max_length']} fit",
}
