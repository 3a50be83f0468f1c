// The arithmetic of the page, compared with the program's read-out. Node runs it; FREEFLEX_PAGE is the folder of the
// page's sources and FREEFLEX_FIXTURE is the folder that view_fixture wrote.
import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";
import test from "node:test";
import { pathToFileURL } from "node:url";

const source = process.env.FREEFLEX_PAGE, fixture = process.env.FREEFLEX_FIXTURE;
const load = (name) => import(pathToFileURL(join(source, name)));
const { parseBlob, parseMessage, nameOf, fromBase64 } = await load("blob.js");
const motion = await load("motion.js");
const { Camera, multiply, project, rigid } = await load("camera.js");
const { forceOf, pick, firstForce } = await load("push.js");
const { firstSignals, signalOf } = await load("strips.js");
const { recordedVerdict, statusRows } = await load("panel.js");

const bytes = (name) => {
  const data = readFileSync(join(fixture, name));
  return data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength);
};
const scenes = ["satellite", "truss104", "boom", "rotor"];
const read = (name) => ({
  body: parseBlob(bytes(`${name}.body`)), frame: parseMessage(bytes(`${name}.state`)),
  loads: parseMessage(bytes(`${name}.loads`)), expected: JSON.parse(readFileSync(join(fixture, `${name}.json`))),
});
const distance = (a, b) => Math.hypot(...a.map((x, k) => x - b[k]));

test("positions and displacements agree with the read-out to 1e-6", () => {
  for (const name of scenes) {
    const { body, frame, expected } = read(name);
    assert.equal(frame.tick, expected.tick);
    assert.ok(Math.abs(frame.time - expected.time) < 1e-12);
    assert.ok(expected.points.length > 3);
    const largest = Math.max(...expected.points.map(({ displacement }) => Math.hypot(...displacement)));
    assert.ok(largest > 0, `${name} does not move`);
    for (const { point, position, displacement } of expected.points) {
      assert.ok(distance(motion.worldPoint(body, frame, point), position) < 1e-6 * body.size, `${name} ${point}`);
      assert.ok(distance(motion.displacement(body, frame.q, point), displacement) < 1e-6 * largest, `${name} ${point}`);
    }
  }
});

test("modal coordinates give the mass-weighted rms of the points", () => {
  const { body, frame } = read("truss104");
  let sum = 0, mass = 0;
  for (let point = 0; point < body.points; ++point) {
    sum += body.masses[point] * Math.hypot(...motion.displacement(body, frame.q, point)) ** 2;
    mass += body.masses[point];
  }
  assert.ok(Math.abs(Math.sqrt(sum / mass) / motion.rms(frame.q) - 1) < 1e-5);
});

test("rotations, pointing error and wheels are plotted with units", () => {
  const { body, frame, expected } = read("satellite");
  assert.deepEqual(body.attitude, expected.initial_attitude);
  assert.ok(expected.wheels.length > 1 && expected.wheels.some((h) => h !== 0));
  assert.deepEqual(frame.wheels, expected.wheels);
  const signals = firstSignals(body, true).map((key) => ({ key, ...signalOf(body, key) }));
  for (const { strip } of signals) assert.match(strip, /\[.+\]|^verdict/);
  const of = (kind) => signals.filter(({ key }) => key.startsWith(`${kind}:`)).map(({ read: value }) => value(frame, null, null));
  assert.deepEqual(of("rate"), frame.spin);
  assert.deepEqual(of("wheel"), expected.wheels);
  const angles = of("attitude"), [pointing] = of("pointing");
  assert.ok(pointing > 0 && Math.abs(Math.hypot(...angles) - pointing) < 1e-12 * pointing);
});

test("the rotation vector uses the smaller of the two angles", () => {
  const times = ([a, b, c, d], [w, x, y, z]) => [a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y,
    a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w];
  const of = (v) => {
    const angle = Math.hypot(...v), share = angle === 0 ? 0 : Math.sin(angle / 2) / angle;
    return [Math.cos(angle / 2), ...v.map((x) => share * x)];
  };
  const from = of([0.3, -1.1, 0.7]);
  for (const v of [[0, 0, 0], [1e-9, 2e-9, 0], [0.1, -0.2, 0.3], [2, 1, -2]]) {
    const to = times(from, of(v));
    assert.ok(distance(motion.rotationBetween(from, to), v) < 1e-14 * 10, `${v}`);
    assert.ok(distance(motion.rotationBetween(from, to.map((x) => -x)), v) < 1e-14 * 10, `${v}`);
  }
});

