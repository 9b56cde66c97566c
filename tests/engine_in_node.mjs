// Does jobs with the engine of a folder: `node engine_in_node.mjs FOLDER`, lists of them on lines of
// stdin, what they give on lines of stdout, both as JSON.
import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";

const folder = process.argv[2];
const { Engine } = await import(pathToFileURL(`${folder}/engine.js`));
const table = JSON.parse(readFileSync(`${folder}/table.json`, "utf8"));
const engine = await Engine.load(readFileSync(`${folder}/engine.wasm`), table);

// Words of eight bytes, which JSON keeps as text alone.
const bits = (numbers) => Array.from(new BigInt64Array(Float64Array.from(numbers).buffer), String);

function scene({ preset, rock, bit, values }) {
  let found = table.presets[preset];
  if (bit) found = engine.withBit(found, bit);
  if (rock) found = engine.onRock(found, rock);
  return engine.changed(found, values ?? {});
}

const works = {
  image: (job) => Array.from(engine.image(scene(job)), String),
  run(job) {
    const refused = engine.refuse(scene(job));
    if (refused) return refused;
    const motion = engine.create(scene(job));
    motion.recordsEvents = true;
    if (job.count) motion.runBlows(job.count, job.until);
    else motion.runUntil(job.until);
    if (job.set) motion.set(job.set).runUntil(job.end);
    const { time, blows, events } = motion;
    motion.free();
    const lists = [blows, events].map((rows) => rows.map((row) => bits(Object.values(row))));
    return { time, blows: lists[0], events: lists[1] };
  },
  see(job) {
    const motion = engine.create(scene(job), job.gauge);
    const sample = Object.values(motion.sample(job.times)).map(bits), at = motion.time;
    const fields = Object.entries(motion.fields(at)).map(([bar, one]) =>
      [bar, Object.fromEntries(Object.entries(one).map(([name, row]) => [name, bits(row)]))]);
    const stress = bits(motion.stress([at]))[0];
    motion.free();
    return { sample, fields: Object.fromEntries(fields), stress };
  },
  sizes(job) {
    const found = [];
    for (let k = 0; k < job.times; k++) {
      engine.create(scene(job)).runBlows(1, 1).free();
      found.push(engine.memory.buffer.byteLength);
    }
    return found;
  },
  settle(job) {
    const motion = engine.create(scene(job));
    const found = motion.settle(...job.asked), blows = motion.blows.length, { time } = motion;
    motion.free();
    return { ...found, blows, time };
  },
  fault: (job) => engine.faultText(job.number, job.facts),
};

for await (const line of createInterface({ input: process.stdin })) {
  console.log(JSON.stringify(JSON.parse(line).map((job) => works[job.work](job))));
}
