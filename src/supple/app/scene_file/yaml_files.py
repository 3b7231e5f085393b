"""Reading and writing YAML by the rules of version 1.2, with the line of each value; a repeated key is an error.

PyYAML follows YAML 1.1, where `1e5` is a text, `no` is false and `1:30` is ninety. Here scalars follow the core schema
of YAML 1.2.2 (section 10.3.2). Only plain data is built, never any other object.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from supple.errors import SceneError
from supple.scene.located import Key

MAX_BYTES = 8 * 1024 * 1024
MAX_VALUES = 1_000_000
MAX_DEPTH = 64

_FLOAT = re.compile(
    r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)"
)
_INT = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_BOOL = re.compile(r"true|True|TRUE|false|False|FALSE")
_NULL = re.compile(r"~|null|Null|NULL|")
_PREFIX = "tag:yaml.org,2002:"


class SceneLoader(yaml.SafeLoader):
    """PyYAML's parser with the scalars of YAML 1.2."""

    yaml_implicit_resolvers: dict = {}  # noqa: RUF012 (a class attribute of PyYAML's)


for _kind, _pattern in (("null", _NULL), ("bool", _BOOL), ("int", _INT), ("float", _FLOAT)):
    SceneLoader.add_implicit_resolver(_PREFIX + _kind, re.compile(f"^(?:{_pattern.pattern})$"), None)


@dataclass(frozen=True, eq=False)
class YamlDocument:
    """The data of a YAML file, and the place of each value in the file."""

    path: Path
    text: str
    data: Any
    root: yaml.Node

    def line(self, keys: Sequence[Key]) -> int:
        """Line (from 1) of the value at `keys`, or of its key; of the nearest enclosing value if it is absent."""
        node, line = self.root, self.root.start_mark.line + 1
        for key in keys:
            if isinstance(node, yaml.MappingNode):
                found = next(((k, v) for k, v in node.value if k.value == key), None)
                if found is None:
                    break
                line, node = found[0].start_mark.line + 1, found[1]
            elif isinstance(node, yaml.SequenceNode) and isinstance(key, int) and key < len(node.value):
                node = node.value[key]
                line = node.start_mark.line + 1
            else:
                break
        return line

    def error(self, keys: Sequence[Key], message: str) -> SceneError:
        """A `SceneError` with file, line and key before `message`."""
        where = key_text(keys)
        return SceneError(f"{self.path}:{self.line(keys)}: {where}{': ' if where else ''}{message}")


def key_text(keys: Sequence[Key]) -> str:
    """`("bodies", 0, "name")` as `bodies[0].name`."""
    text = ""
    for key in keys:
        text += f"[{key}]" if isinstance(key, int) else f"{'.' if text else ''}{printable(key)}"
    return text


def printable(text: str, limit: int = 60) -> str:
    """A text from a file as printable text of limited length, for a message of one line."""
    text = text if len(text) <= limit else text[: limit - 3] + "..."
    return text if text.isprintable() else ascii(text)[1:-1]


def read_yaml(path: str | Path) -> YamlDocument:
    """Read a YAML file of plain data.

    Raises
    ------
    SceneError : where the file cannot be read or is not valid YAML; one line that begins with `file:line:`.
    """
    path = Path(path)
    return parse_yaml(_read_text(path), path)


def parse_yaml(text: str, path: Path) -> YamlDocument:
    """The data of a text; `path` is named in errors.

    Raises
    ------
    SceneError : where the text is not valid YAML; one line that begins with `file:line:`.
    """
    loader = None
    try:
        loader = SceneLoader(text)
        root = loader.get_single_node()
    except yaml.MarkedYAMLError as error:
        raise SceneError(f"{path}:{_line_of(error)}: {_explanation(error)}") from None
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise SceneError(f"{path}:{line}: character {error.character:#x} is not allowed in YAML; remove it") from None
    except RecursionError:
        raise SceneError(f"{path}: values are nested too deeply; at most {MAX_DEPTH} levels are allowed") from None
    finally:
        if loader is not None:
            loader.dispose()
    if root is None:
        raise SceneError(f"{path}: the file is empty; a scene needs at least `bodies:`")
    return YamlDocument(path, text, _Builder(path).build(root, 0), root)


def _read_text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise SceneError(f"{path}: the file does not exist") from None
    except IsADirectoryError:
        raise SceneError(f"{path}: this is a folder; give the scene file in it") from None
    except (OSError, ValueError) as error:
        if path.is_dir():  # Windows reports "permission denied" for a folder
            raise SceneError(f"{path}: this is a folder; give the scene file in it") from None
        reason = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise SceneError(f"{printable(str(path), 200)}: cannot be read: {reason}") from None
    if len(raw) > MAX_BYTES:
        raise SceneError(f"{path}: larger than {MAX_BYTES // 1024**2} MiB; move meshes into separate files")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        byte = f"{raw[error.start]:#04x}"
        raise SceneError(f"{path}:{line}: this is not UTF-8 text (byte {byte}); save it as UTF-8") from None


