// Errors of a settled motion by its grid, from runs with fewer modes (simulation/error_estimate.py
// and decisions.py, where each rule is explained).
import { numbersOver, rateOfBlows, ratioOfSums, scatterOver, settle } from "./settle.js";

const COARSER = [0.5, 0.7], DEFAULT_MODES = 20, PIECE = 0.2, LANE = 8, LEAST_MODES = 0.3, FLOOR_SHARE = 0.08, SLIGHT_LOSS = 5e-4;
const CONFIDENCE = 2, SPREAD_MARGIN = 1.5, RARE = 0.25, SAME_MOTION = 0.5, SAME_SHARE = 0.05, STEADY = 1e-4, SCATTERING = 20;
const UNSURE = 6, UNSURE_OTHERWISE = 0.02, BEYOND = 1.2, NEAR = 3, FAR = 0.07;
const CALIBRATED = [[1e-1, 14], [2e-2, 20], [1e-2, 28], [1e-3, 56], [1e-4, 128]];
const FEWEST_JUDGED = 12, STALLED_AFTER = 2, LONGER_STEPS = Math.SQRT2, ROUNDING = 1e-12;
const RATE = "rate_of_penetration";
export const LONGEST = { pneumatic: 1e-3, hydraulic: 1e-3 };

// Modes that are asked for in the first bar; there are whole lanes of them.
function asked({ transits: [first, shortest], cells }) {
  return cells === null || Number.isNaN(cells) ? Math.ceil(DEFAULT_MODES * first / shortest - 1e-9) : cells;
}

const inLanes = modes => LANE * Math.ceil(modes / LANE);

// Changes to fewer modes, and longer steps of chambers.
function coarser(scene) {
  const modes = asked(scene), counts = [...new Set(COARSER.map(share => Math.ceil(share * modes)))].filter(one => one < modes);
  const longer = {};
  if (LONGEST[scene.drive]) {
    const share = LONGER_STEPS * scene.step <= LONGEST[scene.drive] ? LONGER_STEPS : 0.5;
    longer[`${scene.drive}.step`] = share * scene.step;
  }
  return counts.sort((a, b) => a - b).map(count => ({ modes: inLanes(count), changes: { "solver.cells": count, ...longer } }));
}

// Relative error of the rate that the rule expects of so many modes.
function promised({ transits: [first, shortest], loss }, modes) {
  const place = Math.log(modes * shortest / first), known = CALIBRATED.map(([error, count]) => [Math.log(count), -Math.log(error)]);
  let value = place <= known[0][0] ? known[0][1] : known.at(-1)[1];
  for (let k = 0; k + 1 < known.length; k++) {
    const [[x, y], [next, high]] = [known[k], known[k + 1]];
    if (place >= x && place <= next) value = y + (place - x) / (next - x) * (high - y);
  }
  const steps = loss * modes / first;
  return Math.max(Math.exp(-value), steps > 0 ? SLIGHT_LOSS / steps : Infinity);
}

// A run on one grid: its numbers by name as [value, scatter, distance to blows of one kind].
function gridRun(modes, all, settled) {
  const blows = all.filter(one => one.time >= settled), kinds = twoKinds(blows), numbers = {};
  const values = { [RATE]: rateOfBlows(blows)[0], ...numbersOver(blows) }, scatters = { [RATE]: rateOfBlows(blows)[1], ...scatterOver(blows) };
  const ofKinds = kinds.map(kind => ({ [RATE]: rateOfBlows(kind)[0], ...numbersOver(kind) }));
  for (const [name, value] of Object.entries(values)) {
    const off = ofKinds.map(one => Math.abs(one[name] / value - 1)).filter(one => !Number.isNaN(one));
    numbers[name] = { value, scatter: scatters[name], apart: value === 0 ? 0 : Math.max(0, ...off) };
  }
  return { modes, blows, numbers, cycles: blows.reduce((a, one) => a + one.drilling_cycles, 0) / (blows.length || 1) };
}

function twoKinds(blows) {
  const cycles = blows.map(one => one.drilling_cycles), least = Math.min(...cycles);
  const few = blows.filter(one => one.drilling_cycles === least), rest = blows.filter(one => one.drilling_cycles !== least);
  if (!rest.length || new Set(rest.map(one => one.drilling_cycles)).size > 1) return [];
  return Math.min(few.length, rest.length) < RARE * blows.length ? [few, rest] : [];
}

const useful = number => number && Number.isFinite(number.value) && number.value !== 0;

function repeatAlike(run, other) {
  const [steady, scatters] = [run, other].map(one => Math.abs(one.scatter / one.value));
  return !(steady <= STEADY && SCATTERING * STEADY <= scatters);
}

function difference(other, run) {
  const off = Math.abs(run.value - other.value);
  if (repeatAlike(run, other) && off <= CONFIDENCE * Math.hypot(run.scatter, other.scatter)) return 0;
  return off / Math.abs(run.value);
}

