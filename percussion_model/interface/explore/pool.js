// Workers, and what they have to do for the newest wish.

// At least, and at most so many: one draws pictures while others run coarser grids.
const FEWEST = 3, MOST = 6;

export class Overtaken extends Error {}

export class Pool {
  // make: gives a worker that has the engine; crashed: takes why one has died.
  constructor(make, crashed) {
    Object.assign(this, { make, crashed, waiting: [], newest: 0, jobs: 0 });
    const cores = navigator.hardwareConcurrency || 0, count = Math.min(Math.max(cores, FEWEST), MOST);
    this.hasRoom = cores >= count; // each has a core
    this.hands = Array.from({ length: count }, () => this.hire());
  }

  hire() {
    const hand = { worker: this.make(), job: null };
    hand.worker.onmessage = ({ data }) => this.hear(hand, data);
    hand.worker.onerror = event => { event.preventDefault(); this.bury(hand, event.message); };
    return hand;
  }

  // A worker that has died is followed by another.
  bury(hand, why) {
    hand.worker.terminate();
    Object.assign(hand, this.hire());
    this.crashed(why);
  }

  // From now on jobs of a wish alone are done.
  wish(id) {
    this.newest = id;
    for (const { fail } of this.waiting.splice(0)) fail(new Overtaken());
    for (const { worker, job } of this.hands) if (job) worker.postMessage({ newest: id });
  }

  // Tell all workers until when the runs of the newest wish are compared [s].
  ends(end) {
    for (const { worker } of this.hands) worker.postMessage({ id: this.newest, end });
  }

  // Do a job for a wish: { work, ... } as the worker knows it. told: takes what it says meanwhile.
  run(id, job, told) {
    return new Promise((done, fail) => {
      if (id !== this.newest) return fail(new Overtaken());
      this.waiting.push({ id, number: ++this.jobs, job, told, done, fail });
      this.next();
    });
  }

  next() {
    for (const hand of this.hands) {
      if (hand.job || !this.waiting.length) continue;
      hand.job = this.waiting.shift();
      hand.worker.postMessage({ id: hand.job.id, number: hand.job.number, ...hand.job.job });
    }
  }

  hear(hand, answer) {
    const { job } = hand;
    if (answer.crashed) return this.bury(hand, answer.crashed);
    if (!job || answer.number !== job.number) return undefined;
    if (answer.told) return job.id === this.newest && job.told?.(answer.told);
    hand.job = null;
    if (job.id !== this.newest || answer.overtaken) job.fail(new Overtaken());
    else if (answer.refusal !== undefined) job.fail(new Error(answer.refusal));
    else job.done(answer.found);
    return this.next();
  }
}
