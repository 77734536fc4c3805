"""Arrays without an owner, for compiled code that passes them on all the time."""

from numba.core import cgutils
from numba.extending import intrinsic


@intrinsic
def unowned(typing_context, array):
    """The same array without an owner, so that passing it on counts no references.

    The counting is atomic and takes as long as a step. Whoever calls keeps the memory alive.
    """

    def build(context, builder, signature, arguments):
        found = context.make_array(array)(context, builder, arguments[0])
        found.meminfo = cgutils.get_null_value(found.meminfo.type)
        found.parent = cgutils.get_null_value(found.parent.type)
        return found._getvalue()

    return array(array), build
