// Plots of one blow, and of the rate over feed and rotation.
import { Plot, colour } from "./plot.js";
import { short, unitOf } from "./numbers.js";
import { WORDS, fill } from "./words.js";

// Index of the last time that is not after t.
export function before(times, t) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t) low = middle; else high = middle - 1;
  }
  return low;
}

// Value of a column between two times.
export function at(times, values, t) {
  const k = Math.min(before(times, t), times.length - 2), span = times[k + 1] - times[k];
  const share = span > 0 ? Math.min(Math.max((t - times[k]) / span, 0), 1) : 0;
  return values[k] + share * (values[k + 1] - values[k]);
}

// Colour of a stress by the greatest: blue for tension, grey for none, red for compression.
export function stressColour(share) {
  const s = Math.max(-1, Math.min(1, share)), rest = [214, 214, 214], end = s > 0 ? [190, 20, 30] : [20, 70, 200];
  const part = Math.abs(s) ** 0.7;
  return rest.map((one, k) => Math.round(one + part * (end[k] - one)));
}

// What is longer is measured in other units [m].
const LONG = 3;

export class Figures {
  constructor(scrub, choose) {
    const part = id => document.getElementById(id), overTime = id => new Plot(part(id), ms => scrub(1e-3 * ms));
    Object.assign(this, { waves: overTime("waves"), forces: overTime("forces"), path: new Plot(part("path")), energy: overTime("energy"), values: part("values") });
    this.waves.halo = true;
    if (!choose) return; // a blow alone
    this.overFeed = new Plot(part("over-feed"), x => choose("feed.force", x));
    this.overSpeed = new Plot(part("over-speed"), x => choose("rotation.speed", x));
  }

  // Words for those who do not see the pictures.
  describe() {
    const { greatest, period } = this.blow, mega = (1e-6 * greatest.stress).toFixed(0), force = (1e-3 * greatest.bit_force).toFixed(0);
    const say = (id, text, more) => document.getElementById(id).setAttribute("aria-label", fill(text, { mega, force, ...more }));
    say("drawing", WORDS.drawn);
    for (const id of ["waves", "forces", "path", "energy"]) say(id, WORDS.plotted, { what: document.getElementById(id).previousElementSibling.textContent, period: (1e3 * period).toFixed(1) });
  }

  // Plots of a blow between two times; pinned is another one or null.
  draw(blow, pinned, [from, to], imperial) {
    this.blow = blow;
    this.imperial = imperial;
    for (const plot of [this.waves, this.forces, this.path, this.energy]) plot.ink = undefined;
    this.drawForces(blow, pinned, [1e3 * from, 1e3 * to]);
    this.drawPath(blow, pinned, from, to);
    this.drawWaves(blow, [1e3 * from, 1e3 * to]);
    this.drawEnergy(blow, [1e3 * from, 1e3 * to]);
  }

  drawForces(blow, pinned, x) {
    const [unit, factor] = unitOf("load", this.imperial), shown = [...(pinned ? [pinned] : []), blow];
    const most = Math.max(...shown.map(one => one.greatest.bit_force), ...shown.map(one => one.greatest.contact_force)) || 1;
    this.forces.begin(x, [0, 1.08 * factor * most], "time, ms", `force, ${unit}`);
    for (const one of shown) {
      for (const [column, name] of [["contact_force", "contact"], ["bit_force", "rock"]]) {
        const points = Array.from(one.time, (t, k) => [1e3 * t, factor * one.columns[column][k]]);
        this.forces.line(points, one === blow ? name : "grey", one === blow ? 1.7 : 1.2, one === blow ? [] : [4, 3]);
      }
    }
  }

