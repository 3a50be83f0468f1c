// Values over time, drawn by dygraphs: one strip a unit.
import { displacement, rms } from "./motion.js";
import { nameOf } from "./blob.js";
import { digits } from "./panel.js";

const KEPT = 60; // [s] of a live motion
const MOST_SAMPLES = 20000;

/** What can be drawn: key -> {label, unit, read(frame, status, loads)}. */
export function signalOf(body, key) {
  const [kind, index] = key.split(":"), k = Number(index);
  const ofStatus = (label, unit, read) => ({ label, unit, read: (_, status) => (status ? read(status) : null) });
  switch (kind) {
    case "point": {
      const label = `|V| ${nameOf(body.pointNames, k)}`;
      return { label, unit: "m", read: (frame) => Math.hypot(...displacement(body, frame.q, k)) };
    }
    case "mode": return { label: `q${k + 1}`, unit: "m", read: (frame) => frame.q[k] };
    case "load":
      return { label: nameOf(body.linkNames, body.publishedLinks[k]), unit: "N, N m",
        read: (_frame, _status, loads) => (loads ? loads[k] : null) };
    case "rms": return { label: "rms V", unit: "m", read: (frame) => rms(frame.q) };
    case "spin": return { label: "|w|", unit: "rad/s", read: (frame) => Math.hypot(...frame.spin) };
    case "energy": return ofStatus("elastic energy", "J", (s) => s.kinetic_elastic + s.potential);
    case "error": return ofStatus("error estimate", "m, error", (s) => s.model_error);
    case "scale": return ofStatus("its scale", "m, error", (s) => s.error_scale);
    case "word": return ofStatus("word: 0 good, 1 watch, 2 outside", "", (s) => s.validity);
    case "late": return ofStatus("lateness p99.9", "us", (s) => s.lateness_us.p99_9);
    case "over": return ofStatus("overruns", "ticks", (s) => s.overruns);
    default: return null;
  }
}

/** What a page begins with. `hasStatus`: STATUS is there to be read. */
export function firstSignals(body, hasStatus) {
  const first = ["rms:0"];
  for (let k = 0; k < Math.min(3, body.modes); ++k) first.push(`mode:${k}`);
  return [...first, "spin:0", ...(hasStatus ? ["energy:0", "error:0", "scale:0", "word:0"] : [])];
}

// told apart on black
const COLOURS = ["#6db3f2", "#f2b35c", "#7dd68a", "#ff8a7a", "#c9a0f0", "#5cd6d0", "#f07fb8", "#d8d86a"];

export class Strips {
  /** @param onTime called with a time when it is clicked, where that means something */
  constructor(element, body, onTime) {
    this.element = element;
    this.body = body;
    this.onTime = onTime;
    this.times = []; // [s], the same for all
    this.signals = new Map(); // key -> {signal, values: one a time, null before it was asked for}
    this.graphs = new Map(); // unit -> {graph, keys}
    this.now = null;
  }
  has(key) {
    return this.signals.has(key);
  }
  toggle(key) {
    if (this.signals.delete(key)) return this.layOut();
    const signal = signalOf(this.body, key);
    if (signal) this.signals.set(key, { signal, values: new Array(this.times.length).fill(null) });
    return this.layOut();
  }
  layOut() {
    for (const { graph } of this.graphs.values()) graph?.destroy();
    this.graphs.clear();
    this.element.replaceChildren();
    for (const [key, { signal }] of this.signals) {
      if (!this.graphs.has(signal.unit)) {
        const place = document.createElement("div");
        place.className = "strip";
        this.element.append(place);
        this.graphs.set(signal.unit, { place, keys: [], graph: null });
      }
      this.graphs.get(signal.unit).keys.push(key);
    }
    this.draw();
  }
  clear() {
    this.times = [];
    for (const one of this.signals.values()) one.values = [];
  }
  /** One sample of every signal at a time [s]. */
  take(time, frame, status, loads) {
    const last = this.times.at(-1);
    if (time === last) return;
    if (time < last) this.clear(); // begun anew
    this.times.push(time);
    for (const { signal, values } of this.signals.values()) values.push(signal.read(frame, status, loads));
    let old = 0;
    while (this.times.length - old > 2 && time - this.times[old] > KEPT) ++old;
    if (old < 0.1 * this.times.length) return;
    this.times.splice(0, old);
    for (const { values } of this.signals.values()) values.splice(0, old);
  }
  /** [1/s] of the samples. */
  rate() {
    return (this.times.length - 1) / (this.times.at(-1) - this.times[0]);
  }
  /** The whole of a recording. */
  fill(recording) {
    const step = Math.max(1, Math.ceil(recording.count / MOST_SAMPLES));
    this.clear();
    for (let k = 0; k < recording.count; k += step) {
      const clock = recording.motion.clock[k];
      this.times.push(clock);
      for (const { signal, values } of this.signals.values())
        values.push(signal.read(recording.frame(k), recording.status(clock), recording.loads(clock)));
    }
    this.draw();
  }
  draw() {
    for (const [unit, one] of this.graphs) {
      const all = one.keys.map((key) => this.signals.get(key));
      const labels = ["time [s]", ...all.map(({ signal }) => signal.label)];
      const rows = this.times.map((time, k) => [time, ...all.map(({ values }) => values[k] ?? null)]);
      if (rows.length === 0) continue;
      if (one.graph) {
        one.graph.updateOptions({ file: rows });
        continue;
      }
      one.graph = new (/** @type {any} */ (globalThis).Dygraph)(one.place, rows, {
        labels, ylabel: unit, colors: COLOURS, legend: "always", height: 110, connectSeparatedPoints: true, strokeWidth: 1.3,
        axisLabelFontSize: 10, axisLineColor: "#556", gridLineColor: "#2a2e36", axisLabelWidth: 60,
        digitsAfterDecimal: 6, axes: { y: { pixelsPerLabel: 16, axisLabelFormatter: (value) => digits(value) } },
        underlayCallback: (context, area, graph) => this.mark(context, area, graph),
        clickCallback: (_, time) => this.onTime?.(time),
      });
    }
  }
  /** Where a recording stands. */
  setNow(time) {
    this.now = time;
    for (const { graph } of this.graphs.values()) graph?.updateOptions({});
  }
  mark(context, area, graph) {
    if (this.now === null) return;
    const x = graph.toDomXCoord(this.now);
    context.fillStyle = "#f0c060";
    context.fillRect(x, area.y, 1, area.h);
  }
}
