// The compiled kernels and their memory.

const PAGE = 65536;

/** Kernels by name, with `floats(count)`, `words(count)`, `bytes(count)`: arrays in their memory, pointer = byteOffset. */
export async function openKernels(code, bytes) {
  const memory = new WebAssembly.Memory({ initial: Math.ceil(bytes / PAGE) + 1 });
  const { instance } = await WebAssembly.instantiate(code, { env: { memory } });
  let free = 64;
  const room = (Kind) => (count) => {
    const array = new Kind(memory.buffer, free, count);
    free += (array.byteLength + 31) & ~15; // vectors are stored with one extra number
    return array;
  };
  const copyInto = (make) => (values) => {
    const array = make(values.length);
    array.set(values);
    return array;
  };
  const floats = room(Float32Array), words = room(Int32Array), halves = room(Int16Array), bytesOf = room(Int8Array);
  return {
    ...instance.exports, floats, words, halves, bytes: bytesOf,
    floatsOf: copyInto(floats), wordsOf: copyInto(words), bytesOf: copyInto(bytesOf),
  };
}

/** Returns an upper bound of the memory of the kernels for the arrays of a page [bytes]. */
export function memoryFor(arrays) {
  const sizes = Object.values(arrays).map((array) => array.length * (array instanceof Int8Array ? 1.1 : 4));
  return 2 * sizes.reduce((one, other) => one + other, 0) + 16 * 2 ** 20;
}

/** Converts transforms (joints, 3, 4) to columns (joints, 4, 4), each padded by a zero, as the kernels need them. */
export function intoColumns(transforms, columns) {
  for (let joint = 0; 12 * joint < transforms.length; joint++) {
    for (let column = 0; column < 4; column++) {
      for (let row = 0; row < 3; row++) {
        columns[16 * joint + 4 * column + row] = transforms[12 * joint + 4 * row + column];
      }
    }
  }
}
