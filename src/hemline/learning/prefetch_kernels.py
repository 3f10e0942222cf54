"""Asking for memory ahead of its use, in compiled code: for weights that no near cache holds from frame to frame."""

import llvmlite.ir as ir

from hemline.compiled import intrinsic, types

LINE = 64
"""Bytes that come at once."""

_BYTES, _INT32 = ir.IntType(8).as_pointer(), ir.IntType(32)


def ask_for(builder, pointer):
    """Add an instruction that asks for the line at a pointer; harmless past the end of an array."""
    ask = builder.module.declare_intrinsic(
        "llvm.prefetch", [_BYTES], ir.FunctionType(ir.VoidType(), [_BYTES, _INT32, _INT32, _INT32])
    )
    # to read, to be kept, data
    builder.call(ask, [builder.bitcast(pointer, _BYTES), *(ir.Constant(_INT32, flag) for flag in (0, 3, 1))])


@intrinsic
def ask_for_entry(typing, array, index):
    """Ask for the line that holds entry `index` of a contiguous array of one axis."""

    def generate(context, builder, signature, arguments):
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        ask_for(builder, builder.gep(data, [arguments[1]]))

    return types.void(array, index), generate
