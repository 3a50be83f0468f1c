// Controls headless Chromium by its debugging protocol over a pipe.
import { spawn } from "node:child_process";
import { existsSync } from "node:fs";

/** Holds the path of the browser, or null if there is none. */
export const chromium = ["/usr/bin/chromium", "/usr/bin/chromium-browser"].find(existsSync) ?? null;

export class Browser {
  /** If `isGroup`, its processes form their own group, so that a signal reaches all of them. */
  constructor(folder, isGroup = false) {
    this.process = spawn(chromium, ["--headless=new", "--no-sandbox", "--remote-debugging-pipe", "--use-angle=swiftshader",
      "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-first-run", "--window-size=1280,800",
      `--user-data-dir=${folder}`, "about:blank"], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"], detached: isGroup });
    this.waiting = new Map();
    this.number = 0;
    this.complaints = [];
    let rest = "";
    this.process.stdio[4].setEncoding("utf8").on("data", (text) => {
      const parts = (rest + text).split("\0");
      rest = parts.pop();
      for (const part of parts) this.take(JSON.parse(part));
    });
  }
  take({ id, result, error, method, params }) {
    if (id !== undefined) {
      const { resolve, reject } = this.waiting.get(id);
      this.waiting.delete(id);
      return error ? reject(new Error(error.message)) : resolve(result);
    }
    if (method === "Runtime.exceptionThrown") this.complaints.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    if (method === "Log.entryAdded" && params.entry.level === "error") this.complaints.push(params.entry.text);
    return null;
  }
  send(method, params = {}, sessionId = this.session) {
    const id = ++this.number;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.process.stdio[3].write(JSON.stringify({ id, method, params, sessionId }) + "\0");
    });
  }
  /** Opens a page in a new tab; the methods below then apply to this page. */
  async open(url) {
    const { targetId } = await this.send("Target.createTarget", { url: "about:blank" }, undefined);
    const { sessionId } = await this.send("Target.attachToTarget", { targetId, flatten: true }, undefined);
    this.session = sessionId;
    for (const domain of ["Runtime", "Log", "Page"]) await this.send(`${domain}.enable`);
    await this.send("Page.navigate", { url });
    return sessionId;
  }
  /** Returns the value of an expression in the page. */
  async value(expression) {
    const { result, exceptionDetails } = await this.send("Runtime.evaluate", { expression, returnByValue: true, awaitPromise: true });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }
  /** Waits until an expression holds. Throws an error with the page's notice if it does not in time. */
  async until(expression, seconds = 20) {
    const end = Date.now() + 1000 * seconds;
    while (Date.now() < end) {
      if (await this.value(expression).catch(() => false)) return;
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
    throw new Error(`not within ${seconds} s: ${expression}; the page says: ` +
      (await this.value("document.getElementById('notice')?.textContent")) + "; " + this.complaints.join("; "));
  }
  async mouse(type, x, y, buttons = 1) {
    await this.send("Input.dispatchMouseEvent", { type, x, y, button: "left", buttons, clickCount: 1 });
  }
  /** Returns a screenshot as PNG bytes. */
  async picture() {
    const { data } = await this.send("Page.captureScreenshot", { format: "png" });
    return Buffer.from(data, "base64");
  }
  close() {
    this.process.kill("SIGKILL");
  }
}
