// What limits the trust in the numbers, in the words of the package (simulation/validity.py and
// warnings.py, where each rule is explained).
import { written } from "../../engine/engine.js";

// found: with its counted blows; last: a sample at the end of the motion; notes: texts and limits.
export function notesOf(scene, found, last, { texts, limits, throttled }) {
  const told = [], get = key => scene.get(key), { counted, blows } = found;
  const tell = (name, ...facts) => told.push(filled(texts[name], facts));
  const sum = name => counted.reduce((total, one) => total + one[name], 0);
  const law = get("effects.rock"), buttons = get("rock.buttons");
  if (law === "bilinear" || law === "spring") {
    const depth = Math.max(...blows.map(one => one.peak_bit_force)) / (buttons * get("rock.loading_stiffness"));
    if (depth > limits.depth) tell("button", 1e3 * depth);
  }
  if (law !== "none" && found.rate > limits.rate) tell("rate", found.rate);
  if (get("effects.breaking")) {
    const { breaking_limited: limited, breaking_volume: volume } = last;
    if (limited > limits.limited * (limited + volume)) tell("limit", 100 * limited / (limited + volume));
  }
  const stall = get("effects.rotation") ? get("rotation.stall_torque") : 0;
  if (stall > 0 && last.rotation_needed_torque > stall) tell("jam", last.rotation_needed_torque, stall);
  if (get("effects.feed") && get("feed.on") === "casing") {
    const held = get("feed.force") + get("feed.casing_mass") * (get("effects.gravity") ? get("gravity.acceleration") : 0);
    const recoil = sum("drive_impulse") / sum("period") + (last.recoil_impulse - last.drive_impulse) / last.time;
    if (recoil * limits.held > held) tell(throttled.includes(get("effects.drive")) ? "lifted" : "recoil", 1e-3 * held);
  }
  return told;
}

// Values far from what is usual.
export function unusual(scene, { usual }) {
  return Object.entries(usual).flatMap(([key, { low, high, text }]) => {
    const value = scene.matters(key) ? scene.get(key) : 0, size = Math.abs(value);
    return value && (size < low || size > high) ? [filled(text, [value])] : [];
  });
}

function filled(text, facts) {
  return text.replace(/\{(\d)(?::([^{}]*))?\}/g, (_, k, form) => written(facts[k], form ?? ""));
}
