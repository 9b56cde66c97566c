// Cards of hammers, bits and rocks, and sliders with a field each.
import { short, unitOf } from "./numbers.js";
import { bitPicture, hammerPicture, rockPicture } from "./pictures.js";
import { OWN } from "./own.js";
import { CHOICES, LENGTHS, OTHERS, SLIDERS, WORDS, fill } from "./words.js";

const STEPS = 400;

function escaped(text) {
  return text.replace(/[&<>"]/g, letter => `&#${letter.charCodeAt(0)};`);
}

// Titles of rocks that fit a card.
export function shorter(title) {
  return title.replace("Granite of a continuum model", "Model granite").replace(", by its strength", "").replace(" of the reference scene", "");
}

// What tells one bit from another.
export function bitTitle({ diameter, buttons }, imperial) {
  const [unit, factor] = unitOf("length", imperial);
  return `${short(factor * diameter, 3)} ${unit}, ${buttons} buttons`;
}

// Cards of one group: names with pictures and titles.
function cards(box, group, options, chosen, choose) {
  box.innerHTML = options.map(({ name, title, picture }) =>
    `<label><input type="radio" name="${group}" value="${escaped(name)}"${name === chosen ? " checked" : ""}>${picture}<span>${escaped(title)}</span></label>`).join("");
  box.onchange = event => choose(event.target.value);
  const all = box.previousElementSibling;
  all.onclick = () => { setAll(box.classList.toggle("all")); };
  const setAll = open => {
    all.textContent = open ? WORDS.fewer : fill(WORDS.all, { n: options.length });
    all.setAttribute("aria-expanded", String(open));
  };
  setAll(box.classList.contains("all"));
}

export class Inputs {
  // change: takes a scene. The scene is read by get.
  constructor(get, change) {
    Object.assign(this, { get, change, imperial: false, entries: [] });
    this.boxes = ["hammers", "bits", "rocks"].map(id => document.getElementById(id));
    for (const [id, rows] of [["sliders", SLIDERS], ["others", [...OTHERS, ...LENGTHS]]]) {
      for (const row of rows) this.entries.push(new Entry(row, document.getElementById(id), this));
    }
    for (const row of CHOICES) this.entries.push(new Choice(row, document.getElementById("choices"), this));
  }

  // Show a scene: cards that fit, sliders where they are.
  show() {
    const scene = this.get(), { hammers, bits, rocks } = scene.tables;
    const focused = document.activeElement?.name, { base } = scene, ownBit = scene.preset.bit_name;
    const change = values => this.change(Object.assign(scene.with({}), values));
    for (const entry of this.entries) entry.show(scene, this.imperial);
    const chosen = [scene.hammer, scene.bit, scene.rock, this.imperial].join();
    if (chosen === this.chosen) return;
    this.chosen = chosen;
    const all = Object.entries(hammers).sort(([one], [other]) => (other === OWN) - (one === OWN));
    cards(this.boxes[0], "hammer", all.map(([name, one]) =>
      ({ name, title: one.title, picture: hammerPicture(scene.tables.presets[name], one) })),
      scene.hammer, name => change({ hammer: name, bit: this.bitOf(name), values: {} }));
    const free = ownBit ? [] : [{ name: "", title: WORDS.given, picture: bitPicture({ diameter: base.hole, buttons: 9, gauge: 6 }) }];
    cards(this.boxes[1], "bit", [...free, ...base.bits.map(name => ({ name, title: bitTitle(bits[name], this.imperial), picture: bitPicture(bits[name]) }))],
      scene.bitName, name => change({ bit: name, values: this.without(["breaking.", "rotation."]) }));
    cards(this.boxes[2], "rock", [{ name: "", title: WORDS.given, picture: rockPicture("hard") },
      ...Object.entries(rocks).map(([name, one]) => ({ name, title: one.title, picture: rockPicture(name) }))].map(one => ({ ...one, title: shorter(one.title) })),
      scene.rock, name => change({ rock: name, values: this.without(["rock.", "breaking.crushing_energy"]) }));
    for (const box of this.boxes) {
      const card = box.querySelector("input:checked")?.parentNode;
      if (card) box.scrollLeft = card.offsetLeft - 0.5 * (box.clientWidth - card.clientWidth);
    }
    if (["hammer", "bit", "rock"].includes(focused)) document.querySelector(`input[name=${focused}]:checked`)?.focus();
  }

  // Changed values less those of a group.
  without(groups) {
    return Object.fromEntries(Object.entries(this.get().values).filter(([key]) => !groups.some(group => key.startsWith(group))));
  }

  // Bit for another hammer: its own, or the one that was chosen, where it fits.
  bitOf(name) {
    const { preset, bit, tables } = this.get(), own = tables.presets[name].bit_name;
    const isChosen = bit && bit !== preset.bit_name && tables.hammers[name].bits.includes(bit);
    return isChosen || (!own && tables.hammers[name].bits.includes(bit)) ? bit : own;
  }

  set(key, value) {
    this.change(this.get().with({ [key]: value }));
  }
}

// A tick, or a choice of words.
class Choice {
  constructor(row, box, inputs) {
    Object.assign(this, { ...row, inputs, box: document.createElement("label") });
    this.box.className = "choice";
    const options = Object.entries(this.words ?? {}).map(([value, word]) => `<option value="${value}">${escaped(word)}</option>`).join("");
    this.box.innerHTML = this.words ? `<span>${escaped(this.name)}</span> <select>${options}</select>` : `<input type="checkbox"> <span>${escaped(this.name)}</span>`;
    this.input = this.box.querySelector("input, select");
    this.input.addEventListener("change", () => inputs.set(this.key, this.words ? this.input.value : this.input.checked));
    box.append(this.box);
  }

  show(scene) {
    const value = scene.get(this.key);
    this.box.hidden = !scene.matters(this.key) || Boolean(this.words && !(value in this.words));
    this.box.title = scene.tables.rows.get(this.key).description;
    if (this.words) this.input.value = value; else this.input.checked = value;
  }
}

// A slider and a field; the field takes what the slider does not reach.
class Entry {
  constructor(row, box, inputs) {
    Object.assign(this, { ...row, inputs });
    const id = `in-${row.key.replace(".", "-")}`;
    this.box = document.createElement("div");
    this.box.className = "slider";
    this.box.innerHTML = `<label for="${id}">${escaped(row.name)}</label><span class="field"><input type="text" inputmode="decimal" autocomplete="off" aria-describedby="${id}-why"><span class="unit"></span></span>` +
      `<input type="range" id="${id}" step="any"><p id="${id}-why" role="alert" class="refusal" hidden></p>`;
    [this.field, this.range] = this.box.querySelectorAll("input");
    this.note = this.box.querySelector("p");
    box.append(this.box);
    this.range.addEventListener("input", () => this.take(Number(this.range.value) / this.factor));
    this.field.addEventListener("change", () => {
      const text = this.field.value.trim().replace(",", ".").replace(this.short, "").trim(), value = text === "" ? NaN : Number(text);
      this.take(value / this.factor, this.field.value);
    });
  }

  show(scene, imperial) {
    const shown = scene.matters(this.key);
    this.box.hidden = !shown;
    this.box.style.display = shown ? "" : "none";
    const name = this.onCasing && scene.get("feed.on") === "casing" ? this.onCasing : this.name;
    this.box.querySelector("label").textContent = name;
    [this.short, this.factor] = unitOf(this.unit, imperial);
    const value = scene.get(this.key), low = Math.min(this.low, value), high = Math.max(this.high, value);
    Object.assign(this.range, { min: this.factor * low, max: this.factor * high, step: (this.factor * (high - low)) / STEPS });
    if (document.activeElement !== this.range) this.range.value = this.factor * value;
    this.field.value = short(this.factor * value, 4);
    this.field.setAttribute("aria-label", `${name}, ${this.short}`);
    this.range.setAttribute("aria-valuetext", `${this.field.value} ${this.short}`);
    this.range.title = scene.tables.rows.get(this.key).description;
    this.box.querySelector(".unit").textContent = this.short;
    this.refuse("");
  }

  // Take a value [SI], of the slider to four digits; text is what was written.
  take(value, text) {
    const exact = text === undefined ? Number((this.factor * value).toPrecision(4)) / this.factor : value;
    const clean = Number(exact.toPrecision(12)), why = this.inputs.get().refuse(this.key, clean, text);
    if (why) this.refuse(why); else this.inputs.set(this.key, clean);
  }

  refuse(why) {
    this.note.hidden = !why;
    this.note.textContent = why;
    this.field.setAttribute("aria-invalid", String(Boolean(why)));
  }
}
