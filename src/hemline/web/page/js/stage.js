// What is played, at which time; no picture, no clock. The page and the tests step it.

import { Body } from "hemline/body.js";
import { part, readContainer } from "hemline/container.js";
import { memoryFor, openKernels } from "hemline/kernels.js";
import { Clip } from "hemline/motion.js";
import { Player } from "hemline/player.js";

export const STEP = 1 / 30;

export class Stage {
  /** `contents` and `code` are the bytes of the page's data and of its kernels. */
  static async open(contents, code) {
    const stage = new Stage();
    stage.contents = readContainer(contents);
    stage.metadata = stage.contents.metadata;
    stage.kernels = await openKernels(code, memoryFor(stage.contents.arrays));
    stage.body = new Body(part(stage.contents.arrays, "body"), stage.kernels);
    stage.clips = stage.metadata.clips.map((clip, i) => new Clip(part(stage.contents.arrays, `clips.${i}`), clip));
    stage.players = stage.metadata.models.map(() => null);
    stage.choose(0, 0);
    return stage;
  }

  /** Another garment, clip or shape; the clip starts anew, settled. A garment that knows one shape keeps to it. */
  choose(model, clip, betas = []) {
    this.players[model] ??= new Player(model, this.contents, this.body, this.kernels);
    this.player = this.players[model];
    this.clip = this.clips[clip];
    const wanted = this.player.metadata.beta_range ? betas : [];
    this.body.reshape(wanted.length ? wanted : this.body.base.betas);
    this.clip.place(this.body);
    this.seek(0);
  }

  /** Another shape from now on, where the garment follows it: nothing starts anew. */
  reshape(betas) {
    this.body.reshape(betas);
    this.clip.place(this.body);
    this.body.pose(this.clip.at(this.seconds));
    this.state = this.player.animator.reshaped(this.state, this.body);
    this.#show(STEP);
  }

  /** The frame at a time of the clip, settled [s]. */
  seek(seconds, step = STEP) {
    this.seconds = Math.min(Math.max(seconds, 0), this.clip.seconds);
    this.state = this.player.start(this.clip, this.seconds, step);
    this.#show(step);
  }

  /** `dt` later [s]; from the end of the clip on it starts again. */
  advance(dt) {
    if (this.seconds + dt > this.clip.seconds) {
      this.seek(0);
      return;
    }
    this.seconds += dt;
    this.#show(dt);
  }

  /** The clip's first frames at 30 a second, as arrays; `pushing`: after the push out of the body. */
  frames(count, { pushing = false } = {}) {
    this.seconds = 0;
    this.state = this.player.start(this.clip, 0, STEP);
    return Array.from({ length: Math.min(count, this.clip.count) }, (_, index) => {
      this.seconds = index * STEP;
      this.state = this.player.step(this.state, this.clip.at(this.seconds), STEP, { pushing });
      const { vertices, milliseconds } = this.player;
      return { vertices: vertices.slice(), body: this.body.vertices.slice(), milliseconds };
    });
  }

  #show(dt) {
    this.state = this.player.step(this.state, this.clip.at(this.seconds), dt);
    this.changed = true; // a picture of it is due
  }
}
