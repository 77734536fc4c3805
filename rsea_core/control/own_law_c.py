"""An own law as C99, translated from the source that the simulation compiles.

Supported: parameters, states, signals and local variables; numbers of the law's module; + - * / //
% and **; comparisons, `and`, `or`, `not`; `if`, conditional expressions, `return`; abs, min, max,
float and the functions of `math` and numpy in FUNCTIONS. What else stands in a law is refused with
its line.
"""

import ast
import builtins
import inspect
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

import rsea_core.control.laws.own_law_source as source
from rsea_core.control.laws.own_law import OwnLaw
from rsea_core.errors import ControllerError

SAME = (
    "sqrt", "exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh", "floor", "ceil", "copysign",
    "hypot", "fabs",
)  # fmt: skip
OTHER = {
    "arcsin": "asin", "arccos": "acos", "arctan": "atan", "arctan2": "atan2", "abs": "fabs",
    "minimum": "rsea_min", "maximum": "rsea_max", "sign": "rsea_sign", "power": "pow",
}  # fmt: skip
FUNCTIONS: dict[Callable, str] = {
    **{getattr(module, name): name for module in (math, np) for name in SAME},
    **{getattr(math, name): name for name in ("asin", "acos", "atan", "atan2", "pow")},
    **{getattr(np, name): found for name, found in OTHER.items()},
    abs: "fabs", min: "rsea_min", max: "rsea_max", float: "",
}  # fmt: skip
ARITHMETIC = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
COMPARISONS = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip
HELPERS = """static inline double rsea_min(double a, double b) { return b < a ? b : a; }
static inline double rsea_max(double a, double b) { return b > a ? b : a; }
static inline double rsea_sign(double x) { return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : x; }
/* x modulo y, with the sign of y, as Python's % */
static inline double rsea_remainder(double x, double y) {
    double r = fmod(x, y);
    return r != 0.0 && (r < 0.0) != (y < 0.0) ? r + y : r;
}
/* as Python's //, where x / y itself may round up */
static inline double rsea_whole(double x, double y) {
    double r = fmod(x, y), d = (x - r) / y, low;
    if (r != 0.0 && (r < 0.0) != (y < 0.0)) d -= 1.0;
    low = floor(d);
    return d - low > 0.5 ? low + 1.0 : low;
}
static inline double rsea_law(const double *p, double *s, const rsea_input *y) {
    double deflection = y->motor_angle_rad / p[GEAR] - y->load_angle_rad;
    double torque = rsea_spring_torque(p + SPRING, REGIONS, deflection);"""
SIGNALS = {f"y_{name}": f"y->{name}" for name in source.SIGNALS[:5]} | {
    "y_deflection_rad": "deflection",
    "y_torque_Nm": "torque",
}


def own_law_c(law: OwnLaw, constants: Sequence[str]) -> str:
    """The C text of a law: helpers, then `rsea_law`.

    Parameters
    ----------
    constants : sequence of str
        Names of what the law's `design` gives; their numbers follow the law's own.

    Raises
    ------
    ControllerError
        In one line, with the line of the law, if it uses what has no C form.
    """
    kind = type(law)
    step = getattr(kind.law, "step", kind.law)
    names = (*kind.parameter_names(), *constants)
    try:
        made = source.rewritten(step, names, tuple(kind.states), method=inspect.isclass(kind.law))
    except source.NotCompiledError as problem:
        raise ControllerError(f"{kind.kind} has no C form: {problem}") from problem
    first = inspect.getsourcelines(step)[1] - 1
    translator = _Translator(kind.kind, first, source.names_in_reach(step))
    body = translator.block(made.body)
    if not _returns(made.body):
        raise translator.refused(made.body[-1], "not every way through it returns a command")
    declared = [f"    double {name} = 0.0;" for name in translator.locals.values()]
    return "\n".join([HELPERS, *declared, "    (void)torque;", "    (void)s;", *body, "}"])


def _returns(body: Sequence[ast.stmt]) -> bool:
    last = body[-1]
    if isinstance(last, ast.If):
        return bool(last.orelse) and _returns(last.body) and _returns(last.orelse)
    return isinstance(last, ast.Return)


