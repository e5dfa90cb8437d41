# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees that are written as formulas, and laid out to be read: cos2_t = (1 - q * q) + q * q * (cos_i * cos_i)."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeVar

import bpy

from ..nodes import Nodes

MATH = {
    "+": "ADD",
    "-": "SUBTRACT",
    "*": "MULTIPLY",
    "/": "DIVIDE",
    ">": "GREATER_THAN",
    "<": "LESS_THAN",
    "abs": "ABSOLUTE",
    "sqrt": "SQRT",
    "exp": "EXPONENT",
    "sign": "SIGN",
    "sin": "SINE",
    "cos": "COSINE",
    "min": "MINIMUM",
    "max": "MAXIMUM",
    "equal": "COMPARE",
}
VECTOR_MATH = {
    "+": "ADD",
    "-": "SUBTRACT",
    "*": "MULTIPLY",
    "scale": "SCALE",
    "dot": "DOT_PRODUCT",
    "length": "LENGTH",
    "normalize": "NORMALIZE",
    "cross": "CROSS_PRODUCT",
}
# how strongly they bind, and how labels write them
INFIX = {">": (0, " > "), "<": (0, " < "), "+": (1, " + "), "-": (1, " - "), "*": (2, " "), "scale": (2, " ")}
INFIX |= {"/": (2, " / "), "dot": (1.5, " . ")}
ENTRY = 220  # how far left of a frame its inputs stand
COLUMN, ROW, GAP = 180, 48, 90
WIDTH = 155


class Value:
    """A number, a vector or colour, or a closure, that a node of a Sheet gives; arithmetic on it makes further nodes.

    socket: the output; node: whose it is; name: what labels call it, or ""
    Comparisons give 1 or 0. The same arithmetic on the same values is done by one node.
    """

    def __init__(self, sheet: Sheet, socket: bpy.types.NodeSocket, symbol: str = "", operands: tuple = ()):
        self.sheet, self.socket, self.symbol, self.operands = sheet, socket, symbol, operands
        self.name, self.uses = "", 0

    @property
    def node(self) -> bpy.types.Node:
        return self.socket.node

    def __getitem__(self, output: str) -> Value:
        """Another output of the same node, by its name."""
        return Value(self.sheet, self.node.outputs[output])

    def is_vector(self) -> bool:
        return self.socket.type in ("VECTOR", "RGBA")

    def __add__(self, other: Operand) -> Value:
        return _calculated("+", self, other)

    def __radd__(self, other: Operand) -> Value:
        return self + other

    def __sub__(self, other: Operand) -> Value:
        return _calculated("-", self, other)

    def __rsub__(self, other: Operand) -> Value:
        return _calculated("-", other, self)

    def __mul__(self, other: Operand) -> Value:
        if self.is_vector() == _is_vector(other):
            return _calculated("*", self, other)
        return _calculated("scale", *((self, other) if self.is_vector() else (other, self)))

    def __rmul__(self, other: Operand) -> Value:
        return self * other

    def __truediv__(self, other: Operand) -> Value:
        return _calculated("/", self, other)

    def __rtruediv__(self, other: Operand) -> Value:
        return _calculated("/", other, self)

    def __neg__(self) -> Value:
        return self * -1.0

    def __abs__(self) -> Value:
        return _calculated("abs", self)

    def __gt__(self, other: Operand) -> Value:
        return _calculated(">", self, other)

    def __lt__(self, other: Operand) -> Value:
        return _calculated("<", self, other)

    def text(self) -> str:
        """What it is called, or how it is calculated."""
        if self.name or not self.symbol:
            return self.name
        if self.symbol == "*" and self.operands[0] is self.operands[1]:
            return f"{_text(self.operands[0], 3)}^2"
        if self.symbol not in INFIX:
            inner = ", ".join(_text(operand) for operand in self.operands)
            return f"|{inner}|" if self.symbol in ("abs", "length") else f"{self.symbol}({inner})"
        rank, sign = INFIX[self.symbol]
        first, second = self.operands
        if self.symbol == "scale" or (self.symbol == "*" and not isinstance(second, Value)):
            first, second = second, first  # a factor comes first
        # what is taken away, or divided by, is in brackets where it is a sum, or a product, itself
        return _text(first, rank) + sign + _text(second, rank + (self.symbol in "-/"))


