// Piston, bit and rock in motion, coloured by the stress wave.
import { at, before, stressColour } from "./figures.js";
import { short, unitOf } from "./numbers.js";
import { chance, seedOf } from "./pictures.js";
import { colour, fitted } from "./plot.js";
import { WORDS, fill } from "./words.js";

// The bit's end moves by millimetres: it is shown so many times as far.
const MAGNIFIED = 10;
// Of the widest part, by the width of the picture: rods would be lines.
const LEAST_WIDTH = 0.2;
// Chips fly with this speed [m/s].
const FLIGHT = 4;

export class Drawing {
  constructor(canvas) {
    this.canvas = canvas;
  }

  // Take another blow: its scene says what it looks like.
  take(blow, scene, imperial, [from, to]) {
    Object.assign(this, { blow, scene, imperial });
    const { base, tables, bars } = scene, bit = scene.bitName && tables.bits[scene.bitName];
    this.bars = bars;
    this.hole = bit ? bit.diameter : base.hole;
    this.buttons = bit ? Math.min(Math.max(3, Math.round(bit.buttons / 3)), 7) : 5;
    this.lengths = bars.map(bar => bar.reduce((sum, [length]) => sum + length, 0));
    this.stroke = blow.columns.gap.reduce((most, gap, k) => blow.time[k] >= from && blow.time[k] <= to ? Math.max(most, gap) : most, 0.01);
    this.release = blow.time.find((t, k) => t > 0 && k && blow.columns.bit_force[k - 1] > 0 && blow.columns.bit_force[k] <= 0) ?? Infinity;
    this.deepest = blow.depth.map((most => d => most = Math.max(most, d))(0));
    const random = chance(seedOf(scene.rock || "rock"));
    this.grains = Array.from({ length: 260 }, () => [random(), random(), random()]);
    this.chips = Array.from({ length: 26 }, () => [random(), random(), random()]);
    this.resize();
  }

  resize() {
    Object.assign(this, fitted(this.canvas));
    this.font = parseFloat(getComputedStyle(document.documentElement).fontSize) * 0.78;
    this.ink = Object.fromEntries(["ink", "soft", "stone", "stone-dark", "steel", "paper", "accent", "contact", "line"].map(name => [name, colour(name)]));
    const room = this.stroke + this.lengths.reduce((sum, one) => sum + one);
    this.floor = this.height - Math.max(0.16 * this.height, 6 * this.font); // where the hole's bottom is at first
    this.k = (this.floor - 2.6 * this.font) / room; // pixels in a metre
    const widest = Math.max(this.hole, ...this.bars.flat().map(one => 2 * Math.sqrt(one[1] / Math.PI)));
    this.r = Math.min(Math.max(1.7 * this.k, LEAST_WIDTH * this.width / widest), 0.6 * this.width / widest);
    this.middle = 0.46 * this.width;
  }

