// The arithmetic of the page beside the program's read-out. Run by node: FREEFLEX_PAGE is the folder of its sources,
// FREEFLEX_FIXTURE that of view_fixture.
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

test("points are where the read-out says, to 1e-6 of the size and of the displacement", () => {
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

test("the rms over the mass is that of the points", () => {
  const { body, frame } = read("truss104");
  let sum = 0, mass = 0;
  for (let point = 0; point < body.points; ++point) {
    sum += body.masses[point] * Math.hypot(...motion.displacement(body, frame.q, point)) ** 2;
    mass += body.masses[point];
  }
  assert.ok(Math.abs(Math.sqrt(sum / mass) / motion.rms(frame.q) - 1) < 1e-5);
});

test("an amplified displacement is so many times as large", () => {
  const { body, frame } = read("boom");
  const at = (factor) => motion.worldPoint(body, frame, 3, factor);
  const one = distance(at(1), at(0)), many = distance(at(50), at(0));
  assert.ok(Math.abs(many / one - 50) < 1e-6);
});

test("names, links and groups are those of the scene", () => {
  const { body } = read("satellite");
  assert.equal(body.name, "satellite");
  assert.equal(nameOf(body.pointNames, 0), "hub");
  assert.deepEqual(body.groups.map(({ name }) => name), ["left", "right"]);
  assert.equal(body.lines.length, 2 * body.lineLinks.length);
  assert.ok(body.lines.every((point) => point < body.points));
  assert.equal(nameOf([], 4), "5");
});

test("loads have a figure for each published link", () => {
  for (const name of scenes) {
    const { body, loads } = read(name);
    assert.equal(loads.values.length, body.publishedLinks.length);
    assert.ok(loads.values.every(Number.isFinite), name);
  }
});

test("the camera sees a place where a pinhole would", () => {
  const camera = new Camera(1);
  camera.yaw = 0;
  camera.pitch = 0;
  camera.distance = 10;
  const matrix = camera.matrix(800, 600);
  // from +x: y to the right, z up
  const focal = 300 / Math.tan(Camera.ANGLE / 2);
  const close = (a, b) => assert.ok(distance(a.slice(0, 2), b) < 1e-9 * 1000, `${a} ${b}`);
  close(project(matrix, [0, 0, 0], 800, 600), [400, 300]);
  close(project(matrix, [0, 1, 0], 800, 600), [400 + focal / 10, 300]);
  close(project(matrix, [2, 0, 1], 800, 600), [400, 300 - focal / 8]);
  assert.ok(project(matrix, [11, 0, 0], 800, 600)[2] < 0, "behind the eye");
  const turned = multiply(matrix, rigid(motion.rotation([Math.SQRT1_2, 0, 0, Math.SQRT1_2]), [0, 0, 0]));
  close(project(turned, [1, 0, 0], 800, 600), [400 + focal / 10, 300]); // x to y
});

test("a push is of the point under the mouse, along the drag", () => {
  const { body, frame } = read("boom");
  const camera = new Camera(body.size), matrix = camera.matrix(800, 600);
  const target = frame.position;
  for (const point of body.pushable) {
    const place = motion.worldPoint(body, frame, point, 1).map((x, axis) => x - target[axis]);
    const [x, y] = project(matrix, place, 800, 600);
    assert.equal(pick(body, frame, 1, target, matrix, 800, 600, x + 3, y - 2), point);
  }
  assert.equal(pick(body, frame, 1, target, matrix, 800, 600, 1, 1), null);
  const force = forceOf(camera, 50, 0, 8);
  assert.ok(Math.abs(Math.hypot(...force) - 4) < 1e-12);
  const { right } = camera.axes();
  assert.ok(Math.abs(force.reduce((sum, x, k) => sum + x * right[k], 0) - 4) < 1e-12);
  assert.ok(firstForce(body) > 0);
});

test("the amplification goes by whole steps and does not flicker", () => {
  const amplifier = new motion.Amplifier(1);
  assert.equal(amplifier.take(1e-4, 0.02), 200);
  assert.equal(amplifier.take(0.9e-4, 0.02), 200);
  assert.equal(amplifier.take(3e-4, 0.02), 100);
  for (let k = 0; k < 100; ++k) assert.equal(amplifier.take(2.5e-4, 0.02), 100);
  assert.equal(new motion.Amplifier(1).take(0, 0.02), 1);
  assert.deepEqual([0.7, 1, 3, 60, 5e-4].map(motion.niceBelow), [0.5, 1, 2, 50, 5e-4]);
});

test("a recording is read between its frames", () => {
  const s = Math.SQRT1_2;
  const recording = new motion.Recording({
    clock: Float64Array.of(1, 2, 4), tick: Float64Array.of(10, 20, 40), time: Float64Array.of(1, 2, 4),
    position: Float64Array.of(0, 0, 0, 1, 0, 0, 3, 0, 0), attitude: Float64Array.of(1, 0, 0, 0, -s, 0, 0, -s, 1, 0, 0, 0),
    spin: new Float64Array(9), q: Float32Array.of(0, 1, 2, 3, 4, 5), loadClock: Float64Array.of(1, 3),
    loads: Float32Array.of(7, 8), linksPerTick: 1, statuses: [{ clock: 0.5, tick: 5 }, { clock: 2.5, tick: 25 }],
  }, 2);
  assert.deepEqual(recording.at(3).position, [2, 0, 0]);
  assert.deepEqual([...recording.at(1.5).q], [1, 2]);
  // the shorter way from one quaternion to the other
  const half = recording.at(1.5).attitude;
  assert.ok(distance(half, [Math.cos(Math.PI / 8), 0, 0, Math.sin(Math.PI / 8)]) < 1e-12);
  assert.equal(recording.at(99).tick, 40);
  assert.equal(recording.at(-1).tick, 10);
  assert.deepEqual([2.9, 3.1].map((t) => recording.loads(t)[0]), [7, 8]);
  assert.deepEqual([2.4, 2.6].map((t) => recording.status(t).tick), [5, 25]);
});

test("what is no data is refused", () => {
  assert.throws(() => parseBlob(new ArrayBuffer(4)), /no data of freeflex/);
  assert.throws(() => parseBlob(new TextEncoder().encode("<html>").buffer), /no data of freeflex/);
  assert.equal(parseMessage(new ArrayBuffer(16)), null);
  assert.deepEqual([...new Uint8Array(fromBase64("AAH/"))], [0, 1, 255]);
});

test("the scripts are short enough to be read, and load nothing from elsewhere", () => {
  let lines = 0;
  for (const name of readdirSync(source)) {
    const text = readFileSync(join(source, name), "utf8");
    assert.ok(!/https?:\/\/(?!127\.0\.0\.1)/.test(text), name);
    if (name.endsWith(".js")) lines += text.split("\n").length;
  }
  assert.ok(lines < 3000, `${lines} lines`);
});
