// Playback without picture or clock; the page and the tests step it.

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

  /** Changes garment, clip or shape, and restarts the clip, settled. A garment of a single shape keeps it. */
  choose(model, clip, betas = []) {
    this.players[model] ??= new Player(model, this.contents, this.body, this.kernels);
    this.player = this.players[model];
    this.clip = this.clips[clip];
    const wanted = this.player.metadata.beta_range ? betas : [];
    this.body.reshape(wanted.length ? wanted : this.body.base.betas);
    this.clip.place(this.body);
    this.seek(0);
  }

  /** Changes the shape without a restart, for garments that follow shapes. */
  reshape(betas) {
    this.body.reshape(betas);
    this.clip.place(this.body);
    this.body.pose(this.clip.at(this.seconds));
    this.state = this.player.animator.reshape(this.state, this.body);
    this.#show(STEP);
  }

  /** Shows the frame at a time of the clip, settled [s]. */
  seek(seconds, step = STEP) {
    this.seconds = Math.min(Math.max(seconds, 0), this.clip.seconds);
    this.state = this.player.start(this.clip, this.seconds, step);
    this.#show(step);
  }

  /** Advances by `dt` [s]; after the end of the clip it restarts. */
  advance(dt) {
    if (this.seconds + dt > this.clip.seconds) {
      this.seek(0);
      return;
    }
    this.seconds += dt;
    this.#show(dt);
  }

  /** Returns the first frames of the clip at 30 per second, as arrays; `pushing` includes the push out of the body. */
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
    this.changed = true; // a picture is due
  }
}
