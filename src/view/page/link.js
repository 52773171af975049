// The socket to the server: what comes is handed to whoever listens, and every frame is acknowledged when it is on the screen.

const listeners = new Map();
let socket = null, waiting = [], tries = 0;

export function on(type, act) {
  listeners.set(type, [...(listeners.get(type) ?? []), act]);
}

function tell(type, ...values) {
  for (const act of listeners.get(type) ?? []) act(...values);
}

export function send(message) {
  const text = JSON.stringify(message);
  if (socket?.readyState === WebSocket.OPEN) socket.send(text);
  else waiting.push(text);
}

export function connect() {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => {
    tries = 0;
    tell("open");
    waiting.splice(0).forEach((text) => socket.send(text));
  };
  socket.onmessage = async ({ data }) => {
    if (typeof data === "string") {
      const message = JSON.parse(data);
      tell(message.type, message);
      return;
    }
    const length = new DataView(data).getUint32(0, true);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    try {
      const picture = await createImageBitmap(new Blob([new Uint8Array(data, 4 + length)]), { colorSpaceConversion: "none" });
      tell("frame", head, picture);
    } finally {
      send({ type: "ack", source: head.source });
    }
  };
  socket.onclose = () => {
    waiting = [];
    tell("closed", ++tries);
    setTimeout(connect, Math.min(5000, 400 * 2 ** tries));
  };
}
