// The worker: answers the newest wish of the page, the rate first, then all that takes longer.
import { Engine, EngineError } from "../../engine/engine.js";
import { afterSettling, numbersOver, rateOfBlows, settle } from "./settle.js";
import { LONGEST, errorsOf, withErrors } from "./grid_error.js";
import { keepTables } from "./kept.js";
import { picture } from "./picture.js";

class Overtaken extends Error {}

let engine, newest = 0;
// How often messages are heard [ms], and blows after which a rate so far is told.
const TURN = 30, SOME = 16;
// How often progress is told [ms].
const TOLD = 300;
// Runs of rigid bodies that tell how the rate changes with the rock [s].
const DURATION = 2, SETTLE = 0.5;

// Let messages come in; throw where something newer is wished.
async function pause(id) {
  await new Promise(done => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = done;
    port2.postMessage(0);
  });
  if (id !== newest) throw new Overtaken();
}

onmessage = async ({ data }) => {
  if (data.wasm) {
    try {
      engine = keepTables(await Engine.load(data.wasm, data.table));
      postMessage({ ready: true });
    } catch (error) {
      postMessage({ broken: String(error?.message ?? error) });
    }
    return;
  }
  newest = data.id;
  try {
    await answer(data);
  } catch (error) {
    if (error instanceof WebAssembly.RuntimeError) postMessage({ crashed: String(error.message) });
    else if (!(error instanceof Overtaken)) postMessage({ id: data.id, what: "refusal", text: String(error?.message ?? error) });
  }
};

async function answer(wish) {
  const { id } = wish, tell = (what, more) => postMessage({ id, what, ...more }), began = performance.now();
  let looked = began, told = false;
  const keep = async () => { // hear of newer wishes now and then
    if (performance.now() - looked < TURN) return;
    await pause(id);
    looked = performance.now();
  };
  const watch = async blows => {
    const taken = performance.now() - began;
    if (taken > wish.mostTime) throw new Error(wish.tooLong);
    if (!told && taken > TURN && blows.length > SOME) {
      const counted = afterSettling(blows);
      told = tellRate(tell, { kind: "settling", order: 0, rate: rateOfBlows(counted)[0], counted, blows });
    }
    await keep();
  };
  await pause(id);
  const motion = engine.create(wish.scene), start = changes => engine.create(engine.changed(wish.scene, changes));
  try {
    const found = await settle(motion, watch);
    tellRate(tell, found);
    await pause(id);
    tell("picture", { picture: await picture(motion, wish, keep) });
    tell("errors", await errors(found, motion, wish, start, keep));
    for (const { key, places } of wish.curves) {
      for (const x of places) tell("point", { curve: key, x, rate: await rateAt(() => start({ [key]: x }), keep) });
    }
    if (wish.interval) await interval(wish, start, tell, keep);
  } finally {
    motion.free();
  }
}

// Rigid bodies move in closed form; how far waves are off is known to the package alone.
async function errors(found, motion, { known, scene }, start, keep) {
  const hasRate = found.kind !== "stalled" && found.rate !== 0;
  if (hasRate && motion.solver === "modal" && (scene.values["solver.accuracy"] ?? null) === null) return withErrors(found, motion, known, start, keep);
  return { errors: hasRate && motion.solver === "rigid" && !LONGEST[known.drive] ? errorsOf(found, {}) : {} };
}

function tellRate(tell, { kind, order, rate, multiplier, counted, blows }) {
  const means = kind === "stalled" || !counted.length ? {} : numbersOver(counted);
  tell("rate", { found: { kind, order, rate, multiplier, counted: counted.length, blows, means } });
  return true;
}

async function rateAt(begin, keep) {
  let one;
  try {
    one = begin();
    return (await settle(one, keep)).rate;
  } catch (error) {
    if (!(error instanceof EngineError)) throw error;
    return NaN; // that point has no rate
  } finally {
    one?.free();
  }
}

// How far the rate lies off where rock and bit are others within what is known of them, by runs of
// rigid bodies where there are no rods (analysis/rock_interval.py).
async function interval(wish, start, tell, keep) {
  const rigid = values => {
    const one = start(wish.interval.isString ? values : { ...values, "piston.model": "rigid", "bit.model": "rigid" });
    try {
      one.runUntil(DURATION);
      return rateOfBlows(one.blows.filter(blow => blow.time >= SETTLE && blow.time + blow.period <= DURATION))[0];
    } catch (error) {
      if (!(error instanceof EngineError)) throw error;
      return NaN; // that sample has no rate
    } finally {
      one.free();
    }
  };
  const own = rigid({}), found = [];
  let told = performance.now();
  for (const sample of wish.interval.samples) {
    await keep();
    if (performance.now() - told > TOLD) {
      told = performance.now();
      tell("sampled", { done: found.length, count: wish.interval.samples.length });
    }
    found.push(rigid(sample) / own);
  }
  const known = found.filter(Number.isFinite).sort((a, b) => a - b);
  const at = share => {
    const place = share * (known.length - 1), k = Math.floor(place);
    return known[k] + (place - k) * ((known[k + 1] ?? known[k]) - known[k]);
  };
  if (known.length && own > 0) tell("interval", { ends: [at(0.05), at(0.95)] });
}