  drawPath(blow, pinned, from, to) {
    const [unit, factor] = unitOf("load", this.imperial), [short, length] = unitOf("length", this.imperial);
    const shown = [...(pinned ? [pinned] : []), blow], inside = one => (_, k) => one.time[k] >= from && one.time[k] <= to;
    const all = shown.map(one => one.depth.filter(inside(one))).map(d => [Math.min(...d), Math.max(...d)]);
    const low = length * Math.min(...all.map(one => one[0])), high = length * Math.max(...all.map(one => one[1]));
    const room = 0.05 * (high - low || 1), most = Math.max(...shown.map(one => one.greatest.bit_force)) || 1;
    this.path.begin([low - room, high + room], [0, 1.08 * factor * most], `depth of the bit's end, ${short}`, `force on the rock, ${unit}`);
    for (const one of shown) {
      const points = Array.from(one.depth, (d, k) => [length * d, factor * one.columns.bit_force[k]]).filter(inside(one));
      this.path.line(points, one === blow ? "rock" : "grey", one === blow ? 1.7 : 1.2, one === blow ? [] : [4, 3]);
    }
  }

  // Stress over time and depth, piston above what it strikes.
  drawWaves(blow, x) {
    const height = blow.fields.reduce((sum, one) => sum + one.edges.at(-1), 0), [unit, factor] = unitOf(height > LONG ? "distance" : "length", this.imperial);
    this.waves.begin(x, [factor * height, 0], "time, ms", `place, ${unit}`);
    if (!blow.fields.length) return;
    const pen = this.waves.pen, wide = Math.max(Math.round(this.waves.right - this.waves.left), 2);
    let top = 0;
    for (const field of blow.fields) {
      const cells = field.edges.length - 1, rows = 4 * cells, image = new ImageData(wide, rows);
      for (let column = 0; column < wide; column++) {
        const t = 1e-3 * (x[0] + (column + 0.5) / wide * (x[1] - x[0])), k = before(field.time, t);
        for (let row = 0; row < rows; row++) {
          const depth = (row + 0.5) / rows * field.edges.at(-1), cell = before(field.edges, depth);
          image.data.set([...stressColour(field.stress[k * cells + cell] / blow.greatest.stress), 255], 4 * (row * wide + column));
        }
      }
      const patch = new OffscreenCanvas(wide, rows), y = this.waves.py(factor * top), end = this.waves.py(factor * (top + field.edges.at(-1)));
      patch.getContext("2d").putImageData(image, 0, 0);
      pen.drawImage(patch, this.waves.left, y, this.waves.right - this.waves.left, end - y);
      top += field.edges.at(-1);
    }
    top = 0;
    for (const field of blow.fields.slice(0, -1)) {
      top += factor * field.edges.at(-1);
      this.waves.line([[x[0], top], [x[1], top]], "halo", 3);
      this.waves.line([[x[0], top], [x[1], top]], "on-halo", 1);
    }
  }

  // Energies over time, one on the other.
  drawEnergy(blow, x) {
    const [unit, factor] = unitOf("energy", this.imperial), most = Math.max(...blow.energies.at(-1).sum) || 1;
    this.energy.begin(x, [0, 1.08 * factor * most], "time, ms", `energy, ${unit}`);
    const pen = this.energy.pen, place = this.energy;
    pen.save();
    pen.beginPath();
    pen.rect(place.left, place.top, place.right - place.left, place.bottom - place.top);
    pen.clip();
    for (const one of [...blow.energies].reverse()) {
      pen.beginPath();
      pen.moveTo(place.px(1e3 * blow.time[0]), place.py(0));
      blow.time.forEach((t, k) => pen.lineTo(place.px(1e3 * t), place.py(factor * one.sum[k])));
      pen.lineTo(place.px(1e3 * blow.time.at(-1)), place.py(0));
      pen.fillStyle = colour(one.colour);
      pen.fill();
    }
    pen.restore();
    document.getElementById("energies").innerHTML = blow.energies.map(one => `<span class="key ${one.key}">${one.name}</span>`).join(" ");
  }

  // A cursor through all plots.
  frame(t) {
    for (const plot of [this.waves, this.forces, this.energy]) plot.frame(1e3 * t);
    const blow = this.blow;
    if (!blow) return;
    const [mm, length] = unitOf("length", this.imperial), [unit, load] = unitOf("load", this.imperial);
    const value = name => at(blow.time, blow.columns[name], t), depth = length * at(blow.time, blow.depth, t);
    this.path.frame(depth, load * value("bit_force"));
    this.values.textContent = fill(WORDS.values, { rock: short(load * value("bit_force"), 3), piston: short(load * value("contact_force"), 3), unit, depth: short(depth, 3), mm });
  }