  frame(t) {
    if (!this.blow) return;
    const { blow, canvas } = this, pen = canvas.getContext("2d"), scale = canvas.width / this.width;
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, this.width, this.height);
    pen.font = `${this.font}px system-ui, "DejaVu Sans", sans-serif`;
    const value = name => at(blow.time, blow.columns[name], t);
    const depth = at(blow.time, blow.depth, t) * MAGNIFIED * this.k;
    this.drawRock(pen, t);
    const bitEnd = this.floor + depth;
    let struck = bitEnd; // the topmost end of what is below the piston
    for (let which = this.bars.length - 1; which > 0; which--) {
      struck -= this.lengths[which] * this.k;
      this.drawBar(pen, which, struck, t);
    }
    const pistonEnd = struck - Math.max(value("gap"), 0) * this.k;
    this.drawButtons(pen, bitEnd);
    this.drawBar(pen, 0, pistonEnd - this.lengths[0] * this.k, t);
    if (value("contact_force") > 0) this.flash(pen, struck, value("contact_force") / (blow.greatest.contact_force || 1));
    this.drawNames(pen, pistonEnd, struck, bitEnd);
    this.drawChips(pen, t);
    this.drawArrows(pen, pistonEnd - this.lengths[0] * this.k, value("drive_force"));
    this.drawScale(pen);
  }

  // A bar in slices, each in the colour of its stress.
  drawBar(pen, which, top, t) {
    const field = this.blow.fields.find(one => one.bar === which), sections = this.bars[which];
    let y = top, from = 0;
    for (const [length, area] of sections) {
      const half = Math.sqrt(area / Math.PI) * this.r, end = from + length;
      pen.fillStyle = this.ink.steel;
      if (!field) pen.fillRect(this.middle - half, y, 2 * half, length * this.k);
      else this.drawSlices(pen, field, t, from, end, y, half);
      pen.strokeStyle = this.ink.ink;
      pen.lineWidth = 1;
      pen.strokeRect(this.middle - half, y, 2 * half, length * this.k);
      y += length * this.k;
      from = end;
    }
  }

  drawSlices(pen, field, t, from, end, y, half) {
    const cells = field.edges.length - 1, k = before(field.time, t);
    for (let cell = before(field.edges, from + 1e-9); cell < cells && field.edges[cell] < end - 1e-9; cell++) {
      const low = Math.max(field.edges[cell], from), high = Math.min(field.edges[cell + 1], end);
      pen.fillStyle = `rgb(${stressColour(field.stress[k * cells + cell] / this.blow.greatest.stress)})`;
      pen.fillRect(this.middle - half, y + (low - from) * this.k, 2 * half, (high - low) * this.k + 0.6);
    }
  }

  // Names beside the bars, at the middle of each.
  drawNames(pen, pistonEnd, struck, bitEnd) {
    const [piston, ...below] = this.lengths.map(one => one * this.k), bit = below.at(-1), [own, rods, last] = WORDS.bars;
    const x = this.middle - Math.sqrt(Math.max(...this.bars.flat().map(one => one[1])) / Math.PI) * this.r - 0.6 * this.font;
    pen.fillStyle = this.ink.soft;
    pen.textAlign = "right";
    pen.fillText(own, x, pistonEnd - 0.5 * piston);
    if (below.length > 1) pen.fillText(rods, x, 0.5 * (struck + bitEnd - bit));
    pen.fillText(last, x, Math.min(bitEnd - 0.5 * bit, this.floor - 0.16 * this.height - 0.5 * this.font));
  }

  // Where buttons are, from the middle.
  places() {
    const wide = 0.42 * this.hole * this.r;
    return Array.from({ length: this.buttons }, (_, k) => this.middle + wide * (2 * k / (this.buttons - 1) - 1));
  }

  drawButtons(pen, y) {
    pen.fillStyle = this.ink["stone-dark"];
    pen.strokeStyle = this.ink.ink;
    for (const x of this.places()) {
      pen.beginPath();
      pen.arc(x, y - 1, 0.36 * this.hole * this.r / this.buttons, 0, Math.PI);
      pen.fill();
      pen.stroke();
    }
  }

  // The rock with its hole, crushed under each button as deep as the bit has been in this blow.
  drawRock(pen, t) {
    const half = 0.5 * this.hole * this.r, button = 0.36 * this.hole * this.r / this.buttons, top = this.floor - 0.16 * this.height;
    const deepest = at(this.blow.time, this.deepest, t) * MAGNIFIED * this.k, floor = this.floor + button;
    pen.fillStyle = this.ink.stone;
    pen.fillRect(0, floor, this.width, this.height - floor);
    pen.fillRect(0, top, this.middle - half - 3, this.height);
    pen.fillRect(this.middle + half + 3, top, this.width, this.height);
    pen.fillStyle = this.ink["stone-dark"];
    for (const [x, y, size] of this.grains) {
      const px = x * this.width, py = top + y * (this.height - top);
      if (py < floor && Math.abs(px - this.middle) < half + 5) continue;
      pen.globalAlpha = 0.25 + 0.35 * size;
      pen.fillRect(px, py, 1 + 3 * size, 1 + 2 * size);
    }
    pen.globalAlpha = 1;
    if (deepest < 0.5) return;
    for (const x of this.places()) {
      pen.fillStyle = this.ink.paper;
      pen.beginPath();
      pen.ellipse(x, floor - button, button * 1.15, button + deepest, 0, 0, Math.PI);
      pen.fill();
      this.drawCracks(pen, x, floor + deepest - 1, Math.min(deepest * 1.4, 0.09 * this.height), button);
    }
  }

  drawCracks(pen, x, y, reach, button) {
    pen.strokeStyle = this.ink.ink;
    pen.lineWidth = 1.1;
    for (const angle of [-1.25, -0.7, -0.15, 0.4, 0.95, 1.35]) {
      const long = reach * (0.7 + 0.3 * Math.cos(3 * angle)), side = Math.sin(angle), down = Math.cos(angle);
      pen.beginPath();
      pen.moveTo(x + side * 0.6 * button, y);
      pen.lineTo(x + side * (0.6 * button + 0.5 * long) + 1.5, y + down * 0.45 * long);
      pen.lineTo(x + side * (0.6 * button + long), y + down * long);
      pen.stroke();
    }
  }

  // What has broken out flies up beside the bit once the bit lets go.
  drawChips(pen, t) {
    const since = t - this.release;
    if (!(since > 0)) return;
    const half = 0.5 * this.hole * this.r;
    pen.fillStyle = this.ink["stone-dark"];
    for (const [where, speed, size] of this.chips) {
      const side = where < 0.5 ? -1 : 1, rise = since * FLIGHT * (0.4 + 0.6 * speed) * this.k;
      const x = this.middle + side * Math.min(half * (0.25 + where % 0.5 * 1.2) + rise, half + 1 - 2 * size);
      const y = this.floor - rise + 4 * where;
      if (y > this.floor - 0.16 * this.height) pen.fillRect(x, y, 2 + 3 * size, 2 + 3 * size);
    }
  }

  flash(pen, y, share) {
    pen.strokeStyle = this.ink.contact;
    pen.lineWidth = 1 + 3 * share;
    const half = 12 + 0.12 * this.width;
    pen.beginPath();
    pen.moveTo(this.middle - half, y);
    pen.lineTo(this.middle + half, y);
    pen.stroke();
  }

  // What drives the piston, and the feed.
  drawArrows(pen, pistonTop, force) {
    const most = 1.2 * Math.max(...this.blow.columns.drive_force.map(Math.abs)) || 1, x = 0.86 * this.width;
    pen.fillStyle = pen.strokeStyle = this.ink.accent;
    pen.textAlign = "center";
    const y = Math.max(pistonTop + 0.5 * this.lengths[0] * this.k, 5.5 * this.font);
    this.arrow(pen, x, y, force / most * 4.5 * this.font);
    pen.fillText(WORDS.drive, x, y - (force > 0 ? 0.6 : -1.2) * this.font);
  }

  arrow(pen, x, y, long) {
    if (Math.abs(long) < 1) return;
    const head = Math.sign(long) * 0.6 * this.font;
    pen.fillRect(x - 1.5, Math.min(y, y + long), 3, Math.abs(long));
    pen.beginPath();
    pen.moveTo(x, y + long + head);
    pen.lineTo(x - 0.5 * this.font, y + long - 0.2 * head);
    pen.lineTo(x + 0.5 * this.font, y + long - 0.2 * head);
    pen.fill();
  }

  // Colours of the stress, and by how much the bit's motion is magnified.
  drawScale(pen) {
    const [unit, factor] = unitOf("stress", this.imperial), most = factor * this.blow.greatest.stress, y = this.height - 2.9 * this.font;
    const left = 0.6 * this.font, wide = Math.min(11 * this.font, 0.5 * this.width);
    pen.fillStyle = this.ink.paper;
    pen.globalAlpha = 0.85;
    pen.fillRect(0, y - 0.5 * this.font, this.width, this.height);
    pen.globalAlpha = 1;
    for (let k = 0; k < 60 && this.blow.fields.length; k++) {
      pen.fillStyle = `rgb(${stressColour(k / 29.5 - 1)})`;
      pen.fillRect(left + k / 60 * wide, y, wide / 60 + 0.5, 0.7 * this.font);
    }
    pen.fillStyle = this.ink.ink;
    pen.textAlign = "left";
    if (this.blow.fields.length) pen.fillText(`${WORDS.tension} – ${WORDS.compression}: ± ${short(most, 2)} ${unit}`, left, y + 1.75 * this.font);
    pen.textAlign = "right";
    pen.fillText(fill(WORDS.magnified, { n: MAGNIFIED }), this.width - 0.5 * this.font, y + 0.6 * this.font);
  }
}
