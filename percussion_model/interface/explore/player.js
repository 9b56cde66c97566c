// Time within the blow: play, pause, scrub, speed.
import { short } from "./numbers.js";
import { WORDS } from "./words.js";

const SPEEDS = [5000, 2000, 1000, 500, 200, 100, 50];
const part = id => document.getElementById(id);

export class Player {
  // draw: takes the time [s].
  constructor(draw) {
    Object.assign(this, { draw, range: [0, 1], t: 0, playing: false, slow: 2000 });
    part("speed").innerHTML = SPEEDS.map(one => `<option value="${one}"${one === this.slow ? " selected" : ""}>1/${one}</option>`).join("");
    part("speed").addEventListener("change", event => { this.slow = Number(event.target.value); });
    part("play").addEventListener("click", () => this.play(!this.playing));
    part("scrub").addEventListener("input", event => {
      this.once = false;
      this.play(false);
      this.go(this.range[0] + Number(event.target.value) / 1000 * (this.range[1] - this.range[0]));
    });
    this.step = this.step.bind(this);
  }

  setSlow(slow) {
    this.slow = slow;
    part("speed").value = String(slow);
  }

  // Take another range of time; rest is where to stand unless the time before is kept.
  take(range, keep, rest) {
    const share = (this.t - this.range[0]) / (this.range[1] - this.range[0]);
    this.range = range;
    this.go(keep && share >= 0 && share <= 1 ? range[0] + share * (range[1] - range[0]) : rest);
    this.rest = rest;
  }

  go(t) {
    this.t = Math.min(Math.max(t, this.range[0]), this.range[1]);
    part("scrub").value = 1000 * (this.t - this.range[0]) / (this.range[1] - this.range[0]);
    part("scrub").setAttribute("aria-valuetext", this.text());
    part("clock").textContent = this.text();
    this.draw(this.t);
  }

  text() { return `${short(1e3 * this.t, 3)} ms`; }

  // Play from the start, once.
  playOnce() {
    this.go(this.range[0]);
    this.once = true;
    this.play(true);
  }

  play(wanted) {
    if (wanted === this.playing) return;
    this.playing = wanted;
    part("play").textContent = wanted ? WORDS.pause : WORDS.play;
    this.last = undefined;
    if (wanted) requestAnimationFrame(this.step);
  }

  step(now) {
    if (!this.playing) return;
    const passed = this.last === undefined ? 0 : Math.min(now - this.last, 100) / 1000 / this.slow;
    this.last = now;
    const ends = this.t + passed >= this.range[1];
    if (ends && this.once) this.play(false);
    this.go(ends ? (this.once ? this.rest : this.range[0]) : this.t + passed);
    if (ends) this.once = false;
    requestAnimationFrame(this.step);
  }
}
