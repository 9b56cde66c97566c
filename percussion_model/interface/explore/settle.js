// A settled motion, and numbers over its blows with their scatter (analysis/stationary.py,
// simulation/means.py and rate.py, where each rule is explained).

const TOLERANCE = 1e-4, MOST_BLOWS = 400, SCATTER = 0, PIECE = 0.2, SETTLING_SHARE = 0.2;
const LEAST_BLOWS = 3, FEWEST_DEPENDENT = 20, LEAST_ADVANCE = 1e-13;
const QUARTER = [1 / 4], SEVERAL = [1 / 16, 1 / 8, 1 / 4], SO_FAR = [1 / 8, 1 / 4, 1 / 2];
const RATIOS = {
  transfer_efficiency: ["rock_energy", "blow_energy"], percussive_power: ["blow_energy", "period"],
  energy_per_advance: ["blow_energy", "hole_advance"],
};
const sum = values => values.reduce((a, b) => a + b, 0);
const column = (blows, name) => blows.map(one => name === "one" ? 1 : name === "hole_advance" && Math.abs(one[name]) < LEAST_ADVANCE ? 0 : one[name]);

// Run a motion until its blows repeat, or until it is clear that they do not.
// keep: awaited with the blows so far; throws to give up.
export async function settle(motion, keep) {
  const run = motion.settling(TOLERANCE, MOST_BLOWS, SCATTER, PIECE);
  let step;
  while (!(step = run.next()).done) {
    try {
      await keep(motion.blows);
    } catch (error) {
      run.return();
      throw error;
    }
  }
  const { kind, order, rate, error, multiplier } = step.value, blows = motion.blows.slice();
  const counted = order ? blows.slice(-order) : afterSettling(blows);
  const settling = kind === "aperiodic" ? rateOfBlows(counted, SO_FAR)[1] : error;
  return { kind, order, rate, settling, multiplier, blows, counted };
}

// Blows of an aperiodic motion that count.
export function afterSettling(blows) {
  return blows.slice(Math.trunc(SETTLING_SHARE * blows.length));
}

// Ratio of the sums of two series, and its standard error.
export function ratioOfSums(values, weights, stretches = QUARTER) {
  const count = values.length, total = sum(weights), ratio = sum(values) / total;
  if (count < LEAST_BLOWS) return [ratio, NaN];
  const sums = [0];
  values.forEach((value, k) => sums.push(sums[k] + value - ratio * weights[k]));
  const scattered = length => [
    sum(sums.slice(length).map((one, k) => (one - sums[k]) ** 2)) / (sums.length - length), length * (1 - length / count)];
  const [short, walk] = scattered(1);
  if (count < FEWEST_DEPENDENT) return [ratio, Math.sqrt(short / walk * count) / total];
  let variance = 0;
  for (const length of new Set(stretches.map(share => Math.max(Math.trunc(share * count), 2)))) {
    const [long, longer] = scattered(length);
    let a = Math.max((long - short) / (longer - walk), 0), b = short - a * walk;
    if (b < 0) [a, b] = [long / longer, 0];
    variance = Math.max(variance, a * count + b);
  }
  return [ratio, Math.sqrt(variance) / total];
}

export function rateOfBlows(blows, stretches = QUARTER) {
  return blows.length < LEAST_BLOWS ? [NaN, NaN] : ratioOfSums(column(blows, "hole_advance"), column(blows, "period"), stretches);
}

// Numbers over blows that the page shows, SI units.
export function numbersOver(blows) {
  const mean = name => sum(column(blows, name)) / blows.length, period = mean("period");
  const found = { blow_period: period, blow_frequency: 1 / period, impact_velocity: mean("impact_velocity") };
  for (const [name, [over, under]] of Object.entries(RATIOS)) {
    const below = sum(column(blows, under));
    found[name] = below > 0 ? sum(column(blows, over)) / below : NaN;
  }
  return found;
}

// Standard errors of these numbers by their scatter.
export function scatterOver(blows) {
  const error = (over, under) => ratioOfSums(column(blows, over), column(blows, under), SEVERAL)[1];
  const found = { blow_period: error("period", "one"), impact_velocity: error("impact_velocity", "one") };
  for (const [name, [over, under]] of Object.entries(RATIOS)) found[name] = sum(column(blows, under)) > 0 ? error(over, under) : NaN;
  found.blow_frequency = found.blow_period / (sum(column(blows, "period")) / blows.length) ** 2;
  return found;
}