Operand = Value | float


def _text(operand: Operand, rank: float = 0) -> str:
    """The text of an operand, in brackets where it binds less strongly than `rank`."""
    if not isinstance(operand, Value):
        return f"{operand:g}"
    bare = operand.name or operand.symbol not in INFIX or INFIX[operand.symbol][0] >= rank
    return operand.text() if bare else f"({operand.text()})"


def _is_vector(operand):
    return isinstance(operand, Value) and operand.is_vector()


def _calculated(symbol, *operands):
    return next(operand for operand in operands if isinstance(operand, Value)).sheet.calculated(symbol, operands)


def sqrt(value: Value) -> Value:
    """The root; 0 of a negative number."""
    return _calculated("sqrt", value)


def exp(value: Value) -> Value:
    """e to that power."""
    return _calculated("exp", value)


def sign(value: Value) -> Value:
    """1 of a positive number, -1 of a negative one, 0 of 0."""
    return _calculated("sign", value)


def sin(value: Value) -> Value:
    """The sine of an angle in radians."""
    return _calculated("sin", value)


def cos(value: Value) -> Value:
    """The cosine of an angle in radians."""
    return _calculated("cos", value)


def minimum(a: Value, b: Operand) -> Value:
    """The smaller of two numbers."""
    return _calculated("min", a, b)


def maximum(a: Value, b: Operand) -> Value:
    """The larger of two numbers."""
    return _calculated("max", a, b)


def equal(a: Value, b: Operand, within: float) -> Value:
    """1 where two numbers differ by no more than `within`, else 0."""
    return _calculated("equal", a, b, within)


def dot(a: Value, b: Value) -> Value:
    """The scalar product of two vectors."""
    return _calculated("dot", a, b)


def cross(a: Value, b: Value) -> Value:
    """The vector product of two vectors."""
    return _calculated("cross", a, b)


def length(vector: Value) -> Value:
    """The length of a vector."""
    return _calculated("length", vector)


def normalize(vector: Value) -> Value:
    """A vector of that direction and of length 1; 0 of a vector that is 0."""
    return _calculated("normalize", vector)


Number = TypeVar("Number", Value, "Complex")


def choose(share: Value, yes: Number, no: Number | float) -> Number:
    """`yes` where `share` is 1, `no` where it is 0; between, share * yes + (1 - share) * no."""
    if isinstance(yes, Complex):
        return Complex(choose(share, yes.re, no.re), choose(share, yes.im, no.im))
    return _calculated("choose", share, yes, no)


@dataclass(frozen=True)
class Complex:
    """A complex number of two Values; arithmetic on it makes nodes."""

    re: Value
    im: Value

    def __add__(self, other: Complex) -> Complex:
        return Complex(self.re + other.re, self.im + other.im)

    def __sub__(self, other: Complex) -> Complex:
        return Complex(self.re - other.re, self.im - other.im)

    def __mul__(self, other: Complex | Operand) -> Complex:
        if not isinstance(other, Complex):
            return Complex(self.re * other, self.im * other)
        return Complex(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)

    def __truediv__(self, other: Complex) -> Complex:
        above = self * Complex(other.re, -other.im)
        return Complex(above.re / other.square(), above.im / other.square())

    def __rtruediv__(self, other: float) -> Complex:
        return Complex(other * self.re / self.square(), -other * self.im / self.square())

    def square(self) -> Value:
        """|z|^2"""
        return self.re * self.re + self.im * self.im

    def root(self) -> Complex:
        """The principal root, Re >= 0, neither part of which is a difference of almost equal numbers.

        0 of a negative number without an imaginary part, whose root lies on either side.
        """
        larger = sqrt(0.5 * (sqrt(self.square()) + abs(self.re)))
        smaller = 0.5 * abs(self.im) / larger  # 0 where both are
        negative = self.re < 0
        return Complex(choose(negative, smaller, larger), sign(self.im) * choose(negative, larger, smaller))


