"""Nodes, elements and sets of one part of an Abaqus deck, given one by one or generated.

Source: Abaqus Analysis User's Guide, "Node definition", "Element definition", and the Keywords Reference Guide.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.abaqus.blocks import Block, Line
from supple.mesh.io.cells import FormatError
from supple.mesh.io.text import integer, shortened

# Solids, with the type of VTK by the number of nodes: stress, heat, acoustic, electromagnetic, flow, Eulerian elements,
# and shells with the nodes of solids. Surfaces: shells, membranes, rigid surfaces, and plane elements, as which Gmsh
# writes triangles.
_SOLID = re.compile(r"(?:C3D|DC3D|DCC3D|AC3D|EC3D|EMC3D|Q3D|F3D|FC3D|SC|CSS)(\d+)(V?)")
_SOLIDS = {4: 10, 5: 14, 6: 13, 8: 12, 10: 24, 13: 27, 15: 26, 18: 32, 20: 25, 27: 29}
_SURFACE = re.compile(r"(?:S|DS|M3D|R3D|SFM3D|STRI|CPS|CPE|CPEG)(\d)")
_SURFACES = {3: 5, 4: 9, 6: 22, 8: 23, 9: 28}
# Of all parts and instances together. A deck of a few lines can ask for more than memory holds.
_MOST_VALUES = 50_000_000
_MOST_MEMBERS = 20_000_000


class Budget:
    """How many numbers a deck may still generate."""

    def __init__(self) -> None:
        self.left = _MOST_VALUES

    def take(self, count: int, place: int | str | None) -> None:
        self.left -= count
        if self.left < 0:
            raise FormatError(f"it asks for more than {_MOST_VALUES:,} numbers of nodes and elements", place)


class Sets:
    """Sets of one kind, by name in capitals: members in their order, and the spelling of the first definition."""

    def __init__(self, kind: str) -> None:
        self._kind = kind
        self.members: dict[str, array[int]] = {}
        self.spelling: dict[str, str] = {}
        self.unsorted: set[str] = set()

    def of(self, name: str) -> array[int]:
        """The members of a set, which is made where it does not exist."""
        self.spelling.setdefault(name.upper(), name)
        return self.members.setdefault(name.upper(), array("q"))

    def existing(self, name: str, place: int | str) -> NDArray[np.int64]:
        """The members of a set that must exist: sorted, if it is not marked as unsorted."""
        if name.upper() not in self.members:
            raise FormatError(f"names the set '{shortened([name])}', which is not defined before", place)
        own = np.array(self.members[name.upper()], dtype=np.int64)
        return own if name.upper() in self.unsorted else np.unique(own)

    def add(self, name: str, lines: Iterable[Line], *, generate: bool) -> None:
        """Add what lines list: numbers, names of other sets, or with GENERATE first, last and step."""
        members = self.of(name)
        for line in lines:
            if generate:
                values = line.integers([None, None, 1], "a member") if 2 <= len(line.words) <= 3 else [0, 0, 0]
                first, last, step = values
                if step < 1 or last < first:
                    raise FormatError("GENERATE needs first, last and step", line.place)
                if (last - first) // step >= _MOST_MEMBERS - len(members):
                    raise FormatError(f"a set has more than {_MOST_MEMBERS:,} members", line.place)
                members.extend(range(first, last + 1, step))
                continue
            for word in filter(None, line.words):
                if word.lstrip("+-").isdigit():
                    members.append(integer(word, line.place, f"a {self._kind}"))
                else:
                    members.extend(self.existing(word, line.place).tolist())
                if len(members) > _MOST_MEMBERS:
                    raise FormatError(f"a set has more than {_MOST_MEMBERS:,} members", line.place)


class Part:
    """What the keywords between *PART and *END PART define; of a deck without parts, the whole."""

    def __init__(self, name: str, budget: Budget) -> None:
        self.name, self._budget = name, budget
        self.node_sets, self.element_sets = Sets("node"), Sets("element")
        self._tags, self._points = array("q"), array("d")
        # By VTK's type and number of nodes.
        self._elements: dict[tuple[int, int], tuple[array[int], array[int]]] = {}
        # Where each node, and each element, is in these arrays, as far as it was looked up.
        self._node_rows: dict[int, int] = {}
        self._element_rows: dict[int, tuple[tuple[int, int], int]] = {}
        self.left_out: dict[str, None] = {}
        self.spherical = False
        self._origin, self._axes = np.zeros(3), np.eye(3)

    @property
    def nodes(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Numbers (n,) and points (n, 3) in the order of the deck; of a node that is given more than once, the last."""
        tags, points = np.array(self._tags, dtype=np.int64), np.array(self._points).reshape(-1, 3)
        _, first = np.unique(tags, return_index=True)
        _, last = np.unique(tags[::-1], return_index=True)
        order = np.argsort(first)
        return tags[first[order]], points[len(tags) - 1 - last[order]]

    @property
    def size(self) -> int:
        """How many numbers its nodes and elements are."""
        return 4 * len(self._tags) + sum(len(tags) + len(flat) for tags, flat in self._elements.values())

    @property
    def repeated(self) -> int:
        """How many nodes are given more than once."""
        return len(self._tags) - len(set(self._tags))

    @property
    def elements(self) -> dict[tuple[int, int], tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """By VTK's type and number of nodes: numbers (m,) of elements, and of their nodes (m, width)."""
        return {
            key: (np.array(tags, dtype=np.int64), np.array(flat, dtype=np.int64).reshape(-1, key[1]))
            for key, (tags, flat) in self._elements.items()
        }

    def apply(self, block: Block) -> None:
        """Do what a keyword says."""
        _APPLIED[block.keyword](self, block)

    def _add_nodes(self, tags: NDArray[np.int64], points: NDArray[np.float64], block: Block, *, option: str) -> None:
        self._tags.extend(tags.tolist())
        self._points.extend(points.ravel().tolist())
        if option in block.options:
            self.node_sets.of(block.named(option)).extend(tags.tolist())

    def _add_elements(self, key: tuple[int, int], tags: NDArray[np.int64], rows: NDArray[np.int64]) -> None:
        own = self._elements.setdefault(key, (array("q"), array("q")))
        own[0].extend(tags.tolist())
        own[1].extend(rows.ravel().tolist())

    def _at(self, tags: NDArray[np.int64], place: int | str) -> NDArray[np.float64]:
        rows = self._node_rows
        rows |= {self._tags[k]: k for k in range(len(rows), len(self._tags))} if len(rows) < len(self._tags) else {}
        missing = next((tag for tag in tags.tolist() if tag not in rows), None)
        if missing is not None:
            raise FormatError(f"node {missing} is used, and does not exist", place)
        own = [rows[tag] for tag in tags.tolist()]
        return np.array([self._points[3 * k : 3 * k + 3] for k in own]).reshape(-1, 3)

    def _system(self, block: Block) -> None:
        """*SYSTEM: the frame of the coordinates that follow, by its origin, a point on x, and one in the x-y plane."""
        self._origin, self._axes = np.zeros(3), np.eye(3)
        if not block.lines:
            return
        values = np.array(block.lines[0].floats(6, "*SYSTEM"))
        self._origin = values[:3]
        if len(block.lines[0].words) <= 3:
            return
        x = values[3:] - values[:3]
        z = np.array([0.0, 0.0, 1.0])
        if len(block.lines) > 1:
            z = np.cross(x, np.array(block.lines[1].floats(3, "*SYSTEM")) - self._origin)
        else:  # z stays, and x is projected
            x = x * (1.0, 1.0, 0.0)
        if not (x.any() and z.any()):
            raise FormatError("the points of *SYSTEM lie on one line", block.place)
        x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
        self._axes = np.array([x, np.cross(z, x), z])

    def _node(self, block: Block) -> None:
        tags = np.array([integer(line.words[0], line.place, "a node's number") for line in block.lines], dtype=np.int64)
        rest = [line._replace(words=line.words[1:]).floats(3, "a node") for line in block.lines]
        points = np.array(rest).reshape(-1, 3)
        system = (block.options.get("SYSTEM") or "R").upper()[:1]
        if system not in "RCS":
            raise FormatError(f"SYSTEM={block.options['SYSTEM']} is not R, C or S", block.place)
        if system != "R":
            radius, angle, third = points.T
            turn = np.radians(angle)
            height = third
            if system == "S":  # the second angle is that above the x-y plane
                self.spherical = True
                radius, height = radius * np.cos(np.radians(third)), radius * np.sin(np.radians(third))
            points = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height])
        if self._origin.any() or not np.array_equal(self._axes, np.eye(3)):
            points = points @ self._axes + self._origin
        self._add_nodes(tags, points, block, option="NSET")

    def _element(self, block: Block) -> None:
        kind = block.options.get("TYPE", "").upper()
        solid, surface = _SOLID.match(kind), _SURFACE.match(kind)
        number, width = None, 0
        if solid:
            width = int(solid[1]) + 3 * (solid[2] == "V")
            number = _SOLIDS.get(width)
            if number is None:
                raise FormatError(f"elements of type {shortened([kind])} cannot be read", block.place)
        elif surface:
            width = int(surface[1])
            number = _SURFACES.get(width)
        if not solid and block.lines:
            self.left_out[shortened([kind])] = None
        if number is None:
            return
        values = [integer(word, line.place, "an element's node") for line in block.lines for word in line.words if word]
        if len(values) % (width + 1):
            raise FormatError(f"its {kind} elements do not have a number and {width} nodes each", block.place)
        table = np.array(values, dtype=np.int64).reshape(-1, width + 1)
        self._add_elements((number, width), table[:, 0], table[:, 1:])
        if "ELSET" in block.options:
            self.element_sets.of(block.named("ELSET")).extend(table[:, 0].tolist())

    def _ngen(self, block: Block) -> None:
        """*NGEN: nodes on the line between two, at equal distances."""
        block.refuse("LINE")
        for line in block.lines:
            first, last, step = line.integers([None, None, 1], "*NGEN")
            step = abs(step) if last >= first else -abs(step)
            if step == 0 or (last - first) % step:
                raise FormatError("the numbers between the ends of *NGEN do not fit its increment", line.place)
            count = (last - first) // step
            self._budget.take(4 * count, line.place)
            ends = self._at(np.array([first, last]), line.place)
            tags = np.arange(first, last + step, step)
            part = np.arange(count + 1)[:, None] / max(count, 1)
            points = ends[0] * (1.0 - part) + ends[1] * part
            self._add_nodes(tags[1:-1], points[1:-1], block._replace(options={}), option="")
            if "NSET" in block.options:
                self.node_sets.of(block.named("NSET")).extend(tags.tolist())

    def _nfill(self, block: Block) -> None:
        """*NFILL: nodes on the lines between the nodes of two sets."""
        block.refuse("BIAS", "SINGULAR", "TWO STEP")
        for line in block.lines:
            if len(line.words) < 3:
                raise FormatError("*NFILL needs two sets and a number of intervals", line.place)
            ends = [self.node_sets.existing(word, line.place) for word in line.words[:2]]
            count, step = line._replace(words=line.words[2:]).integers([None, 1], "*NFILL")
            if len(ends[0]) != len(ends[1]) or count < 1:
                raise FormatError(
                    "the sets of *NFILL do not have as many nodes, or the interval is missing", line.place
                )
            self._budget.take(4 * count * len(ends[0]), line.place)
            low, high = (self._at(own, line.place) for own in ends)
            for k in range(1, count):
                self._add_nodes(ends[0] + k * step, low + (high - low) * (k / count), block, option="NSET")
            if "NSET" in block.options:
                for own in ends:
                    self.node_sets.of(block.named("NSET")).extend(own.tolist())

    def _ncopy(self, block: Block) -> None:
        """*NCOPY: the nodes of a set once more, moved, then turned."""
        block.refuse("REFLECT", "POLE", "MULTIPLE")
        old = self.node_sets.existing(block.named("OLD SET"), block.place)
        change = integer(block.named("CHANGE NUMBER"), block.place, "CHANGE NUMBER")
        linear, shift = placement(block)
        self._budget.take(4 * len(old), block.place)
        self._add_nodes(old + change, self._at(old, block.place) @ linear.T + shift, block, option="NEW SET")

    def _elgen(self, block: Block) -> None:
        """*ELGEN: rows and layers of elements like one of them."""
        for line in block.lines:
            master, *steps = line.integers([None, 1, 1, 1, 1, 0, 0, 1, 0, 0], "*ELGEN")
            counts = steps[::3]
            if min(counts) < 1:
                raise FormatError("*ELGEN needs at least one element, row and layer", line.place)
            number = counts[0] * counts[1] * counts[2]
            key, nodes = self._nodes_of(master, line.place)
            self._budget.take(number * (key[1] + 1), line.place)
            grid = np.indices(counts).reshape(3, -1)
            made = master + np.array(steps[2::3], dtype=np.int64) @ grid
            nodes = nodes + (np.array(steps[1::3], dtype=np.int64) @ grid)[:, None]
            self._add_elements(key, made[1:], nodes[1:])
            if "ELSET" in block.options:
                self.element_sets.of(block.named("ELSET")).extend(made.tolist())

    def _nodes_of(self, element: int, place: int | str) -> tuple[tuple[int, int], NDArray[np.int64]]:
        """The type of an element, and its nodes."""
        if element not in self._element_rows:
            for key, (tags, _) in self._elements.items():
                self._element_rows |= {tag: (key, row) for row, tag in enumerate(tags)}
        if element not in self._element_rows:
            raise FormatError(f"element {element}, which *ELGEN copies, does not exist", place)
        key, row = self._element_rows[element]
        return key, np.array(self._elements[key][1][row * key[1] : (row + 1) * key[1]], dtype=np.int64)

    def _elcopy(self, block: Block) -> None:
        """*ELCOPY: the elements of a set once more, with other nodes."""
        old = self.element_sets.existing(block.named("OLD SET"), block.place)
        change, shift = (integer(block.named(key), block.place, key) for key in ("ELEMENT SHIFT", "SHIFT NODES"))
        for key, (tags, rows) in self.elements.items():
            own = np.isin(tags, old)
            self._budget.take(int(own.sum()) * (key[1] + 1), block.place)
            self._add_elements(key, tags[own] + change, rows[own] + shift)
        if "NEW SET" in block.options:
            self.element_sets.of(block.named("NEW SET")).extend((old + change).tolist())

    def _nset(self, block: Block) -> None:
        name = block.named("NSET")
        if "UNSORTED" in block.options:
            self.node_sets.unsorted.add(name.upper())
        if "ELSET" in block.options:
            chosen = self.element_sets.existing(block.named("ELSET"), block.place)
            for tags, rows in self.elements.values():
                self.node_sets.of(name).extend(np.unique(rows[np.isin(tags, chosen)]).tolist())
        self.node_sets.add(name, block.lines, generate="GENERATE" in block.options)

    def _elset(self, block: Block) -> None:
        self.element_sets.add(block.named("ELSET"), block.lines, generate="GENERATE" in block.options)


