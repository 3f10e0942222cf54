// The body: shape, pose and skin, in the same steps as `hemline.bodies`.

import { intoColumns } from "hemline/kernels.js";
import { at, inverse, multiply, normalised, toMatrix } from "hemline/quaternions.js";

export const JOINTS = 24;
const SAMPLE_INTERVAL = 24; // interval of the vertices of the skin from which the push starts its search

/** A skinned mesh with a shape and a pose; `reshape` and `pose` overwrite its arrays. */
export class Body {
  constructor(arrays, kernels) {
    this.kernels = kernels;
    this.base = arrays; // template and joints have the shape that the page was written for
    this.parents = arrays.parents;
    this.offsets = Array.from({ length: JOINTS }, (_, joint) => at(arrays.rest_offsets, joint));
    this.count = arrays.template.length / 3;
    this.faces = kernels.wordsOf(arrays.faces);
    this.bones = kernels.bytesOf(arrays.weight_indices);
    this.weights = kernels.floatsOf(arrays.weights);
    this.rest = kernels.floats(3 * this.count);
    this.moved = arrays.posedirs ? kernels.floats(3 * this.count) : this.rest; // rest with pose offsets
    this.posedirs = arrays.posedirs && kernels.floatsOf(arrays.posedirs);
    this.restNormals = kernels.floats(3 * this.count);
    this.vertices = kernels.floats(3 * this.count);
    this.normals = kernels.floats(3 * this.count);
    this.columns = kernels.floats(16 * JOINTS);
    this.transforms = new Float32Array(12 * JOINTS);
    this.joints = new Float32Array(3 * JOINTS);
    this.#connect();
    this.reshape(arrays.betas);
  }

  /** Changes the shape. */
  reshape(betas) {
    const { template, joints, shapedirs, shapedirs_scales: scales, joint_shapedirs: jointDirs } = this.base;
    this.betas = Float32Array.from(this.base.betas, (_, i) => betas[i] ?? 0);
    const away = Array.from(this.betas, (beta, i) => beta - this.base.betas[i]);
    this.rest.set(template);
    const restJoints = Float64Array.from(joints);
    away.forEach((amount, beta) => {
      if (amount === 0) return;
      const step = amount * scales[beta], first = beta * this.rest.length;
      for (let i = 0; i < this.rest.length; i++) this.rest[i] += step * shapedirs[first + i];
      for (let i = 0; i < restJoints.length; i++) restJoints[i] += amount * jointDirs[beta * restJoints.length + i];
    });
    this.restJoints = Float32Array.from(restJoints);
    const { faces, rest, restNormals, kernels } = this;
    kernels.areaNormals(faces.byteOffset, rest.byteOffset, faces.length / 3, this.count, restNormals.byteOffset);
    this.legLength = this.#legLength();
  }

  /** Returns the pose whose mesh is the mesh at rest. */
  restPose() {
    const rotations = this.offsets.map((offset, joint) => {
      return multiply(joint === 0 ? [1, 0, 0, 0] : this.offsets[this.parents[joint]], inverse(offset));
    });
    return { rotations: Float32Array.from(rotations.flat()), translation: this.restJoints.slice(0, 3) };
  }

  /** Computes skin transforms and joints of a pose, which animators use; `skin` makes the mesh. */
  pose({ rotations, translation }) {
    const globalRotations = [], matrices = [], places = [];
    for (let joint = 0; joint < JOINTS; joint++) {
      const parent = this.parents[joint], own = at(rotations, joint);
      if (parent < 0) {
        globalRotations.push(own);
        places.push([...translation]);
      } else {
        globalRotations.push(multiply(globalRotations[parent], own));
        const m = matrices[parent];
        const bone = [0, 1, 2].map((c) => this.restJoints[3 * joint + c] - this.restJoints[3 * parent + c]);
        places.push([0, 1, 2].map((row) => {
          let place = places[parent][row];
          for (let c = 0; c < 3; c++) place += m[3 * row + c] * bone[c];
          return place;
        }));
      }
      globalRotations[joint] = normalised(globalRotations[joint]);
      matrices.push(toMatrix(multiply(globalRotations[joint], this.offsets[joint])));
      for (let row = 0; row < 3; row++) {
        let shift = places[joint][row];
        for (let c = 0; c < 3; c++) {
          this.transforms[12 * joint + 4 * row + c] = matrices[joint][3 * row + c];
          shift -= matrices[joint][3 * row + c] * this.restJoints[3 * joint + c];
        }
        this.transforms[12 * joint + 4 * row + 3] = shift;
        this.joints[3 * joint + row] = places[joint][row];
      }
    }
    this.rotations = rotations;
  }

  /** Computes the mesh in the pose, and its normals by rotating those at rest. */
  skin() {
    const { kernels, bones, weights, columns, moved, restNormals, count, vertices, normals } = this;
    intoColumns(this.transforms, columns);
    this.bend();
    kernels.skin(
      bones.byteOffset, weights.byteOffset, columns.byteOffset, moved.byteOffset, restNormals.byteOffset, count,
      vertices.byteOffset, normals.byteOffset,
    );
  }

  /** Adds the pose offsets to the skin at rest, sum of P_jk (R_j - 1)_k (SMPL, Eq. 9), into `moved`. */
  bend() {
    if (!this.posedirs) return;
    this.moved.set(this.rest);
    for (let joint = 1; joint < JOINTS; joint++) {
      toMatrix(at(this.rotations, joint)).forEach((entry, k) => {
        const row = this.posedirs.byteOffset + 4 * (9 * (joint - 1) + k) * this.moved.length;
        const feature = Math.fround(entry - (k % 4 === 0 ? 1 : 0));
        this.kernels.addScaled(row, feature, this.moved.length, this.moved.byteOffset);
      });
    }
  }

  /** Lists the triangles around each vertex by their other corners, and some vertices spread over the skin. */
  #connect() {
    const starts = new Int32Array(this.count + 1);
    this.faces.forEach((vertex) => starts[vertex + 1]++);
    for (let i = 0; i < this.count; i++) starts[i + 1] += starts[i];
    const around = new Int32Array(2 * this.faces.length), next = starts.slice();
    this.faces.forEach((vertex, corner) => {
      const first = corner - (corner % 3), place = 2 * next[vertex]++;
      around[place] = this.faces[first + ((corner + 1) % 3)];
      around[place + 1] = this.faces[first + ((corner + 2) % 3)];
    });
    const samples = Int32Array.from({ length: Math.ceil(this.count / SAMPLE_INTERVAL) }, (_, i) => SAMPLE_INTERVAL * i);
    Object.assign(this, { starts: this.kernels.wordsOf(starts), around: this.kernels.wordsOf(around) });
    this.samples = this.kernels.wordsOf(samples);
  }

  /** Returns the length from hip to knee to ankle, mean of both legs [m]. */
  #legLength() {
    const span = (a, b) => Math.hypot(...[0, 1, 2].map((c) => this.restJoints[3 * a + c] - this.restJoints[3 * b + c]));
    return (span(1, 4) + span(4, 7) + span(2, 5) + span(5, 8)) / 2;
  }
}
