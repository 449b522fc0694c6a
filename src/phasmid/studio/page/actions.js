"use strict";
// Pushes, lost legs, and what is kept and loaded.

(() => {
  const LARGEST = 7_000_000; // bytes of a file; a message holds 10 MB of its text
  const byId = (id) => document.getElementById(id);
  const { made } = Phasmid;

  function download(name, text) {
    const link = made("a", { href: URL.createObjectURL(new Blob([text], { type: "application/toml" })), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  }

  function base64(bytes) {
    let letters = "";
    for (let k = 0; k < bytes.length; k += 32768) letters += String.fromCharCode(...bytes.subarray(k, k + 32768));
    return btoa(letters);
  }

  Phasmid.actions = (request) => {
    let scene = null;
    let limbs = [];

    // Send a request; a refusal is shown beside its control.
    async function perform(message, place) {
      const reply = await request(message);
      place.textContent = reply.status === 200 ? "" : Phasmid.refusal(reply);
      return reply.status === 200 ? reply.answer || {} : null;
    }

    // ---------------------------------------------------------------- disturb

    const strength = byId("push-strength");
    const showStrength = () => (byId("push-value").textContent = `${Number(strength.value).toPrecision(2)} N·s`);
    strength.addEventListener("input", showStrength);
    for (const button of document.querySelectorAll("[data-push]"))
      button.addEventListener("click", () => {
        const [ahead, left] = button.dataset.push.split(" ").map((way) => Number(way) * Number(strength.value));
        perform({ do: "push", impulse: [ahead, left, 0] }, byId("disturb-refused"));
      });

    function begin(newScene) {
      const same = scene && scene.names.join("\n") === newScene.names.join("\n") && scene.weight === newScene.weight;
      scene = newScene;
      if (same) return;
      // A push of half the robot's mass times a metre a second throws it over.
      const most = Number(((0.5 * scene.weight) / 9.81).toPrecision(1));
      strength.max = String(most);
      strength.min = strength.step = String(most / 20);
      strength.value = String(most / 4);
      showStrength();
      limbs = scene.names.map(() => "walks");
      buildLegs();
    }

    function buildLegs() {
      const buttons = scene.names.map((name, leg) => {
        const button = made("button", { type: "button", className: "leg" });
        const chip = made("span", { className: "chip" });
        chip.style.background = scene.legs[leg];
        button.append(chip, made("span", { className: "name", textContent: `${leg + 1} ${name.replaceAll("_", " ")}` }), made("span", { className: "how" }));
        button.addEventListener("click", () => press(leg));
        return button;
      });
      // By the places of their hips: x points ahead, y to the left.
      const column = (isLeft) => made("div", {}, ...[...buttons.keys()].filter((leg) => scene.hips[leg][1] >= 0 === isLeft)
        .sort((a, b) => scene.hips[b][0] - scene.hips[a][0]).map((leg) => buttons[leg]));
      byId("legs").replaceChildren(column(true), made("span", { className: "trunk", ariaHidden: "true" }), column(false));
      showLegs(buttons);
    }

    const WORDS = { walks: "", lost: "lost", limp: "limp" };
    let needed = [];
    function showLegs(buttons = [...document.querySelectorAll("#legs .leg")]) {
      for (const button of buttons) {
        const leg = parseInt(button.querySelector(".name").textContent, 10) - 1;
        const state = limbs[leg];
        const stays = needed.includes(leg + 1);
        button.classList.toggle("off", state !== "walks" && !stays);
        button.querySelector(".how").textContent = stays ? `${WORDS[state]}, needed` : WORDS[state];
        const how = state === "walks" ? "" : state === "lost" ? "Press to give it back" : "Reset gives it back";
        button.title = stays ? `It stays on the ground: without it the robot falls. ${how}` : how;
      }
    }

    function press(leg) {
      const how = limbs[leg] === "walks" ? byId("leg-how").value : "restore";
      perform({ do: "limb", leg: leg + 1, how }, byId("disturb-refused"));
    }

    // ---------------------------------------------------------------- keep

    byId("save-scenario").addEventListener("click", async () => {
      const answer = await perform({ do: "keep" }, byId("keep-refused"));
      for (const file of answer ? [answer, answer.robot] : []) if (file) download(file.name, file.text);
    });

    // ---------------------------------------------------------------- load

    for (const what of ["terrain", "scenario"])
      byId(`load-${what}`).addEventListener("change", async ({ target }) => {
        const file = target.files[0];
        if (!file) return;
        const refused = byId("keep-refused");
        byId("keep-status").textContent = "";
        if (file.size > LARGEST) {
          refused.textContent = `${file.name} is ${(file.size / 1e6).toFixed(1)} MB; it must be at most ${LARGEST / 1e6} MB.`;
        } else {
          const content = base64(new Uint8Array(await file.arrayBuffer()));
          const answer = await perform({ do: "load", what, name: file.name, content }, refused);
          if (answer) byId("keep-status").textContent = `${file.name} is loaded.`;
        }
        target.value = "";
      });

    return {
      begin,
      // Numbers of the legs that are lost, of those whose servos died, and of those of both that the robot stands on.
      legs(lost, dead, newNeeded) {
        needed = newNeeded;
        limbs = limbs.map((_, leg) => (dead.includes(leg + 1) ? "limp" : lost.includes(leg + 1) ? "lost" : "walks"));
        showLegs();
      },
    };
  };
})();