  // Rate over one setting, with a dot where the hammer is.
  drawRates(plot, curve, pinned, now, kind, name, imperial) {
    const [unit, factor] = unitOf(kind, imperial), [per, rate] = unitOf("rate", imperial);
    const [known, other] = [curve, pinned].map(one => one?.points.filter(([, y]) => Number.isFinite(y)) ?? []);
    const most = rate * Math.max(...[...known, ...other].map(([, y]) => y), now[1] || 0) || 1;
    plot.ink = undefined;
    plot.begin([factor * curve.low, factor * curve.high], [0, 1.12 * most], `${name}, ${unit}`, `rate, ${per}`);
    if (!known.length) plot.pen.fillText(WORDS.computing, plot.left + plot.font, plot.bottom - plot.font);
    if (pinned !== curve) plot.line(other.map(([x, y]) => [factor * x, rate * y]), "grey", 1.2, [4, 3]);
    plot.line(known.map(([x, y]) => [factor * x, rate * y]), "third", 1.8);
    plot.frame(factor * now[0], Number.isFinite(now[1]) ? rate * now[1] : 0);
    plot.canvas.setAttribute("aria-label", `${name}: ${known.map(([x, y]) => `${short(factor * x, 3)} ${unit} ${short(rate * y, 3)} ${per}`).join(", ")}`);
  }
}

// Between which times a blow is shown: all of it, or while waves are busy.
export function stretch(blow, whole) {
  return whole ? [blow.time[0], blow.period] : [Math.max(blow.time[0], -0.05 * blow.busy), Math.min(blow.busy, blow.period)];
}

// What a picture of the worker lacks: greatest values, depths and energies.
export function prepared(blow, scene) {
  const { columns, time } = blow, greatest = {};
  for (const name of ["bit_force", "contact_force"]) greatest[name] = columns[name].reduce((a, b) => Math.max(a, b), 0);
  greatest.stress = blow.fields.reduce((most, one) => one.stress.reduce((a, b) => Math.max(a, Math.abs(b)), most), 1);
  const start = columns.bit_end_position[before(time, 0)], depth = columns.bit_end_position.map(one => one - start);
  const bars = scene.bars, [piston] = bars.slice(0, 1).map(bar => bar.reduce((sum, [length, area, , density]) => sum + length * area * density, 0));
  let work = 0;
  const rock = Float64Array.from(time, (_, k) => {
    if (k) work += 0.5 * (columns.bit_force[k] + columns.bit_force[k - 1]) * (depth[k] - depth[k - 1]);
    return work;
  });
  const strain = Float64Array.from(time, t => blow.fields.reduce((sum, one) => sum + strainEnergy(one, bars[one.bar], t), 0));
  const rods = blow.fields.filter(one => one.bar > 0 && one.bar < bars.length - 1);
  const moving = Float64Array.from(time, t => rods.reduce((sum, one) => sum + one.kinetic[before(one.time, t)], 0));
  const parts = [
    ["rock", "grey", "grey", rock], ["strain", "contact", "contact", strain], ...(rods.length ? [["rods", "moving", "moving", moving]] : []),
    ["bit", "third", "third", columns.bit_kinetic_energy], ["piston", "rock", "", columns.piston_velocity.map(v => 0.5 * piston * v * v)],
  ];
  let sum = new Float64Array(time.length);
  const energies = parts.map(([name, colourName, key, values]) => {
    sum = sum.map((one, k) => one + Math.max(values[k], 0));
    return { name, colour: colourName, key, values, sum };
  });
  return { ...blow, greatest, depth, energies };
}

// Elastic energy of a bar at a time, by its stress [J].
function strainEnergy(field, sections, t) {
  const cells = field.edges.length - 1, k = before(field.time, t);
  let total = 0, section = 0, end = sections[0][0];
  for (let cell = 0; cell < cells; cell++) {
    const middle = 0.5 * (field.edges[cell] + field.edges[cell + 1]), stress = field.stress[k * cells + cell];
    while (middle > end && section < sections.length - 1) end += sections[++section][0];
    total += 0.5 * stress * stress / sections[section][2] * sections[section][1] * (field.edges[cell + 1] - field.edges[cell]);
  }
  return total;
}
