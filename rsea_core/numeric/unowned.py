"""Arrays without an owner, for compiled code that passes them on all the time."""

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


@intrinsic
def unowned(typing_context, arrays):
    """The same array, or tuple with all arrays in it, without an owner.

    To pass it on counts no references: the counting is atomic and takes as long as a step. Whoever
    calls keeps the memory alive.
    """

    def without(context, builder, kind, value):
        if isinstance(kind, types.Array):
            found = context.make_array(kind)(context, builder, value)
            found.meminfo = cgutils.get_null_value(found.meminfo.type)
            found.parent = cgutils.get_null_value(found.parent.type)
            return found._getvalue()
        if isinstance(kind, types.BaseTuple):
            items = cgutils.unpack_tuple(builder, value)
            items = [without(context, builder, *each) for each in zip(kind, items, strict=True)]
            return context.make_tuple(builder, kind, items)
        return value

    def build(context, builder, signature, arguments):
        return without(context, builder, arrays, *arguments)

    return arrays(arrays), build
