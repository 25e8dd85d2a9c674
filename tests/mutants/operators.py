"""Source -> its mutants: the same module with one small mistake each.

The mistakes are those that safety code suffers from: a comparison that takes in its boundary or
not, a margin of the wrong sign or of nothing, the least for the most, one condition of several left
out, a guard or a step that is missing, the other side of a choice.

Left out are mistakes that any call would show (a result of None, a name that does not exist), and
those that only change indices, texts, annotations, decorators and default values.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass

_COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
_ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult, ast.BitOr: ast.BitAnd, ast.BitAnd: ast.BitOr,
    ast.BitXor: ast.BitOr, ast.LShift: ast.RShift, ast.RShift: ast.LShift,
}  # fmt: skip
_CALLS = {
    "min": "max", "max": "min", "ceil": "floor", "floor": "ceil", "any": "all", "all": "any",
    "minimum": "maximum", "maximum": "minimum",
}  # fmt: skip
_LEAVES = (ast.Continue, ast.Break)

Put = Callable[[ast.AST], None]
"""Puts another node in the place of one."""


@dataclass(frozen=True)
class Mutant:
    """One mistake: in which function, and the statement without and with it.

    ``function``  its qualified name, empty for a statement of the module.
    ``number``    which one, where a function has the same statement more than once.
    """

    function: str
    line: int
    before: str
    after: str
    number: int
    module: ast.Module
    name: str | None
    """The constant of the module that is set, for a statement of the module."""

    @property
    def key(self) -> tuple[str, str, str, int]:
        """What it is known by, wherever in the file it has moved."""
        return self.function, self.before, self.after, self.number

    def __str__(self) -> str:
        times = f" ({self.number})" if self.number > 1 else ""
        return f"{self.line} {self.function}{times}\n    - {self.before}\n    + {self.after}"


def mutants(source: str) -> Iterator[Mutant]:
    """All of a module's, in the order of its text; each must be used before the next is asked for.

    They share one tree, in which one place at a time is changed.
    """
    module = ast.parse(source)
    seen: Counter[tuple[str, str, str]] = Counter()
    for owner, statement, name in _statements(module):
        before = _header(statement)
        for change, undo in _changes(statement):
            change()
            after = _header(statement)
            seen[owner, before, after] += 1
            yield Mutant(
                owner, statement.lineno, before, after, seen[owner, before, after], module, name
            )
            undo()


def _statements(module: ast.Module) -> Iterator[tuple[str, ast.stmt, str | None]]:
    """(function, statement, None) of all functions, ("", statement, name) of plain constants."""
    for statement in module.body:
        match statement:
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                if statement.value is not None:
                    yield "", statement, name
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                for owner, inner in _of_definition(statement, ""):
                    yield owner, inner, None


def _of_definition(node: ast.stmt, owner: str) -> Iterator[tuple[str, ast.stmt]]:
    if isinstance(node, ast.ClassDef):
        for inner in node.body:
            if isinstance(inner, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                yield from _of_definition(inner, f"{owner}{node.name}.")
    elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        name = f"{owner}{node.name}"
        for inner in node.body:
            yield from _of_body(inner, name)


def _of_body(statement: ast.stmt, owner: str) -> Iterator[tuple[str, ast.stmt]]:
    if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        yield from _of_definition(statement, f"{owner}.")
        return
    yield owner, statement
    for block in _blocks(statement):
        for inner in block:
            yield from _of_body(inner, owner)


def _blocks(statement: ast.stmt) -> list[list[ast.stmt]]:
    blocks = [getattr(statement, field, []) for field in ("body", "orelse", "finalbody")]
    blocks += [handler.body for handler in getattr(statement, "handlers", [])]
    return blocks + [case.body for case in getattr(statement, "cases", [])]


def _header(statement: ast.stmt) -> str:
    """The statement in one line, without the statements in it."""
    return ast.unparse(statement).partition("\n")[0]


_Change = tuple[Callable[[], None], Callable[[], None]]
"""What makes the mistake, and what takes it back."""


def _changes(statement: ast.stmt) -> Iterator[_Change]:
    yield from _left_out(statement)
    for field, value in ast.iter_fields(statement):
        if field in ("body", "orelse", "finalbody", "handlers", "cases", "annotation", "op"):
            continue
        for index, part in enumerate(value if isinstance(value, list) else [value]):
            if isinstance(part, ast.withitem):
                yield from _of_expression(part.context_expr, _putter(part, "context_expr", None))
            elif isinstance(part, ast.expr):
                place = index if isinstance(value, list) else None
                yield from _of_expression(part, _putter(statement, field, place))
    if isinstance(statement, ast.AugAssign) and type(statement.op) in _ARITHMETIC:
        yield _swap(statement, "op", _ARITHMETIC[type(statement.op)]())


def _left_out(statement: ast.stmt) -> Iterator[_Change]:
    """The statement dropped, or its condition never met."""
    if isinstance(statement, ast.If):
        last = statement.body[-1]
        if isinstance(last, ast.Raise | ast.Return | ast.Continue | ast.Break):
            yield _swap(statement, "test", ast.Constant(False))
        else:
            yield _swap(statement, "test", ast.UnaryOp(ast.Not(), statement.test))
    # Without its ``super`` a method has another closure, which cannot be swapped.
    closed = any(isinstance(part, ast.Name) and part.id == "super" for part in ast.walk(statement))
    dropped = isinstance(statement, (*_LEAVES, ast.AugAssign)) or (
        isinstance(statement, ast.Expr)
        and not isinstance(statement.value, ast.Constant | ast.Yield)
    )
    if isinstance(statement, ast.Assign):
        dropped = all(isinstance(t, ast.Attribute | ast.Subscript) for t in statement.targets)
    if dropped and not closed:
        yield _become(statement, ast.Pass())


def _swap(node: ast.AST, field: str, new: object) -> _Change:
    old = getattr(node, field)
    return lambda: setattr(node, field, new), lambda: setattr(node, field, old)


def _become(node: ast.stmt, other: ast.stmt) -> _Change:
    """Turn a statement into one of another class where it stands."""
    kind, content = node.__class__, dict(node.__dict__)

    def change() -> None:
        places = {name: content[name] for name in ("lineno", "col_offset") if name in content}
        node.__dict__.clear()
        node.__class__ = other.__class__  # type: ignore[assignment]
        node.__dict__.update(places)

    def undo() -> None:
        node.__dict__.clear()
        node.__class__ = kind  # type: ignore[assignment]
        node.__dict__.update(content)

    return change, undo


def _putter(node: ast.AST, field: str, index: int | None) -> Put:
    def put(new: ast.AST) -> None:
        if index is None:
            setattr(node, field, new)
        else:
            getattr(node, field)[index] = new

    return put


def _of_expression(node: ast.expr, put: Put) -> Iterator[_Change]:
    for new in _instead_of(node):
        yield (lambda new=new: put(new)), (lambda: put(node))
    for field, value in ast.iter_fields(node):
        if isinstance(node, ast.Subscript) and field == "slice" and not _has_sum(node.slice):
            continue
        for index, part in enumerate(value if isinstance(value, list) else [value]):
            place = index if isinstance(value, list) else None
            if isinstance(part, ast.keyword):
                yield from _of_expression(part.value, _putter(part, "value", None))
            elif isinstance(part, ast.comprehension):
                yield from _of_expression(part.iter, _putter(part, "iter", None))
                for k, test in enumerate(part.ifs):
                    yield from _of_expression(test, _putter(part, "ifs", k))
            elif isinstance(part, ast.expr):
                yield from _of_expression(part, _putter(node, field, place))


def _has_sum(node: ast.AST) -> bool:
    return any(isinstance(part, ast.BinOp | ast.UnaryOp) for part in ast.walk(node))


def _instead_of(node: ast.expr) -> Iterator[ast.expr]:
    """What may stand in place of one expression, its parts being as they are."""
    match node:
        case ast.Compare(left=left, ops=[op], comparators=[right]):
            yield ast.Compare(left, [_COMPARISONS[type(op)]()], [right])
        case ast.BoolOp(op=op, values=values):
            yield ast.BoolOp(ast.Or() if isinstance(op, ast.And) else ast.And(), values)
            for index in range(len(values)):
                rest = values[:index] + values[index + 1 :]
                yield rest[0] if len(rest) == 1 else ast.BoolOp(op, rest)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _ARITHMETIC:
            yield ast.BinOp(left, _ARITHMETIC[type(op)](), right)
        case ast.UnaryOp(operand=ast.Constant()):
            pass  # -1 is a number: the constant's own mistakes stand for it
        case ast.UnaryOp(op=ast.USub() | ast.Invert() | ast.Not(), operand=operand):
            yield operand
        case ast.IfExp(test=test, body=body, orelse=orelse):
            yield ast.IfExp(test, orelse, body)
        case ast.Call(func=ast.Name(id="abs"), args=[argument]):
            yield argument
        case ast.Call(func=ast.Name(id=name), args=args, keywords=keywords) if name in _CALLS:
            yield ast.Call(ast.Name(_CALLS[name], ast.Load()), args, keywords)
        case ast.Call(func=ast.Attribute(value=value, attr=name), args=args, keywords=keywords):
            if name in _CALLS:
                yield ast.Call(ast.Attribute(value, _CALLS[name], ast.Load()), args, keywords)
        case ast.Constant(value=value):
            other = _other_number(value)
            if other is not None:
                yield ast.Constant(other)


def _other_number(value: object) -> bool | int | float | None:
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return 0 if value == 1 else value + 1
    if isinstance(value, float):
        return 1.0 if value == 0.0 else 0.0
    return None
