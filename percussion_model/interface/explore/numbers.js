// Numbers as text, to the digits of `percussion settled` (simulation/uncertain.py).
import { UNITS, WORDS } from "./words.js";

const MOST_DIGITS = 5, SMALLEST_UNIT = 8, SURE = 5, SHOWN = 4, SMALL_ERROR = 1e-4, LARGEST_PLAIN = 1e8;

// As round(value, place) and its text with max(place, 0) digits.
function rounded(value, place) {
  return place >= 0 ? value.toFixed(Math.min(place, 100)) : (Math.round(value * 10 ** place) / 10 ** place).toFixed(0);
}

export function isUndecided(value, error) {
  return error > 0 && error >= Math.abs(value);
}

// A number with so many digits, zeros too: 0.850, 22.0; what is large short.
export function inDigits(value, digits = 3) {
  const near = Number(value.toPrecision(digits));
  if (near === 0) return "0";
  const size = Math.abs(near);
  if (size >= 10 ** (digits - 1) && size < LARGEST_PLAIN) return near.toFixed(0);
  if (size >= 1e-4 && size < 10 ** digits) return near.toPrecision(digits);
  return near.toExponential(digits - 1).replace(/e([+-])(\d)$/, "e$10$2");
}

// Value and error as two texts, to the second digit of the error; no error where it does not show.
export function pair(value, error, most = MOST_DIGITS) {
  const hidden = isUndecided(value, error);
  if (!(error > 0) || (error < 10 ** -most && !hidden)) return [inDigits(value, SURE), ""];
  let place = 1 - Math.floor(Math.log10(error));
  if (!hidden) place = Math.min(place, most);
  return [rounded(value, place), rounded(error, place)];
}

// The rate in a unit: value and error.
export function ratePair(value, error, factor) {
  return error === undefined ? [inDigits(factor * value, SHOWN), ""] : pair(factor * value, factor * error);
}

// A mean in a unit, with its error behind ±.
export function meanText(value, error, factor) {
  const size = factor * value, off = factor * error;
  if (!(off > SMALL_ERROR * Math.abs(size))) return inDigits(size, SHOWN);
  const [shown, behind] = pair(size, off, SMALLEST_UNIT);
  return (isUndecided(size, off) ? `${WORDS.undecided}, ` : "") + (behind ? `${shown} ± ${behind}` : shown);
}

// Unit and factor of a kind of unit, in the system that is chosen.
export function unitOf(kind, imperial) {
  return UNITS[kind][imperial ? 1 : 0];
}

// A number without the rounding of a slider, and without needless digits.
export function short(value, digits = 6) {
  return String(Number(value.toPrecision(digits)));
}