test("the body fills the picture, whatever its shape", () => {
  for (const name of scenes) {
    const { body } = read(name), R = motion.rotation(body.attitude);
    const positions = Array.from({ length: body.points }, (_, k) => motion.apply(R, [...body.rest.slice(3 * k, 3 * k + 3)]));
    for (const [width, height] of [[880, 800], [420, 400], [300, 900]]) {
      const camera = new Camera(body.size);
      camera.face(positions);
      camera.fit(positions, width, height);
      const matrix = camera.matrix(width, height);
      const extent = [0, 1].map((axis) => Math.max(...positions.map((position) => {
        const [x, y, depth] = project(matrix, position, width, height);
        assert.ok(depth > 0);
        return Math.abs(axis === 0 ? (2 * x) / width - 1 : (2 * y) / height - 1);
      })));
      // a margin of a fourteenth remains for the motion
      assert.ok(Math.max(...extent) < 0.9 && Math.max(...extent) > 0.8, `${name} ${width} x ${height}: ${extent}`);
    }
  }
});

test("a rigid link of many points is drawn as a solid", () => {
  const { body } = read("satellite");
  const bus = body.linkNames.indexOf("bus");
  assert.ok(!body.lineLinks.includes(bus));
  const corners = new Set([...body.triangles].filter((_, k) => body.triangleLinks[Math.floor(k / 3)] === bus).map((k) => body.pointNames[k]));
  // all corners except the hub, which lies in the face between the hinges
  for (const name of ["jet1", "jet2", "jet3", "jet4", "la1", "la2", "ra1", "ra2"]) assert.ok(corners.has(name), name);
});

test("the page shows the worst verdict, or that there is none", () => {
  const recording = (statuses) => new motion.Recording({ time: [0], clock: [0], statuses }, 0);
  const status = (validity, cause, worst) => ({ clock: 0, tick: 7, validity, validity_cause: cause, worst_validity: worst,
    worst_validity_tick: worst > 0 ? 3 : -1, worst_validity_cause: worst > 0 ? "spin" : "" });
  assert.match(recordedVerdict(recording([]).verdict())[1], /^no verdict, because this recording contains no STATUS/);
  assert.deepEqual(recordedVerdict(recording([status(0, "", 0)]).verdict()).slice(1), ["good throughout", "verdict good"]);
  assert.deepEqual(recordedVerdict(recording([status(0, "", 0), status(0, "", 2), status(1, "loads", 1)]).verdict()).slice(1),
    ["outside, first at tick 3: spin", "verdict outside"]);
});

test("the error is shown in metres and relative to its scale", () => {
  const { body, frame } = read("boom");
  const rows = statusRows(body, frame, { judged_tick: 1, deformation_error: 1e-6, error_scale: 1e-3, validity: 0, validity_cause: "" }, 1, null);
  assert.match(rows.find(([name]) => name === "error")[1], /off by about 1\.00e-6 m, 0\.1 % of 1\.00e-3 m/);
});

test("the amplification multiplies the displacements", () => {
  const { body, frame } = read("boom");
  const at = (factor) => motion.worldPoint(body, frame, 3, factor);
  const one = distance(at(1), at(0)), many = distance(at(50), at(0));
  assert.ok(Math.abs(many / one - 50) < 1e-6);
});

test("names, links and groups agree with the scene", () => {
  const { body } = read("satellite");
  assert.equal(body.name, "satellite");
  assert.equal(nameOf(body.pointNames, 0), "hub");
  assert.deepEqual(body.groups.map(({ name }) => name), ["left", "right"]);
  assert.equal(body.lines.length, 2 * body.lineLinks.length);
  assert.ok(body.lines.every((point) => point < body.points));
  assert.equal(nameOf([], 4), "5");
});

test("there is a load for each published link", () => {
  for (const name of scenes) {
    const { body, loads } = read(name);
    assert.equal(loads.values.length, body.publishedLinks.length);
    assert.ok(loads.values.every(Number.isFinite), name);
  }
});

test("the camera projects positions like a pinhole camera", () => {
  const camera = new Camera(1);
  camera.yaw = 0;
  camera.pitch = 0;
  camera.distance = 10;
  const matrix = camera.matrix(800, 600);
  // the view is from +x, with y to the right and z up
  const focal = 300 / Math.tan(Camera.ANGLE / 2);
  const close = (a, b) => assert.ok(distance(a.slice(0, 2), b) < 1e-9 * 1000, `${a} ${b}`);
  close(project(matrix, [0, 0, 0], 800, 600), [400, 300]);
  close(project(matrix, [0, 1, 0], 800, 600), [400 + focal / 10, 300]);
  close(project(matrix, [2, 0, 1], 800, 600), [400, 300 - focal / 8]);
  assert.ok(project(matrix, [11, 0, 0], 800, 600)[2] < 0, "behind the eye");
  const rotated = multiply(matrix, rigid(motion.rotation([Math.SQRT1_2, 0, 0, Math.SQRT1_2]), [0, 0, 0]));
  close(project(rotated, [1, 0, 0], 800, 600), [400 + focal / 10, 300]); // rotates x to y
});

