// A garment driven by rope chains; animators/ropes/model.

import { BoneCorrection } from "hemline/bone_correction.js";
import { BoneSource } from "hemline/bone_source.js";
import { Chains } from "hemline/chains.js";
import { part } from "hemline/container.js";
import { Mlp, PackedBasis } from "hemline/networks.js";

export class Ropes {
  constructor(arrays, metadata, kernels) {
    const own = part(arrays, "ropes"), chains = new Chains(own, metadata.constants, metadata.key);
    this.source = new BoneSource(chains, new BoneCorrection(part(arrays, "correction"), chains), own.rest_bones);
    this.networks = ["skinning", "shape"].map((name) => new Mlp(part(arrays, name), kernels));
    this.basis = new PackedBasis(["skinning_basis", "shape_basis"].map((name) => part(arrays, name)), kernels);
    this.key = metadata.key;
    this.rest = kernels.floatsOf(arrays.rest);
  }

  /** Returns the state at rest on a body in a pose. */
  start(body) {
    return this.source.start(Float64Array.from(body.transforms));
  }

  /** Returns the state `dt` later [s]; `show` makes its vertices. */
  advance(state, body, dt) {
    const [after, moved] = this.source.step(state, Float64Array.from(body.transforms), dt);
    this.moved = moved;
    return after;
  }

  /** Writes the vertices of the last `advance` into the memory of the kernels. */
  show(body, vertices) {
    const coefficients = this.networks.flatMap((network) => Array.from(network.run(this.moved)));
    this.basis.place(coefficients, this.rest, body.transforms, this.key, vertices);
  }
}
