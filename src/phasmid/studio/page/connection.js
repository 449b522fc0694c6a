"use strict";
// The talk with the robot: a websocket that comes back by itself.

(() => {
  const FIRST_WAIT = 500; // milliseconds
  const LONGEST_WAIT = 8000;

  // `hears` has a function for each kind of message: hello, catalogue, setting, scene, state,
  // event, frame; and opened and closed.
  Phasmid.connection = (hears) => {
    const waiting = new Map();
    let socket = null;
    let number = 0;
    let wait = FIRST_WAIT;

    function open() {
      const scheme = location.protocol === "https:" ? "wss" : "ws";
      socket = new WebSocket(`${scheme}://${location.host}/live`);
      socket.binaryType = "arraybuffer";
      socket.addEventListener("message", ({ data }) => {
        if (typeof data === "string") hear(JSON.parse(data));
        else hears.frame(new Float32Array(data));
      });
      socket.addEventListener("close", closed);
    }

    function hear(message) {
      if ("reply" in message) {
        const answered = waiting.get(message.reply);
        waiting.delete(message.reply);
        if (answered) answered(message);
        else if (message.status >= 400) hears.event({ text: Phasmid.refusal(message) });
        return;
      }
      if ("hello" in message) {
        wait = FIRST_WAIT;
        hears.opened();
      }
      for (const [kind, value] of Object.entries(message)) hears[kind]?.(value);
    }

    function closed() {
      const lost = [...waiting.values()];
      waiting.clear();
      for (const answered of lost) answered({ status: 0, text: "The connection was lost before an answer came." });
      hears.closed(wait);
      setTimeout(open, wait * (0.8 + 0.4 * Math.random()));
      wait = Math.min(2 * wait, LONGEST_WAIT);
    }

    const isOpen = () => socket !== null && socket.readyState === WebSocket.OPEN;

    // Ask, and be answered: status, answer, and where it was refused text and hint.
    function ask(message) {
      if (!isOpen()) return Promise.resolve({ status: 0, text: "There is no connection to the robot." });
      number += 1;
      socket.send(JSON.stringify({ id: number, ...message }));
      return new Promise((answered) => waiting.set(number, answered));
    }

    // Tell, without an answer; not where much waits to be sent already.
    function tell(message) {
      if (isOpen() && socket.bufferedAmount < 65536) socket.send(JSON.stringify(message));
    }

    open();
    return { ask, tell };
  };

  Phasmid.refusal = (reply) => (reply.hint ? `${reply.text} Try: ${reply.hint}` : reply.text || "It was refused.");
})();
