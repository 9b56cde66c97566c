// A settled motion (analysis/stationary.py, where each rule is explained).
const TOLERANCE = 1e-4, MOST_BLOWS = 400, PIECE = 0.2, STALLED_AFTER = 2;

// Run a motion until its blows repeat, or until it is clear that they do not, or their rate is known to a
// scatter (0: never).
// keep: awaited with the blows so far, and told when a time is reached; throws to give up.
export async function settle(motion, keep, scatter = 0) {
  const run = motion.settling(TOLERANCE, MOST_BLOWS, scatter, PIECE);
  let step;
  while (!(step = run.next()).done) {
    try {
      await keep(motion.blows);
    } catch (error) {
      run.return();
      throw error;
    }
  }
  return step.value;
}

// Run a motion to a time in pieces, which give the same bits.
export async function runTo(motion, end, keep) {
  while (motion.time < end) {
    motion.runUntil(Math.min(motion.time + PIECE, end));
    await keep(motion.blows);
  }
}

// Run on to so many blows, or until they cease.
export function runToBlows(motion, count) {
  for (let before = -1; motion.blows.length < count && motion.blows.length > before;) {
    before = motion.blows.length;
    motion.runBlows(1, motion.time + STALLED_AFTER);
  }
}
