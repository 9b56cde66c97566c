// The result in words and numbers, with both errors.
import { inDigits, isUndecided, meanText, ratePair, unitOf } from "./numbers.js";
import { NUMBERS, WORDS, fill } from "./words.js";

// A smaller share or number is rounding.
const NOTHING = 1e-11;

const part = id => document.getElementById(id);

// How the blows follow each other, in a sentence.
export function motionWords(found) {
  const { kind, order, counted } = found;
  const said = kind === "periodic" ? (order === 1 ? WORDS.kinds.once : fill(WORDS.kinds.cycle, { n: order }))
    : fill(WORDS.kinds[kind], { n: counted.length });
  const more = (found.rate === 0 ? WORDS.nothing[found.still ? "still" : found.rock] ?? WORDS.nothing.bilinear : "") + (found.undamped ? WORDS.undamped : "");
  return said + more + (found.same === true ? WORDS.sameMotion : found.same === false ? WORDS.otherMotion : "");
}

export function rateText(found, imperial, kind = "rate") {
  const [unit, factor] = unitOf(kind, imperial), { rate, errors } = found;
  if (!Number.isFinite(rate)) return ["–", ""];
  if (rate === 0) return [`0 ${unit}`, ""];
  if (found.undamped) return [WORDS.undecided, fill(WORDS.atThis, { value: `${inDigits(factor * rate)} ${unit}` })];
  const [value, error] = ratePair(rate, errors?.rate_of_penetration, factor);
  if (errors && isUndecided(rate, errors.rate_of_penetration)) return [WORDS.undecided, `${value} ± ${error} ${unit}`];
  return [`${value} ${unit}`, error && `${error} ${unit}`];
}

// Numbers of a response by name: text with unit.
export function numberTexts(found, imperial) {
  const shown = [];
  const [slow] = rateText(found, imperial, "slow"), [, behind] = rateText(found, imperial, "slow");
  if (found.rate && !found.undamped) shown.push(["Rate", behind && !slow.startsWith(WORDS.undecided) ? `${slow.replace(/ \S+$/, "")} ± ${behind}` : slow]);
  for (const [key, name, kind] of NUMBERS) {
    const value = found.means?.[key];
    if (!Number.isFinite(value) || found.rock === "none" || (key === "specific_energy" && (found.undamped || found.rate === 0))) continue;
    const [unit, factor] = unitOf(kind, imperial);
    const text = key === "rotation_torque" ? inDigits(factor * value) // its error is not estimated
      : meanText(Math.abs(value) < NOTHING ? 0 : value, found.errors?.[key], factor);
    shown.push([name, `${text} ${unit}`]);
  }
  return shown;
}

export function showResult(found, pinned, imperial) {
  const section = part("result");
  section.classList.remove("waiting");
  part("refusal").hidden = !found.refusal;
  part("refusal").textContent = found.refusal ?? "";
  if (found.refusal) {
    part("rate").textContent = "–";
    for (const id of ["numerical", "range", "motion", "why", "notes", "rock-error", "numbers"]) part(id).textContent = "";
    return;
  }
  const [rate, error] = rateText(found, imperial);
  part("rate").textContent = rate;
  part("numerical").textContent = !found.rate ? "" : found.undamped ? error : found.errors ? (error ? fill(WORDS.numerical, { error }) : found.errors.rate_of_penetration === undefined ? WORDS.errorUnknown : "") : WORDS.noError;
  part("motion").textContent = motionWords(found);
  part("why").textContent = whyWords(found, pinned, imperial);
  part("notes").replaceChildren(...found.notes.map(text => Object.assign(document.createElement("p"), { className: "refusal", textContent: text })));
  [part("range").textContent, part("rock-error").textContent] = rockWords(found, imperial);
  const others = new Map(pinned ? numberTexts(pinned, imperial) : []);
  part("numbers").innerHTML = numberTexts(found, imperial).map(([name, text]) =>
    `<div><dt>${name}</dt><dd>${text}</dd>${others.has(name) ? `<dd class="pinned">${others.get(name)}</dd>` : ""}</div>`).join("");
}

// Where the energy of a blow goes, and what makes the rate another than the pinned one: the rate is the
// product of blows per second, energy of a blow, share into the rock, and advance by that energy.
function whyWords(found, pinned, imperial) {
  const parts = one => {
    const { percussive_power: power, blow_frequency: frequency, transfer_efficiency: share, energy_per_advance: by } = one.means;
    return { frequency, blow: power / frequency, share, depth: 1 / (by * share) };
  };
  if (!found.rate || found.undamped) return "";
  const own = parts(found), [unit, factor] = unitOf("length", imperial), [work, per] = unitOf("energy", imperial), blow = own.blow * own.share * own.depth;
  const said = fill(own.share > 1 ? WORDS.energyOfFeed : WORDS.energyOf, { blow: `${inDigits(per * own.blow)} ${work}`, share: inDigits(100 * own.share), advance: inDigits(factor * blow), unit });
  if (!pinned?.rate || pinned.undamped) return said;
  const before = parts(pinned), shares = Object.fromEntries(Object.keys(own).map(name => [name, inDigits(own[name] / before[name])]));
  return `${said} ${fill(WORDS.against, shares)}${found.stiffness > pinned.stiffness ? WORDS.softer : ""}`;
}

function rockWords(found, imperial) {
  if (!found.rate || found.undamped || !found.interval) return ["", ""];
  if (typeof found.interval === "string") return ["", found.interval];
  const [unit, factor] = unitOf("rate", imperial), [low, high] = found.interval.ends.map(end => inDigits(factor * found.rate * end, 2));
  return [fill(WORDS.rockRange, { low, high: `${high} ${unit}` }), fill(WORDS.rockError, { rock: found.interval.rock })];
}