def _line_of(error: yaml.MarkedYAMLError) -> int:
    mark = error.problem_mark or error.context_mark
    return mark.line + 1 if mark is not None else 1


def _explanation(error: yaml.MarkedYAMLError) -> str:
    problem = " ".join((error.problem or error.context or "not valid YAML").split())
    if "'\\t'" in problem:
        return "a tab is not allowed here; indent with spaces"
    if "but found another document" in problem:
        return "a second document begins here; a scene file has one document, so remove the `---`"
    if "undefined alias" in problem:
        return f"{printable(problem, 120)}; define it with `&` before this line"
    if "mapping values are not allowed" in problem:
        return "a `:` is not allowed here; check the indentation, or put the text in quotes"
    context = f" ({' '.join(error.context.split())})" if error.context and error.problem else ""
    return printable(f"not valid YAML: {problem}{context}", 200) + "; check indentation, quotes and brackets"


class _Builder:
    """Plain data from YAML nodes. An alias is built again at each use, and the number of all values is limited."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.count = 0
        self.open: set[int] = set()

    def fail(self, node: yaml.Node, message: str) -> SceneError:
        return SceneError(f"{self.path}:{node.start_mark.line + 1}: {message}")

    def build(self, node: yaml.Node, depth: int) -> Any:
        self.count += 1
        if self.count > MAX_VALUES:
            raise self.fail(node, f"the file contains more than {MAX_VALUES} values; use fewer aliases, or mesh files")
        if depth > MAX_DEPTH:
            raise self.fail(node, f"values are nested too deeply; at most {MAX_DEPTH} levels are allowed")
        if id(node) in self.open:
            raise self.fail(node, "an alias is inside the value that it refers to; write the value instead")
        if isinstance(node, yaml.ScalarNode):
            return self.scalar(node)
        self.open.add(id(node))
        try:
            if isinstance(node, yaml.SequenceNode):
                self.check_tag(node, "seq")
                return [self.build(item, depth + 1) for item in node.value]
            self.check_tag(node, "map")
            return self.mapping(node, depth)
        finally:
            self.open.discard(id(node))

    def check_tag(self, node: yaml.Node, kind: str) -> None:
        if node.tag != _PREFIX + kind:
            tag = printable(node.tag.replace(_PREFIX, "!!"))
            raise self.fail(node, f"the tag {tag} is not allowed; write plain values without tags")

    def mapping(self, node: yaml.Node, depth: int) -> dict[str, Any]:
        result: dict[str, Any] = {}
        lines: dict[str, int] = {}
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode) or key_node.tag != _PREFIX + "str":
                text = f" {printable(key_node.value)}" if isinstance(key_node, yaml.ScalarNode) else ""
                raise self.fail(key_node, f"the key{text} is not a text; keys are texts such as `bodies`")
            key = key_node.value
            if key in result:
                raise self.fail(key_node, f"the key `{printable(key)}` is also on line {lines[key]}; keep one")
            lines[key] = key_node.start_mark.line + 1
            result[key] = self.build(value_node, depth + 1)
        return result

    def scalar(self, node: yaml.ScalarNode) -> Any:
        text, kind = node.value, node.tag.removeprefix(_PREFIX)
        if kind == "str":
            return text
        if kind == "null" and _NULL.fullmatch(text):
            return None
        if kind == "bool" and _BOOL.fullmatch(text):
            return text.lower() == "true"
        if kind == "int" and _INT.fullmatch(text):
            if len(text) > 400:
                raise self.fail(node, f"the number {printable(text)} has {len(text)} digits; give a smaller one")
            return int(text, 0) if text[:2] in ("0o", "0x") else int(text)
        if kind == "float" and (_FLOAT.fullmatch(text) or _INT.fullmatch(text)):
            return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
        self.check_tag(node, "str")


class _Dumper(yaml.SafeDumper):
    """PyYAML's writer by the rules of YAML 1.2: the text `1e5` gets quotes, because it would be read as a number."""

    yaml_implicit_resolvers = SceneLoader.yaml_implicit_resolvers

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _text(dumper: yaml.SafeDumper, value: str) -> yaml.Node:
    # Between other quotes, PyYAML writes these line breaks of Unicode as they are, and reads them as spaces.
    style = '"' if any(character in value for character in "\x85\u2028\u2029") else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style=style)


_Dumper.add_representer(str, _text)


def yaml_text(data: Any) -> str:
    """Plain data (None, true, false, numbers, texts, lists, mappings) as YAML, with keys in their order."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, default_flow_style=None, width=110)
