"""Compiled: memory is prefetched, for weights that no near cache keeps from frame to frame."""

import llvmlite.ir as ir

from hemline.compiled import intrinsic, types

LINE = 64
"""Bytes of a cache line."""

_BYTES, _INT32 = ir.IntType(8).as_pointer(), ir.IntType(32)


def ask_for(builder, pointer):
    """Emits an instruction that prefetches the cache line at a pointer; harmless past the end of an array."""
    ask = builder.module.declare_intrinsic(
        "llvm.prefetch", [_BYTES], ir.FunctionType(ir.VoidType(), [_BYTES, _INT32, _INT32, _INT32])
    )
    # flags: for reading, keep in all caches, data cache
    builder.call(ask, [builder.bitcast(pointer, _BYTES), *(ir.Constant(_INT32, flag) for flag in (0, 3, 1))])


@intrinsic
def ask_for_entry(typing, array, index):
    """Prefetches a cache line.

    Reads: array (n,), contiguous; index: an entry in the line.
    """

    def generate(context, builder, signature, arguments):
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        ask_for(builder, builder.gep(data, [arguments[1]]))

    return types.void(array, index), generate
