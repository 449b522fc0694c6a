"use strict";
// Connection to the server: a websocket that reconnects.

(() => {
  const FIRST_WAIT = 500; // milliseconds
  const LONGEST_WAIT = 8000;

  // `handlers` has a function for each kind of message: hello, catalogue, setting, scene, state,
  // event, frame; and opened and closed.
  Phasmid.connection = (handlers) => {
    const waiting = new Map();
    let socket = null;
    let number = 0;
    let wait = FIRST_WAIT;

    function open() {
      const scheme = location.protocol === "https:" ? "wss" : "ws";
      socket = new WebSocket(`${scheme}://${location.host}/live`);
      socket.binaryType = "arraybuffer";
      socket.addEventListener("message", ({ data }) => {
        if (typeof data === "string") handle(JSON.parse(data));
        else handlers.frame(new Float32Array(data));
      });
      socket.addEventListener("close", closed);
    }

    function handle(message) {
      if ("reply" in message) {
        const resolve = waiting.get(message.reply);
        waiting.delete(message.reply);
        if (resolve) resolve(message);
        else if (message.status >= 400) handlers.event({ text: Phasmid.refusal(message) });
        return;
      }
      if ("hello" in message) {
        wait = FIRST_WAIT;
        handlers.opened();
      }
      for (const [kind, value] of Object.entries(message)) handlers[kind]?.(value);
    }

    function closed() {
      const lost = [...waiting.values()];
      waiting.clear();
      for (const resolve of lost) resolve({ status: 0, text: "The connection was lost before an answer came." });
      handlers.closed(wait);
      setTimeout(open, wait * (0.8 + 0.4 * Math.random()));
      wait = Math.min(2 * wait, LONGEST_WAIT);
    }

    const isOpen = () => socket !== null && socket.readyState === WebSocket.OPEN;

    // Send a request; resolves to status and answer, or to text and hint of a refusal.
    function request(message) {
      if (!isOpen()) return Promise.resolve({ status: 0, text: "There is no connection to the robot." });
      number += 1;
      socket.send(JSON.stringify({ id: number, ...message }));
      return new Promise((resolve) => waiting.set(number, resolve));
    }

    // Send without a reply, unless much waits to be sent already.
    function notify(message) {
      if (isOpen() && socket.bufferedAmount < 65536) socket.send(JSON.stringify(message));
    }

    open();
    return { request, notify };
  };

  Phasmid.refusal = (reply) => (reply.hint ? `${reply.text} Try: ${reply.hint}` : reply.text || "It was refused.");
})();
