"""The source of an own law, rewritten from attributes to arrays, for compilers.

    self.kp, self.integral, y.torque_Nm   ->   p[0], s[0], y_torque_Nm

The rewritten function takes (p, s, y_...), has the names of the law's own module in reach, and is
what is compiled and what the C export translates.
"""

import ast
import inspect
import textwrap
from collections.abc import Callable, Mapping, Sequence

from rsea_core.errors import ControllerError

SIGNALS = (
    "reference", "reference_rate", "reference_acceleration", "motor_angle_rad", "load_angle_rad",
    "current_A", "torque_Nm", "deflection_rad",
)  # fmt: skip
"""What `y` has: the reference with two derivatives, encoders, current; torque from the encoders."""


class NotCompiledError(Exception):
    """Why a law's source cannot be rewritten."""


def _element(array: str, place: int, node: ast.expr) -> ast.expr:
    found = ast.Subscript(ast.Name(array, ast.Load()), ast.Constant(place), node.ctx)
    return ast.copy_location(found, node)


class _Rewriter(ast.NodeTransformer):
    def __init__(self, own: str, read: str, parameters: Mapping, states: Mapping):
        self.own, self.read = own, read
        self.parameters, self.states = parameters, states

    def visit_Attribute(self, node: ast.Attribute):
        if not isinstance(node.value, ast.Name) or node.value.id not in (self.own, self.read):
            return self.generic_visit(node)
        if node.value.id == self.read:
            if node.attr not in SIGNALS:
                raise ControllerError(f"y.{node.attr} is unknown; y has {', '.join(SIGNALS)}")
            return ast.copy_location(ast.Name(f"y_{node.attr}", node.ctx), node)
        for array, places in (("s", self.states), ("p", self.parameters)):
            if node.attr in places:
                if array == "p" and not isinstance(node.ctx, ast.Load):
                    raise ControllerError(
                        f"self.{node.attr} is a parameter and is assigned to; name what the law"
                        " remembers in `state`"
                    )
                return _element(array, places[node.attr], node)
        if not isinstance(node.ctx, ast.Load):
            raise ControllerError(
                f"self.{node.attr} is assigned to and is no state; name it in `state`"
            )
        raise NotCompiledError(f"self.{node.attr} is neither a number nor a state of the law")

    def visit_Name(self, node: ast.Name):
        if node.id in (self.own, self.read):
            raise NotCompiledError(f"{node.id} is used as a whole")
        if node.id in self.parameters and self.own == "":  # a function's own arguments
            return _element("p", self.parameters[node.id], node)
        return node


def definition(step: Callable) -> ast.FunctionDef:
    """The parsed source of a law.

    Raises
    ------
    NotCompiledError
        If Python does not know it.
    """
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(step)))
    except (OSError, TypeError, SyntaxError) as problem:
        raise NotCompiledError(f"the source of {step.__name__} cannot be read") from problem
    if not isinstance(tree.body[0], ast.FunctionDef):
        raise NotCompiledError(f"{step.__name__} is no plain function")
    return tree.body[0]


def rewritten(
    step: Callable, parameters: Sequence[str], states: Sequence[str], *, method: bool
) -> ast.FunctionDef:
    """The law as a function `law(p, s, y_reference, ...)`.

    Raises
    ------
    NotCompiledError
        If the source uses the object as more than a set of numbers.
    ControllerError
        If it reads a signal that there is none of, or writes what it may not.
    """
    function = definition(step)
    names = [a.arg for a in function.args.args]
    own, read = (names[0], names[1]) if method else ("", names[0])
    places = {name: j for j, name in enumerate(parameters)}
    changed = _Rewriter(own, read, places, {name: j for j, name in enumerate(states)})
    body = [changed.visit(part) for part in function.body]
    arguments = ["p", "s", *(f"y_{name}" for name in SIGNALS)]
    made = ast.FunctionDef(
        name="law",
        args=ast.arguments(
            posonlyargs=[], args=[ast.arg(a) for a in arguments], kwonlyargs=[], kw_defaults=[],
            defaults=[],
        ),
        body=body,
        decorator_list=[],
    )  # fmt: skip
    return ast.fix_missing_locations(made)


def names_in_reach(step: Callable) -> dict[str, object]:
    """What the names of a law's module and of its closure stand for."""
    names = dict(step.__globals__)
    if step.__closure__:
        cells = zip(step.__code__.co_freevars, step.__closure__, strict=True)
        names |= {name: cell.cell_contents for name, cell in cells}
    return names


def as_function(made: ast.FunctionDef, step: Callable) -> Callable:
    """The rewritten law as a Python function with the names of the original in reach."""
    names = names_in_reach(step)
    exec(compile(ast.Module([made], []), f"<{step.__qualname__}>", "exec"), names)
    return names["law"]