_APPLIED = {
    "SYSTEM": Part._system,
    "NODE": Part._node,
    "ELEMENT": Part._element,
    "NGEN": Part._ngen,
    "NFILL": Part._nfill,
    "NCOPY": Part._ncopy,
    "ELGEN": Part._elgen,
    "ELCOPY": Part._elcopy,
    "NSET": Part._nset,
    "ELSET": Part._elset,
}
PART_KEYWORDS = frozenset(_APPLIED)


def placement(block: Block) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Matrix (3, 3) and vector (3,) of two data lines: a translation, then a rotation about the axis of two points."""
    from scipy.spatial.transform import Rotation

    lines = block.lines
    shift = np.array(lines[0].floats(3, "a translation")) if lines else np.zeros(3)
    if len(lines) < 2 or not any(lines[1].words):
        return np.eye(3), shift
    *points, angle = lines[1].floats(7, "a rotation")
    a, b = np.array(points[:3]), np.array(points[3:])
    if angle == 0.0:
        return np.eye(3), shift
    length = float(np.linalg.norm(b - a))
    if not (0.0 < length < np.inf and np.isfinite(angle)):
        raise FormatError("the two points of the axis of a rotation are the same, or not finite", lines[1].place)
    linear = Rotation.from_rotvec((b - a) / length * angle, degrees=True).as_matrix()
    return linear, linear @ (shift - a) + a
