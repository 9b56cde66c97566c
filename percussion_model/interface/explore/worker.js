// A worker: does one job after the other, and gives up what is for an older wish.
import { Engine, EngineError } from "../../engine/engine.js";
import { runTo, runToBlows, settle } from "./settle.js";
import { keepTables } from "./kept.js";
import { picture } from "./picture.js";

class Overtaken extends Error {}

let engine, newest = 0, known = {}; // until when coarser grids are compared, by the wish
// How often messages are heard [ms], and blows after which a rate so far is told.
const TURN = 30, SOME = 16;
// How often a worker that waits looks again [ms].
const WAIT = 5;

// Let messages come in; throw where something newer is wished.
async function pause(id) {
  await new Promise(done => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = done;
    port2.postMessage(0);
  });
  if (id < newest) throw new Overtaken();
}

const begun = new Promise(ready => {
  onmessage = async ({ data }) => {
    if (data.module) engine = keepTables(await Engine.load(data.module, data.table));
    if (data.module) return ready();
    if (data.end !== undefined) known = data;
    newest = data.newest ?? data.id;
    return data.work && answer(data);
  };
});

async function answer(job) {
  const { id, number } = job, tell = told => postMessage({ number, told });
  let looked = performance.now();
  const keep = async () => { // hear of newer wishes now and then
    if (performance.now() - looked < TURN) return;
    await pause(id);
    looked = performance.now();
  };
  try {
    await begun;
    postMessage({ number, found: await works[job.work](job, keep, tell) });
  } catch (error) {
    if (error instanceof WebAssembly.RuntimeError) postMessage({ crashed: String(error.message) });
    else postMessage(error instanceof Overtaken ? { number, overtaken: true } : { number, refusal: String(error?.message ?? error) });
  }
}

// A motion of a scene for as long as it is used.
async function withMotion(scene, use) {
  const motion = engine.create(scene);
  try {
    return await use(motion);
  } finally {
    motion.free();
  }
}

const works = {
  // Settle, and run on to so many blows as errors need.
  settle: ({ scene, mostTime, tooLong, fewest }, keep, tell) => withMotion(scene, async motion => {
    const began = performance.now();
    let said = false;
    const found = await settle(motion, async blows => {
      const taken = performance.now() - began;
      if (taken > mostTime) throw new Error(tooLong);
      if (!said && taken > TURN && blows.length > SOME) {
        said = true;
        tell({ soFar: blows, grid: motion.grid() });
      }
      await keep();
    });
    const blows = motion.blows.slice();
    tell({ settled: { ...found, blows } });
    const { state, time } = motion, last = Object.fromEntries(Object.entries(motion.sample([time])).map(([name, [value]]) => [name, value]));
    motion.state = state; // samples at the end of it
    if (found.kind !== "stalled") runToBlows(motion, fewest);
    return { all: motion.blows, end: motion.time, last: { ...last, time }, state: motion.state, grid: motion.grid(), numerical: motion.numericalShare() };
  }),

  // The same on a coarser grid: blows to a time as soon as they are there and the time is known, then
  // how it settles.
  coarse: ({ scene, id }, keep, tell) => withMotion(scene, async motion => {
    let said = false;
    const say = () => {
      if (said || known.id !== id || motion.time < known.end) return;
      tell({ blows: motion.blows.slice(), grid: motion.grid() });
      said = true;
    };
    const { kind, order } = await settle(motion, async () => {
      say();
      await keep();
    });
    while (known.id !== id) {
      await new Promise(done => setTimeout(done, WAIT));
      await keep();
    }
    await runTo(motion, known.end, keep);
    say();
    return { kind, order };
  }),

  // Blows to a time.
  run: ({ scene, end }, keep) => withMotion(scene, async motion => {
    await runTo(motion, end, keep);
    return { blows: motion.blows, grid: motion.grid() };
  }),

  // A blow at full rate, from a state on.
  picture: (job, keep) => withMotion(job.scene, motion => {
    motion.state = job.state;
    return picture(motion, job, keep);
  }),

  // The settled rate alone, NaN where there is none.
  rate: ({ scene, scatter }, keep) => orNone(() => withMotion(scene, async motion => (await settle(motion, keep, scatter)).rate)),

  // The rate over a stretch of time, NaN where there is none; numbers: its definition.
  sample: ({ scene, settle: from, end, numbers }, keep) => orNone(() => withMotion(scene, async motion => {
    await runTo(motion, end, keep);
    const blows = motion.blows.filter(blow => blow.time >= from && blow.time + blow.period <= end);
    return Object.values(engine.numbersOver(blows, numbers))[0].value;
  })),
};

async function orNone(use) {
  try {
    return await use();
  } catch (error) {
    if (!(error instanceof EngineError)) throw error;
    return NaN;
  }
}
