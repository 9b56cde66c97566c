// A scene of the user: as a link has it, JSON in letters that an address may have.
import { allowed, shown } from "../../engine/engine.js";
import { WORDS, fill } from "./words.js";

// The name under which tables hold it, and how much a link may ask for.
export const OWN = "own";
const MOST_SECTIONS = 100, MOST_RODS = 40, MOST_TEXT = 200000, JOINT_NUMBERS = 6;

// Take a scene of a link into the tables; why it cannot be, in words, or nothing.
export function takeOwn(tables, letters) {
  let given, why;
  try {
    const bytes = Uint8Array.from(atob(letters.replaceAll("-", "+").replaceAll("_", "/")), one => one.charCodeAt(0));
    given = JSON.parse(new TextDecoder().decode(bytes));
    why = wrong(tables, given);
  } catch { // of another form than any scene
    why = WORDS.notWhole;
  }
  if (why) return fill(WORDS.badLink, { why });
  const { preset, hammer } = given;
  tables.presets[OWN] = preset;
  tables.hammers[OWN] = { ...hammer, bits: hammer.bits.filter(name => Object.hasOwn(tables.bits, name)) };
  tables.own = letters;
  return "";
}

// What is wrong with a scene that a stranger may have written.
function wrong({ rows, section, bits }, { preset, hammer } = {}) {
  const isText = one => typeof one === "string" && one.length < MOST_TEXT, { piston, bit, rods, values, bit_name: head } = preset ?? {};
  if (![hammer?.title, hammer?.toml].every(isText) || !Array.isArray(hammer.bits) || !(hammer.hole > 0)) return WORDS.notWhole;
  if (![piston, bit, rods].every(Array.isArray) || typeof values !== "object" || (head && !Object.hasOwn(bits, head))) return WORDS.notWhole;
  if (rods.length > MOST_RODS || !rods.every(({ joint }) => joint?.length === JOINT_NUMBERS && joint.every(Number.isFinite))) return WORDS.notWhole;
  for (const [name, bar] of [["piston", piston], ["bit", bit], ...rods.map((rod, k) => [`string.rods.${k}`, rod.sections])]) {
    if (!(bar?.length > 0 && bar.length <= MOST_SECTIONS)) return WORDS.notWhole;
    for (const [k, numbers] of bar.entries()) {
      for (const [i, row] of section.entries()) {
        if (!allowed(row, numbers?.[i])) return `${name}.sections.${k}.${row.key} = ${shown(row, numbers?.[i])}: must be ${row.allowed}`;
      }
    }
  }
  for (const [key, value] of Object.entries(values)) {
    if (!rows.has(key)) return fill(WORDS.noSuch, { key });
    if (!allowed(rows.get(key), value)) return `${key} = ${shown(rows.get(key), value)}: must be ${rows.get(key).allowed}`;
  }
  return "";
}