class _Translator:
    """Statements and expressions of a rewritten law; `locals` are its variables by name."""

    def __init__(self, kind: str, first: int, reach: Mapping):
        self.kind, self.first, self.reach = kind, first, reach
        self.locals: dict[str, str] = {}

    def refused(self, node: ast.AST, why: str = "") -> ControllerError:
        line = getattr(node, "lineno", 1) + self.first
        text = why or f"{ast.unparse(node).splitlines()[0][:60]!r} cannot be translated"
        return ControllerError(f"{self.kind} has no C form: line {line}: {text}")

    def block(self, body: Sequence[ast.stmt]) -> list[str]:
        return [f"    {line}" for node in body for line in self.statement(node)]

    def statement(self, node: ast.stmt) -> list[str]:
        match node:
            case ast.Pass() | ast.Expr(value=ast.Constant()):
                return []
            case ast.Return(value=ast.expr() as value):
                return [f"return rsea_clip({self.number(value)}, p[LIMIT]);"]
            case ast.Assign(targets=[ast.Tuple(elts=to)], value=ast.Tuple(elts=values)) if len(
                to
            ) == len(values):
                early = [f"    double t{j} = {self.number(v)};" for j, v in enumerate(values)]
                return ["{", *early, *(f"    {self.target(n)} = t{j};" for j, n in enumerate(to)),
                        "}"]  # fmt: skip
            case ast.Assign(targets=targets, value=value):
                found = self.number(value)
                return [f"{' = '.join(self.target(n) for n in targets)} = {found};"]
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                return [f"{self.target(target)} = {self.number(value)};"]
            case ast.AugAssign(target=target, op=op, value=value):
                now = ast.copy_location(ast.BinOp(_read(target), op, value), node)
                return [f"{self.target(target)} = {self.number(now)};"]
            case ast.If(test=test, body=body, orelse=orelse):
                after = ["} else {", *self.block(orelse)] if orelse else []
                return [f"if ({self.truth(test)}) {{", *self.block(body), *after, "}"]
        raise self.refused(node)

    def target(self, node: ast.expr) -> str:
        match node:
            case ast.Subscript(value=ast.Name(id="s"), slice=ast.Constant(value=place)):
                return f"s[{place}]"
            case ast.Name(id=name) if name not in SIGNALS and not name.startswith("y_"):
                plain = "".join(c if c.isascii() and c.isalnum() else "_" for c in name)
                return self.locals.setdefault(name, f"v{len(self.locals)}_{plain}")
        raise self.refused(node, f"{ast.unparse(node)} cannot be assigned to")

    def number(self, node: ast.expr) -> str:
        match node:
            case ast.Constant(value=bool() | int() | float() as value):
                return literal(float(value))
            case ast.Subscript(value=ast.Name(id=array), slice=ast.Constant(value=place)):
                return f"{array}[{place}]"
            case ast.Name(id=name):
                return self.named(node, name)
            case ast.Attribute():
                return self.constant(node)
            case ast.BinOp(left=left, op=op, right=right):
                return self.arithmetic(node, self.number(left), op, self.number(right))
            case ast.UnaryOp(op=ast.USub(), operand=value):
                return f"(-{self.number(value)})"
            case ast.UnaryOp(op=ast.UAdd(), operand=value):
                return self.number(value)
            case ast.IfExp(test=test, body=body, orelse=orelse):
                return f"({self.truth(test)} ? {self.number(body)} : {self.number(orelse)})"
            case ast.Compare() | ast.UnaryOp(op=ast.Not()):
                return f"({self.truth(node)} ? 1.0 : 0.0)"
            case ast.Call(func=function, args=arguments, keywords=[]):
                return self.call(node, function, arguments)
        raise self.refused(node)

    def named(self, node: ast.Name, name: str) -> str:
        if name in self.locals:
            return self.locals[name]
        if name in SIGNALS:
            return SIGNALS[name]
        if name.startswith("y_"):
            raise self.refused(node, f"y.{name[2:]} is no input of the C form")
        return self.constant(node)

    def constant(self, node: ast.expr) -> str:
        value = self.resolved(node)
        if isinstance(value, bool | int | float | np.floating | np.integer):
            return literal(float(value))
        raise self.refused(node)

    def resolved(self, node: ast.expr) -> object:
        """What a name, or an attribute of a module, is in Python."""
        match node:
            case ast.Name(id=name):
                return self.reach.get(name, getattr(builtins, name, None))
            case ast.Attribute(value=ast.Name(id=name), attr=attribute):
                return getattr(self.reach.get(name), attribute, None)
        return None

    def arithmetic(self, node: ast.AST, left: str, op: ast.operator, right: str) -> str:
        if type(op) in ARITHMETIC:
            return f"({left} {ARITHMETIC[type(op)]} {right})"
        if isinstance(op, ast.Pow):
            return f"pow({left}, {right})"
        if isinstance(op, ast.FloorDiv):
            return f"rsea_whole({left}, {right})"
        if isinstance(op, ast.Mod):
            return f"rsea_remainder({left}, {right})"
        raise self.refused(node)

    def call(self, node: ast.Call, function: ast.expr, arguments: Sequence[ast.expr]) -> str:
        called = self.resolved(function)
        try:
            name = FUNCTIONS[called]
        except (KeyError, TypeError):
            raise self.refused(node) from None
        given = [self.number(a) for a in arguments]
        if name in ("rsea_min", "rsea_max"):
            if len(given) < 2:
                raise self.refused(node)
            found = given[0]
            for other in given[1:]:
                found = f"{name}({found}, {other})"
            return found
        return f"{name}({', '.join(given)})"

    def truth(self, node: ast.expr) -> str:
        match node:
            case ast.BoolOp(op=op, values=values):
                sign = " && " if isinstance(op, ast.And) else " || "
                return "(" + sign.join(self.truth(v) for v in values) + ")"
            case ast.UnaryOp(op=ast.Not(), operand=value):
                return f"!({self.truth(value)})"
            case ast.Compare(left=left, ops=signs, comparators=others):
                sides = [self.number(side) for side in (left, *others)]
                if not all(type(sign) in COMPARISONS for sign in signs):
                    raise self.refused(node)
                pairs = zip(sides[:-1], signs, sides[1:], strict=True)
                found = [f"({a} {COMPARISONS[type(o)]} {b})" for a, o, b in pairs]
                return found[0] if len(found) == 1 else f"({' && '.join(found)})"
        return f"({self.number(node)} != 0.0)"


def _read(node: ast.expr) -> ast.expr:
    """A target as what is read."""
    found = ast.parse(ast.unparse(node), mode="eval").body
    return ast.copy_location(found, node)


def literal(value: float) -> str:
    """A number of C."""
    if math.isinf(value):
        return "HUGE_VAL" if value > 0 else "(-HUGE_VAL)"
    if math.isnan(value):
        return "(HUGE_VAL - HUGE_VAL)"
    return repr(value) if value >= 0 else f"({value!r})"