@dataclass(eq=False)
class Frame:
    """A frame of a Sheet: `after` is the one to its left, or None; top: how high it stands."""

    node: bpy.types.Node
    after: Frame | None
    top: float
    nodes: list[bpy.types.Node] = field(default_factory=list)
    entries: list[bpy.types.Node] = field(default_factory=list)
    left: float = 0.0
    right: float = 0.0


class Sheet:
    """The tree of a group, written as formulas.

    Begin a frame for each equation; what is calculated then stands in it, each node to the right of those that feed it.

    tree:  an empty bpy.types.NodeTree; inputs: the names of its sockets by the identifiers that formulas use
    """

    def __init__(self, tree: bpy.types.NodeTree, inputs: Mapping[str, str]):
        self.tree, self._nodes, self._inputs = tree, Nodes(tree, later=True), inputs
        self._frames: list[Frame] = []
        self._values: dict[tuple, Value] = {}

    def frame(self, title: str, *, after: Frame | None = None, top: float = 0.0) -> Frame:
        """Begin a frame."""
        node = self.tree.nodes.new("NodeFrame")
        node.label = title
        self._frames.append(Frame(node, after, top))
        return self._frames[-1]

    def inputs(self, *identifiers: str) -> list[Value]:
        """These inputs of the group, from a node beside the frame that shows no others."""
        node = self.tree.nodes.new("NodeGroupInput")
        self._frames[-1].entries.append(node)
        names = {self._inputs[identifier]: identifier for identifier in identifiers}
        node.outputs.foreach_set("hide", [socket.name not in names for socket in node.outputs])
        values = [Value(self, node.outputs[name]) for name in names]
        self.name(dict(zip(identifiers, values, strict=True)))
        return values

    def node(self, type_: str, label: str = "", inputs: Mapping | None = None, **properties) -> Value:
        """The first output of a node of that type; inputs: a Value or a constant by the socket's name."""
        inputs = inputs or {}
        for operand in inputs.values():
            if isinstance(operand, Value):
                operand.uses += 1
        node = self._nodes.add(type_, inputs={key: _fed(operand) for key, operand in inputs.items()}, **properties)
        node.label, node.hide, node.width, node.parent = label, True, WIDTH, self._frames[-1].node
        self._frames[-1].nodes.append(node)
        return Value(self, node.outputs[0])

    def calculated(self, symbol: str, operands: tuple) -> Value:
        """The Value of an operation; its node is made where no other does just that."""
        key = (symbol, *operands)
        if key not in self._values:
            value = self._choice(*operands) if symbol == "choose" else self._arithmetic(symbol, operands)
            value.symbol, value.operands = symbol, operands
            self._values[key] = value
        return self._values[key]

    def _arithmetic(self, symbol, operands):
        if not any(map(_is_vector, operands)):
            return self.node("ShaderNodeMath", inputs=dict(enumerate(operands)), operation=MATH[symbol])
        inputs = {0: operands[0], "Scale": operands[1]} if symbol == "scale" else dict(enumerate(operands))
        vector = self.node("ShaderNodeVectorMath", inputs=inputs, operation=VECTOR_MATH[symbol])
        return vector["Value"] if symbol in ("dot", "length") else vector

    def _choice(self, share, yes, no):
        if yes.socket.type == "SHADER":
            return self.node("ShaderNodeMixShader", inputs={0: share, 1: no, 2: yes})
        type_ = "Vector" if yes.is_vector() else "Float"
        inputs = {"Factor_Float": share, f"A_{type_}": no, f"B_{type_}": yes}
        node = self.node("ShaderNodeMix", inputs=inputs, data_type=type_.upper(), clamp_factor=False).node
        return Value(self, next(socket for socket in node.outputs if socket.identifier == f"Result_{type_}"))

    def name(self, names: Mapping[str, object]) -> None:
        """Call the values among these, such as a function's locals(), by their keys; labels are written with them."""
        for name, value in names.items():
            if isinstance(value, Value):
                value.name = value.name or name
            elif isinstance(value, Complex):
                self.name({f"Re {name}": value.re, f"Im {name}": value.im})

    def end(self, *outputs: Value, first: int = 0) -> None:
        """Let the group give these, in the order of its outputs from the `first`; labels and places of our nodes follow."""
        self._join_products()
        for value in self._values.values():
            if value.socket:
                value.node.label = value.text()
        feeding = defaultdict(list)
        for output, socket in self._nodes.links:
            feeding[socket.node].append(output.node)
        places = {}
        for frame in self._frames:
            places |= self._place(frame, feeding)
        leave = next((node for node in self.tree.nodes if node.type == "GROUP_OUTPUT"), None)
        if leave is None:
            leave = self.tree.nodes.new("NodeGroupOutput")
            places[leave] = (max(frame.right for frame in self._frames), self._frames[-1].top)
        # the last is the one that makes further ones
        for socket, value in zip(leave.inputs[first:], outputs, strict=False):
            self._nodes.feed(socket, value.socket)
        # at once, since Blender looks at the whole tree again for each
        self.tree.nodes.foreach_set(
            "location", [number for node in self.tree.nodes for number in places.get(node, node.location)]
        )
        self._nodes.link()

    def _join_products(self):
        """Let one node do a sum and a product in it that has no name and no other use."""
        for total in self._values.values():
            if total.symbol != "+" or total.is_vector():
                continue
            product = next((operand for operand in total.operands if _is_inner_product(operand)), None)
            if product is None:
                continue
            rest = next(operand for operand in total.operands if operand is not product)
            frame = next(frame for frame in self._frames if product.node in frame.nodes)
            frame.nodes.remove(product.node)
            gone = {product.node, total.node}
            self._nodes.links = [link for link in self._nodes.links if link[1].node not in gone]
            self.tree.nodes.remove(product.node)
            product.socket = None
            total.node.operation = "MULTIPLY_ADD"
            for socket, operand in zip(total.node.inputs, (*product.operands, rest), strict=True):
                self._nodes.feed(socket, _fed(operand))

    def _place(self, frame, feeding):
        """{node: where it stands} of a frame."""
        frame.left = frame.after.right if frame.after else 0.0
        # a frame closes tightly around its nodes, over the title's place: this one keeps it free
        spacer = self.tree.nodes.new("NodeReroute")
        spacer.parent = frame.node
        places = {spacer: (frame.left, frame.top + 40)}
        column, rows = {}, {}
        for node in frame.nodes:
            here = column[node] = max((column[other] + 1 for other in feeding[node] if other in column), default=0)
            row = rows[here] = rows.get(here, -1) + 1
            # every second column lies half a row lower, so that links pass between the nodes
            places[node] = (frame.left + COLUMN * here, frame.top - ROW * (row + 0.5 * (here % 2)))
        frame.right = frame.left + COLUMN * len(rows) + GAP
        entries = {
            node: (frame.left - ENTRY, frame.top - 4 * ROW * number) for number, node in enumerate(frame.entries)
        }
        return places | entries


def _fed(operand):
    return operand.socket if isinstance(operand, Value) else operand


def _is_inner_product(operand):
    return isinstance(operand, Value) and operand.symbol == "*" and operand.uses == 1 and not operand.name
