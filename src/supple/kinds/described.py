"""The class of classes that a user calls: unknown arguments get a suggestion, and `help` shows plain types."""

from __future__ import annotations

import ast
import inspect
from abc import ABCMeta
from typing import Any, get_type_hints

from supple.errors import SceneError
from supple.kinds.suggestion import suggestion


class Described(ABCMeta):
    """A class whose constructor has the fields of a dataclass as its arguments."""

    def __call__(cls, *args: Any, **given: Any) -> Any:
        code = cls.__init__.__code__
        known = code.co_varnames[1 : code.co_argcount + code.co_kwonlyargcount]
        error, unnamed = getattr(cls, "error", SceneError), known[: code.co_argcount - 1]
        if len(args) > len(unnamed) and not code.co_flags & inspect.CO_VARARGS:
            raise error(
                f"{cls.__name__} takes {', '.join(unnamed) or 'nothing'} without a name, not {len(args)} values; "
                f"write the others as name=value: {', '.join(known[len(unnamed) :])}"
            )
        for name in given:
            if name not in known:
                raise error(f"{cls.__name__}: the argument {name!r} does not exist; {suggestion(name, known)}")
        return super().__call__(*args, **given)

    @property
    def __signature__(cls) -> inspect.Signature:
        signature = inspect.signature(cls.__init__)
        return inspect.Signature(list(signature.parameters.values())[1:])

    def __setattr__(cls, name: str, value: Any) -> None:
        super().__setattr__(name, value)
        if name == "__init__" and "__dataclass_fields__" in cls.__dict__:  # `dataclass` has done its work
            cls._written = inspect.get_annotations(cls)
            cls.__annotations__ = {key: plain_type(hint) for key, hint in cls._written.items()}
            value.__annotations__ = {key: plain_type(hint) for key, hint in value.__annotations__.items()}
            for field in cls.__dict__["__dataclass_fields__"].values():
                field.type = plain_type(field.type)


def written_types(described: type) -> dict[str, Any]:
    """By name, the types of a class's fields with their validators, as they are written."""
    hints: dict[str, Any] = {}
    for base in reversed(described.__mro__):
        names = {"__annotations__": base.__dict__.get("_written", {}), "__module__": base.__module__}
        hints |= get_type_hints(type(base.__name__, (), names), include_extras=True)
    return hints


class _WithoutForms(ast.NodeTransformer):
    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        self.generic_visit(node)
        annotated = ast.unparse(node.value).rpartition(".")[2] == "Annotated"
        return node.slice.elts[0] if annotated and isinstance(node.slice, ast.Tuple) else node


def plain_type(hint: Any) -> Any:
    """`"Annotated[float, POSITIVE]"` as `"float"`; other things than texts as they are."""
    return ast.unparse(_WithoutForms().visit(ast.parse(hint, mode="eval"))) if isinstance(hint, str) else hint
