// Sources of frames: a daemon, through the program's socket, or a recording.
import { parseMessage } from "./blob.js";
import { Recording } from "./motion.js";

/** Receives frames of a daemon. Calls the functions of `on`: state(frame), loads(values), text(message), closed(). */
export class Live {
  constructor(url, on) {
    this.on = on;
    this.frame = null;
    this.isOpen = false;
    this.url = url;
    this.open();
  }
  open() {
    this.socket = new WebSocket(this.url);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => { this.isOpen = true; };
    this.socket.onmessage = ({ data }) => this.take(data);
    this.socket.onclose = () => {
      this.isOpen = false;
      this.on.closed();
      setTimeout(() => this.open(), 1000);
    };
  }
  take(data) {
    if (typeof data === "string") return this.on.text(JSON.parse(data));
    const message = parseMessage(data);
    if (message?.kind === "state") {
      this.frame = message;
      return this.on.state(message);
    }
    return message ? this.on.loads(message.values) : null;
  }
  send(message) {
    if (this.isOpen) this.socket.send(JSON.stringify(message));
  }
}

/** Plays a recording. */
export class Player {
  constructor(motion, modes) {
    this.recording = new Recording(motion, modes);
    this.time = this.recording.begin;
    this.speed = 1;
    this.isPlaying = true;
  }
  advance(dt) {
    if (!this.isPlaying) return;
    const { begin, end } = this.recording;
    this.time += dt * this.speed;
    if (this.time > end) this.time = begin;
  }
  frame() {
    return this.recording.at(this.time);
  }
}
