"""Arrays without an owner, for compiled code that passes them on all the time."""

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


@intrinsic
def unowned(typing_context, arrays):
    """The same array, or tuple of arrays, without an owner: to pass it on counts no references.

    The counting is atomic and takes as long as a step. Whoever calls keeps the memory alive.
    """

    def without(context, builder, kind, value):
        found = context.make_array(kind)(context, builder, value)
        found.meminfo = cgutils.get_null_value(found.meminfo.type)
        found.parent = cgutils.get_null_value(found.parent.type)
        return found._getvalue()

    def build(context, builder, signature, arguments):
        (value,) = arguments
        if isinstance(arrays, types.Array):
            return without(context, builder, arrays, value)
        items = cgutils.unpack_tuple(builder, value)
        items = [without(context, builder, *each) for each in zip(arrays, items, strict=True)]
        return context.make_tuple(builder, arrays, items)

    return arrays(arrays), build
