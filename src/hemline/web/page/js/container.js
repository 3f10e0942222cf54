// Reads arrays and metadata of a page from hemline's container (safetensors, docs/format.md).

const KINDS = {
  F64: Float64Array, F32: Float32Array, F16: Uint16Array, I32: Int32Array, U32: Uint32Array, I16: Int16Array,
  U16: Uint16Array, I8: Int8Array, U8: Uint8Array,
};

/** Reads what `web/contents.py` wrote: `metadata`, and `arrays` by name, typed arrays with a `shape`; half floats are widen. */
export function readContainer(bytes) {
  const size = Number(new DataView(bytes.buffer, bytes.byteOffset).getBigUint64(0, true));
  const { __metadata__: header, ...entries } = JSON.parse(new TextDecoder().decode(bytes.subarray(8, 8 + size)));
  const arrays = {};
  for (const [name, { dtype, shape, data_offsets: [start, end] }] of Object.entries(entries)) {
    const array = new KINDS[dtype](bytes.slice(8 + size + start, 8 + size + end).buffer);
    arrays[name] = dtype === "F16" ? widen(array) : array;
    arrays[name].shape = shape;
  }
  return { arrays, metadata: JSON.parse(header.hemline) };
}

/** Returns the arrays whose names begin with `prefix` and a dot, without that prefix. */
export function part(arrays, prefix) {
  const own = Object.keys(arrays).filter((name) => name.startsWith(`${prefix}.`));
  return Object.fromEntries(own.map((name) => [name.slice(prefix.length + 1), arrays[name]]));
}

/** Converts half floats to float32. */
function widen(halves) {
  return Float32Array.from(halves, (bits) => {
    const sign = bits & 0x8000 ? -1 : 1, exponent = (bits >> 10) & 31, mantissa = bits & 1023;
    if (exponent === 0) return sign * mantissa * 2 ** -24;
    return sign * (1 + mantissa / 1024) * 2 ** (exponent - 15);
  });
}
