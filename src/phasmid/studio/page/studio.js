"use strict";
// The studio: what comes from the robot goes to the parts of the page, and back.

(() => {
  const PLOTS_EVERY = 80; // milliseconds
  const STRIP_EVERY = 125;
  const MOST_EVENTS = 100;
  const byId = (id) => document.getElementById(id);
  const { made } = Phasmid;

  const frames = Phasmid.frames();
  const view = Phasmid.view(byId("view"), frames);
  const strip = Phasmid.strip(byId("strip"), frames, view);
  const plots = Phasmid.plots(byId("plots"), frames);
  let scene = null;
  let setting = {};
  let state = { playing: true, pace: 1, recording: null };
  let benched = false;

  const connection = Phasmid.connection({
    opened, closed, frame,
    catalogue: (catalogue) => controls.catalogue(catalogue),
    setting: showSetting,
    scene: begin,
    state: showState,
    event: showEvent,
  });
  const controls = Phasmid.controls(byId("fields"), connection.request);
  const actions = Phasmid.actions(connection.request);
  Phasmid.input(connection.notify, { halt, pause, reset });

  // ---------------------------------------------------------------- what comes

  function opened() {
    byId("banner").hidden = true;
    document.body.classList.remove("lost");
    // Who was away may find another robot.
    frames.forget();
    plots.forget();
  }

  function closed(wait) {
    document.body.classList.add("lost");
    byId("banner-title").textContent = "The connection to the robot is lost.";
    byId("banner-text").textContent =
      `It is tried again ${wait < 1000 ? "at once" : `in ${Math.round(wait / 1000)} s`}. ` +
      "If phasmid studio was ended, start it again and open the address that it prints.";
    byId("banner").hidden = false;
  }

  function begin(newScene) {
    scene = newScene;
    frames.begin(scene);
    view.begin(scene);
    plots.begin(scene);
    actions.begin(scene);
    byId("legend").replaceChildren(...scene.names.map((name, leg) => {
      const chip = made("span", { className: "chip" });
      chip.style.background = scene.legs[leg];
      return made("li", { title: name }, chip, String(leg + 1));
    }));
    benched = false;
    mountBench();
  }

  function frame(row) {
    if (!frames.take(row)) return;
    byId("waiting").hidden = true;
    plots.take();
    view.requestPaint();
    requestPlots();
  }

  const text = (value) => String(value ?? "").replaceAll("-", " ");
  function showSetting(newSetting) {
    setting = newSetting;
    controls.show(setting);
    byId("what").textContent = [setting.robot, setting.gait && `${text(setting.gait)} gait`, setting.terrain && `ground: ${text(setting.terrain)}`]
      .filter(Boolean).join(" · ");
  }

  function showState(newState) {
    state = newState;
    actions.legs(state.lost, state.dead, state.needed);
    byId("play").textContent = state.playing ? "Pause" : "Play";
    const pace = byId("pace");
    if (![...pace.options].some(({ value }) => Number(value) === state.pace))
      pace.append(new Option(`${state.pace}×`, String(state.pace)));
    pace.value = [...pace.options].find(({ value }) => Number(value) === state.pace).value;
    const record = byId("record");
    record.setAttribute("aria-pressed", String(Boolean(state.recording)));
    byId("record-words").textContent = state.recording ? "Stop and save run" : "Record";
    showVerdict(state.servos);
    const status = byId("status");
    const words = state.playing ? state.sentence || `The robot ${state.status}.` : "Paused.";
    if (status.textContent !== words) status.textContent = words;
    status.dataset.status = state.playing ? state.status || "" : "paused";
  }

  let verdictLines = "";
  function showVerdict(verdict) {
    byId("verdict").hidden = !verdict;
    const text = (verdict?.lines || []).join("\n");
    if (text === verdictLines) return;
    verdictLines = text;
    byId("verdict").dataset.grade = verdict?.grade || "";
    byId("verdict-answer").textContent = verdict?.answer || "";
    byId("verdict-lines").replaceChildren(...(verdict?.lines || []).map((line) => made("p", { textContent: line })));
  }

  // Refusals of a stick that is held are shown at most every five seconds.
  let lastWords = "";
  let lastShown = 0;
  function showEvent({ time, text: words, run }) {
    const now = performance.now();
    if (words === lastWords && now - lastShown < 5000) return;
    [lastWords, lastShown] = [words, now];
    const item = made("li");
    if (Number.isFinite(time)) item.append(made("span", { className: "time", textContent: `${time.toFixed(2)} s` }), " ");
    item.append(made("span", { textContent: words }));
    if (/^r-[0-9a-z]{1,16}$/.test(run || ""))
      item.append(" ", made("a", { href: `/runs/${run}/report.html`, target: "_blank", rel: "noopener", textContent: "Open its report" }));
    const list = byId("event-list");
    list.prepend(item);
    while (list.children.length > MOST_EVENTS) list.lastChild.remove();
    byId("no-event").hidden = true;
    byId("toast").replaceChildren(...[...item.childNodes].map((node) => node.cloneNode(true)));
    byId("toast").hidden = false;
    clearTimeout(toasted);
    toasted = setTimeout(() => (byId("toast").hidden = true), run ? 20000 : 6000);
  }
  let toasted = 0;

  // ---------------------------------------------------------------- what goes

  function command(message) {
    connection.request(message).then((reply) => {
      if (reply.status !== 200) showEvent({ text: Phasmid.refusal(reply) });
    });
  }

  // A robot that walks by itself or by its plan does not look at the stick.
  function halt() {
    if (setting.walks === "by itself") command({ do: "change", name: "walks", value: "by hand" });
    if (setting.walks === "the plan" && state.playing) pause();
  }

  function pause() {
    command({ do: "play", how: state.playing ? "pause" : "play" });
  }

  function reset() {
    command({ do: "play", how: "reset" });
  }

  byId("play").addEventListener("click", pause);
  byId("step").addEventListener("click", () => command({ do: "play", how: "step" }));
  byId("reset").addEventListener("click", reset);
  byId("pace").addEventListener("change", ({ target }) => command({ do: "pace", factor: Number(target.value) }));
  byId("record").addEventListener("click", () => command({ do: "record", on: !state.recording }));
  byId("explain").addEventListener("change", ({ target }) => document.body.classList.toggle("explains", target.checked));

  // ---------------------------------------------------------------- tabs

  const tabs = [...document.querySelectorAll("[role=tab]")];
  function choose(tab) {
    for (const one of tabs) {
      const chosen = one === tab;
      one.setAttribute("aria-selected", String(chosen));
      one.tabIndex = chosen ? 0 : -1;
      byId(one.getAttribute("aria-controls")).hidden = !chosen;
    }
    document.body.dataset.tab = tab.getAttribute("aria-controls");
    mountBench();
    plots.paint();
  }
  tabs.forEach((tab, k) => {
    tab.addEventListener("click", () => choose(tab));
    tab.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!step) return;
      event.preventDefault();
      const next = tabs[(k + step + tabs.length) % tabs.length];
      choose(next);
      next.focus();
    });
  });

  // The bench is costly, and mounted only where it is visible.
  function mountBench() {
    const section = byId("bench");
    if (benched || section.hidden || !scene || !window.phasmidBench) return;
    benched = true;
    window.phasmidBench.mount(section, { request: connection.request, legs: scene.names });
  }

  // ---------------------------------------------------------------- clocks

  let plotted = 0;
  let late = 0;
  let due = false;
  // No frame is requested without data: a browser without a graphics card has no time for that.
  function requestPlots() {
    clearTimeout(late);
    const wait = plotted + PLOTS_EVERY - performance.now();
    if (wait > 0) late = setTimeout(requestPlots, wait);
    else if (!due) {
      due = true;
      requestAnimationFrame(() => {
        due = false;
        plotted = performance.now();
        plots.paint();
      });
    }
  }

  setInterval(() => {
    strip.update();
    if (!frames.latest) return;
    const recorded = state.recording ? ` · recording ${state.recording.seconds} s` : "";
    // A single step is shorter than a hundredth of a second.
    const digits = state.playing ? 2 : 3;
    byId("clock").textContent = `${frames.value("time").toFixed(digits)} s${recorded}`;
  }, STRIP_EVERY);
})();
