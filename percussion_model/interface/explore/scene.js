// The scene: a hammer, a bit and a rock by name, and values that were changed.
import { allowed, matters, shown } from "../../engine/engine.js";
import { OWN, takeOwn } from "./own.js";
import { WORDS, fill } from "./words.js";

const LENGTH = /^(piston|bit)\.sections\.(\d+)\.length$/;

export class Scene {
  // tables: the engine's table, and the catalogue of the page.
  constructor(tables, hammer, bit = "", rock = "", values = {}) {
    Object.assign(this, { tables, hammer, bit, rock, values: { ...values } });
  }

  get base() { return this.tables.hammers[this.hammer]; }
  get preset() { return this.tables.presets[this.hammer]; }
  get bitName() { return this.bit || this.preset.bit_name; }

  // All that is changed of the hammer, by key.
  get changes() {
    const bit = this.bit ? this.tables.bits[this.bit].values : {};
    const rock = this.rock ? this.tables.rocks[this.rock].under[this.bitName] : {};
    return { ...bit, ...rock, ...this.values };
  }

  // The scene as the engine takes it.
  get whole() {
    const { rods, values } = this.preset, changes = Object.entries(this.changes).filter(([key]) => !LENGTH.test(key));
    return { piston: this.bar("piston"), bit: this.bar("bit"), rods, bit_name: this.bitName, values: { ...values, ...Object.fromEntries(changes) } };
  }

  get(key) {
    const [, bar, section] = LENGTH.exec(key) ?? [];
    if (bar) return this.bar(bar)[section]?.[0];
    return this.changes[key] ?? this.preset.values[key] ?? this.tables.rows.get(key)?.default;
  }

  // Sections of piston or bit, with lengths that were changed.
  bar(name) {
    return this.preset[name].map(([length, ...rest], k) => [this.values[`${name}.sections.${k}.length`] ?? length, ...rest]);
  }

  // Bars from top to bottom.
  get bars() {
    return [this.bar("piston"), ...(this.get("effects.string") ? this.preset.rods.map(rod => rod.sections) : []), this.bar("bit")];
  }

  // Whether a parameter has any influence.
  matters(key) {
    return matters(this.tables.rows, one => this.get(one), key) && (!LENGTH.test(key) || this.get(key) !== undefined);
  }

  // What is wrong with a value, in the words of the package; empty if nothing is.
  refuse(key, value, text) {
    const row = this.tables.rows.get(key), isNumber = typeof value !== "number" || Number.isFinite(value);
    if (isNumber && allowed(row, value)) return "";
    return `${key} = ${isNumber ? shown(row, value) : JSON.stringify(text)}: must be ${row.allowed}`;
  }

  with(values) {
    return new Scene(this.tables, this.hammer, this.bit, this.rock, { ...this.values, ...values });
  }

  // Share link: names, or all of a scene of one's own, values that were changed, and the version.
  link() {
    const what = this.hammer === OWN ? { own: this.tables.own } : { hammer: this.hammer };
    const parts = { version: this.tables.version, ...what, bit: this.bit, rock: this.rock, ...this.values };
    return new URLSearchParams(Object.entries(parts).filter(([, value]) => value !== "")).toString();
  }

  // Scene of a link, and what to say of it.
  static fromLink(tables, text, start) {
    const { version, own, hammer = own ? OWN : start.hammer, bit = "", rock = "", ...rest } = Object.fromEntries(new URLSearchParams(text));
    const scene = new Scene(tables, start.hammer), why = own && takeOwn(tables, own), said = why ? [why] : [];
    if (why) return [new Scene(tables, start.hammer, start.bit, start.rock), why];
    const has = (table, name, what) => {
      const known = Object.hasOwn(table, name);
      if (!known) said.push(fill(WORDS.badLink, { why: `${what} = ${JSON.stringify(name)} is not known.` }));
      return known;
    };
    if (has(tables.hammers, hammer, "hammer")) scene.hammer = hammer;
    if (bit && has(tables.bits, bit, "bit")) scene.bit = bit;
    if (rock && has(tables.rocks, rock, "rock")) scene.rock = rock;
    for (const [key, given] of Object.entries(rest)) {
      const row = tables.rows.get(key), value = valueOf(row, given);
      const why = row ? scene.refuse(key, value, given) : fill(WORDS.noSuch, { key });
      if (why) said.push(fill(WORDS.badLink, { why })); else scene.values[key] = value;
    }
    if (version && version !== tables.version) said.push(fill(WORDS.oldLink, { theirs: version, ours: tables.version }));
    return [scene, said.join(" ")];
  }

  // The scene as a file for `percussion run`.
  toml() {
    const lines = this.base.toml.split("\n");
    for (const [key, value] of Object.entries(this.changes)) {
      const [, bar, section] = LENGTH.exec(key) ?? [];
      if (bar) {
        const at = lines.findIndex((text, k) => k > lines.indexOf(`[${bar}]`) && text.startsWith("    { length")) + Number(section);
        lines[at] = lines[at].replace(/length = [^,]+/, `length = ${tomlValue(value, this.tables.rows.get(key))}`);
        continue;
      }
      const [group, name] = key.includes(".") ? key.split(".") : ["", key];
      const line = `${name} = ${tomlValue(value, this.tables.rows.get(key))}`;
      let start = group ? lines.indexOf(`[${group}]`) + 1 : 0;
      if (group && start === 0) start = lines.push("", `[${group}]`);
      let end = lines.findIndex((text, k) => k >= start && text.startsWith("["));
      if (end < 0) end = lines.length;
      const at = lines.findIndex((text, k) => k >= start && k < end && text.startsWith(`${name} = `));
      if (at >= 0) lines[at] = line; else lines.splice(start, 0, line);
    }
    return `# Made by the page of percussion_model ${this.tables.version}\n${lines.join("\n").trim()}\n`;
  }

  // The same for Python.
  python() {
    return `from percussion_model import Scene, settled\n\nscene = Scene.from_toml("""\n${this.toml()}""")\nprint(settled(scene, error_estimate=True))\n`;
  }
}

// A value as a link has it.
function valueOf(row, text) {
  if (row?.kind === "choice") return row.choices.find(one => String(one) === text) ?? text;
  if (row?.kind === "flag" && ["true", "false"].includes(text)) return text === "true";
  return text.trim() === "" ? NaN : Number(text);
}

function tomlValue(value, row) {
  if (typeof value === "string") return JSON.stringify(value);
  if (typeof value === "boolean") return String(value);
  return row.kind !== "number" || !Number.isInteger(value) ? String(value).replace("e+", "e") : value.toFixed(1);
}
