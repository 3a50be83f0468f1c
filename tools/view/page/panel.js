// What stands beside the picture: figures of the daemon, modes, signals, and notices.
import { nameOf } from "./blob.js";

const WORDS = ["good", "watch", "outside"];

export function element(name, properties = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

/** A number for people. */
export function digits(value, unit = "") {
  if (value === null || value === undefined || !Number.isFinite(value)) return "unknown";
  const text = value === 0 || (Math.abs(value) >= 0.01 && Math.abs(value) < 1e5)
    ? String(Number(value.toPrecision(4))) : value.toExponential(2);
  return unit ? `${text} ${unit}` : text;
}

/** Rows of the status table. */
export function statusRows(body, frame, status, factor, mode) {
  const rows = [["scene", body.name]];
  if (status) rows.push(["daemon", `${status.mode}, ${status.time_mode}, ${digits(status.rate, "Hz")}`]);
  if (frame) rows.push(["tick", `${frame.tick}   ${digits(frame.time, "s")}`]);
  if (status) {
    const word = WORDS[status.validity] ?? String(status.validity);
    rows.push(["word", status.validity_cause ? `${word}: ${status.validity_cause}` : word, `word ${word}`]);
    if (status.worst_validity > status.validity)
      rows.push(["worst", `${WORDS[status.worst_validity]} at tick ${status.worst_validity_tick}: ${status.worst_validity_cause}`]);
    rows.push(["error", `${digits(status.model_error, "m")} of ${digits(status.error_scale, "m")}`]);
    rows.push(["energy", `rigid ${digits(status.kinetic_rigid, "J")}, elastic ${digits(status.kinetic_elastic + status.potential, "J")}`]);
    rows.push(["lateness", `p50 ${digits(status.lateness_us.p50)}, p99.9 ${digits(status.lateness_us.p99_9)}, most ${digits(status.lateness_us.max, "us")}`]);
    rows.push(["compute", `p50 ${digits(status.compute_us.p50)}, p99.9 ${digits(status.compute_us.p99_9, "us")}`]);
    rows.push(["overruns", `${status.overruns}, slips ${status.slips}`]);
  }
  rows.push(["drawn", mode === null ? `displacements times ${digits(factor)}`
    : `mode ${mode + 1} alone, slowly and at no scale`]);
  return rows;
}

export function showRows(table, rows) {
  table.replaceChildren(...rows.map(([name, text, kind]) =>
    element("tr", {}, element("th", { textContent: name }), element("td", { textContent: text, className: kind ?? "" }))));
}

/** Buttons of the modes: `onPick(mode)`, null for none. */
export function modeList(body, onPick) {
  const buttons = [];
  const pick = (mode) => {
    buttons.forEach((button, k) => button.classList.toggle("on", k === mode));
    onPick(mode);
  };
  body.frequencies.forEach((frequency, k) => {
    const text = `${k + 1}   ${frequency === 0 ? "mechanism" : digits(frequency, "Hz")}`;
    const button = element("button", { textContent: text });
    button.onclick = () => pick(button.classList.contains("on") ? null : k);
    buttons.push(button);
  });
  return buttons;
}

/** Options of the choice of signals. */
export function signalOptions(body) {
  /** @type {[string, string[], string[]][]} */
  const groups = [["whole", ["rms:0", "spin:0", "energy:0", "error:0", "scale:0", "word:0", "late:0", "over:0"],
    ["rms displacement", "spin", "elastic energy", "error estimate", "scale of the error", "word", "lateness p99.9", "overruns"]]];
  const list = (label, kind, count, name) => {
    const shown = Math.min(count, 1000);
    if (shown > 0) groups.push([label, Array.from({ length: shown }, (_, k) => `${kind}:${k}`), Array.from({ length: shown }, (_, k) => name(k))]);
  };
  list("modes", "mode", body.modes, (k) => `q${k + 1}, ${digits(body.frequencies[k], "Hz")}`);
  list("points", "point", body.points, (k) => nameOf(body.pointNames, k));
  list("links", "load", body.publishedLinks.length, (k) => nameOf(body.linkNames, body.publishedLinks[k]));
  return groups.map(([label, keys, texts]) =>
    element("optgroup", { label }, ...keys.map((value, k) => element("option", { value, textContent: texts[k] }))));
}