test("a push acts on the point under the mouse, along the drag", () => {
  const { body, frame } = read("boom");
  const camera = new Camera(body.size), matrix = camera.matrix(800, 600);
  const target = frame.position;
  for (const point of body.pushable) {
    const position = motion.worldPoint(body, frame, point, 1).map((x, axis) => x - target[axis]);
    const [x, y] = project(matrix, position, 800, 600);
    assert.equal(pick(body, frame, 1, target, matrix, 800, 600, x + 3, y - 2), point);
  }
  assert.equal(pick(body, frame, 1, target, matrix, 800, 600, 1, 1), null);
  const force = forceOf(camera, 50, 0, 8);
  assert.ok(Math.abs(Math.hypot(...force) - 4) < 1e-12);
  const { right } = camera.axes();
  assert.ok(Math.abs(force.reduce((sum, x, k) => sum + x * right[k], 0) - 4) < 1e-12);
  assert.ok(firstForce(body) > 0);
});

test("the amplification changes in discrete steps with hysteresis", () => {
  const amplifier = new motion.Amplifier(1);
  assert.equal(amplifier.take(1e-4, 0.02), 200);
  assert.equal(amplifier.take(0.9e-4, 0.02), 200);
  assert.equal(amplifier.take(3e-4, 0.02), 100);
  for (let k = 0; k < 100; ++k) assert.equal(amplifier.take(2.5e-4, 0.02), 100);
  assert.equal(new motion.Amplifier(1).take(0, 0.02), 1);
  assert.deepEqual([0.7, 1, 3, 60, 5e-4].map(motion.niceBelow), [0.5, 1, 2, 50, 5e-4]);
});

test("a recording is interpolated between its frames", () => {
  const s = Math.SQRT1_2;
  const recording = new motion.Recording({
    clock: Float64Array.of(1, 2, 4), tick: Float64Array.of(10, 20, 40), time: Float64Array.of(1, 2, 4),
    position: Float64Array.of(0, 0, 0, 1, 0, 0, 3, 0, 0), attitude: Float64Array.of(1, 0, 0, 0, -s, 0, 0, -s, 1, 0, 0, 0),
    spin: new Float64Array(9), q: Float32Array.of(0, 1, 2, 3, 4, 5), loadClock: Float64Array.of(1, 3),
    loads: Float32Array.of(7, 8), linksPerTick: 1, statuses: [{ clock: 0.5, tick: 5 }, { clock: 2.5, tick: 25 }],
  }, 2);
  assert.deepEqual(recording.at(3).position, [2, 0, 0]);
  assert.deepEqual([...recording.at(1.5).q], [1, 2]);
  // the attitude is interpolated by the smaller angle between the quaternions
  const half = recording.at(1.5).attitude;
  assert.ok(distance(half, [Math.cos(Math.PI / 8), 0, 0, Math.sin(Math.PI / 8)]) < 1e-12);
  assert.equal(recording.at(99).tick, 40);
  assert.equal(recording.at(-1).tick, 10);
  assert.deepEqual([2.9, 3.1].map((t) => recording.loads(t)[0]), [7, 8]);
  assert.deepEqual([2.4, 2.6].map((t) => recording.status(t).tick), [5, 25]);
});

test("bytes that are not data of freeflex are refused", () => {
  assert.throws(() => parseBlob(new ArrayBuffer(4)), /not data of freeflex/);
  assert.throws(() => parseBlob(new TextEncoder().encode("<html>").buffer), /not data of freeflex/);
  assert.equal(parseMessage(new ArrayBuffer(16)), null);
  assert.deepEqual([...new Uint8Array(fromBase64("AAH/"))], [0, 1, 255]);
});

test("the scripts are short and load nothing from other addresses", () => {
  let lines = 0;
  for (const name of readdirSync(source)) {
    const text = readFileSync(join(source, name), "utf8");
    assert.ok(!/https?:\/\/(?!127\.0\.0\.1)/.test(text), name);
    if (name.endsWith(".js")) lines += text.split("\n").length;
  }
  assert.ok(lines < 3000, `${lines} lines`);
});