// Relative error of a number by the number of modes.
function byModes(run, others, name, expected) {
  const own = run.numbers[name], known = others.filter(one => useful(one.numbers[name]));
  if (!known.length) return Infinity;
  const near = known.filter(one => one.modes >= LEAST_MODES * run.modes), taken = near.length ? near : known.slice(-1);
  const off = Math.max(...taken.map(one => difference(one.numbers[name], own)));
  const same = taken.every(one => repeatAlike(own, one.numbers[name]) && Math.abs(run.cycles - one.cycles) <= Math.max(SAME_MOTION, SAME_SHARE * run.cycles));
  return same ? off : Math.max(SPREAD_MARGIN * off, expected);
}

const median = values => {
  const known = values.filter(Number.isFinite).sort((a, b) => a - b), half = known.length >> 1;
  return known.length ? (known.length % 2 ? known[half] : 0.5 * (known[half - 1] + known[half])) : NaN;
};

// Barriers, by the present one, beyond which close decisions fall the other way.
function otherBarriers(run, others) {
  const margins = run.blows.map(one => one.barrier_margin), alike = others.filter(one => Math.abs(run.cycles - one.cycles) <= SAME_MOTION);
  const offs = alike.map(one => Math.abs(median(one.blows.map(blow => blow.barrier_margin)) - median(margins))).filter(Number.isFinite);
  const unsure = alike.length < others.length ? UNSURE_OTHERWISE : UNSURE * Math.max(0, ...offs), found = [];
  for (const sign of [1, -1]) {
    const side = margins.filter(one => sign * one > 0);
    if (!side.some(one => Math.abs(one) <= Math.min(unsure, FAR))) continue;
    const near = side.filter(one => Math.abs(one) <= Math.min(NEAR * unsure, FAR));
    found.push(1 + sign * BEYOND * Math.max(...near.map(Math.abs), Math.min(unsure, FAR)));
  }
  return found;
}

// Run a motion to a time in pieces, which give the same bits.
async function runTo(motion, end, keep) {
  while (motion.time < end) {
    motion.runUntil(Math.min(motion.time + PIECE, end));
    await keep();
  }
}

// Errors by name [SI], and whether coarser grids have the same motion.
// start: takes changes of the image, gives a motion; keep: throws to give up.
export async function withErrors(found, motion, scene, start, keep) {
  const settling = found.order ? 0.5 : 0.2, others = [], motions = [], modes = inLanes(asked(scene)), expected = promised(scene, modes);
  while (motion.blows.length < FEWEST_JUDGED) {
    const before = motion.blows.length;
    motion.runBlows(1, motion.time + STALLED_AFTER);
    if (motion.blows.length === before) break;
  }
  const end = motion.time, from = settling * end, whole = blows => blows.filter(one => one.time + one.period <= end);
  for (const { modes: fewer, changes } of coarser(scene)) {
    const other = start(changes);
    try {
      motions.push(await settle(other, keep));
      await runTo(other, end, keep);
      others.push(gridRun(fewer, whole(other.blows), from));
    } finally {
      other.free();
    }
  }
  const same = motions.every(one => one.kind === found.kind && one.order === found.order);
  const own = gridRun(modes, whole(motion.blows), from);
  const decided = [];
  for (const factor of otherBarriers(own, others)) {
    const other = start({ "rock.barrier_threshold": factor * scene.barrier });
    try {
      await runTo(other, end, keep);
      decided.push(gridRun(modes, whole(other.blows), from));
    } finally {
      other.free();
    }
  }
  const grid = {};
  for (const [name, number] of Object.entries(own.numbers)) {
    if (!useful(number)) continue;
    const moved = decided.map(one => one.numbers[name]).filter(useful).map(one => difference(one, number));
    const by = Math.max(byModes(own, others, name, expected), SPREAD_MARGIN * number.apart, SPREAD_MARGIN * Math.max(0, ...moved));
    const total = Math.abs(number.value) * Math.max(Math.abs(number.scatter / number.value), by, FLOOR_SHARE * expected);
    if (Number.isFinite(total)) grid[name] = total;
  }
  return { same, errors: errorsOf(found, grid), grid };
}

// The whole errors: of settling and grid.
export function errorsOf(found, grid) {
  const { order, counted, blows } = found, errors = {};
  const join = (name, settling) => {
    const error = order ? settling + (grid[name] ?? 0) : Math.max(settling, grid[name] ?? 0);
    errors[name] = error < ROUNDING && name !== RATE ? 0 : error;
  };
  join(RATE, found.settling);
  const last = numbersOver(counted), before = order ? numbersOver(blows.slice(-2 * order, -order)) : scatterOver(counted);
  for (const name of Object.keys(last)) join(name, order ? Math.abs(last[name] - before[name]) : before[name]);
  if (!order) join("blow_period", ratioOfSums(counted.map(one => one.period), counted.map(() => 1))[1]);
  return errors;
}
