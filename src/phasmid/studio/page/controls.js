"use strict";
// Controls made from the catalogue: choices, ranges and switches, each with the reply of the server
// of its last change.

(() => {
  const made = (tag, parts = {}, ...children) => {
    const element = Object.assign(document.createElement(tag), parts);
    element.append(...children);
    return element;
  };

  function digits(step) {
    return step > 0 ? Math.max(0, Math.ceil(-Math.log10(step) - 1e-9)) : 2;
  }

  const INPUTS = {
    choice(id, changed) {
      const select = made("select", { id });
      select.addEventListener("change", () => changed(select.value));
      return {
        parts: [select],
        held: () => false,
        shape({ choices }) {
          const old = [...select.options].map(({ value }) => value);
          if (old.join("\n") !== choices.join("\n")) select.replaceChildren(...choices.map((word) => new Option(word)));
        },
        show(value) {
          select.disabled = value === undefined || value === null;
          select.value = String(value);
        },
      };
    },

    switch(id, changed) {
      const box = made("input", { id, type: "checkbox" });
      box.addEventListener("change", () => changed(box.checked));
      return {
        parts: [box],
        held: () => false,
        shape() {},
        show(value) {
          box.disabled = typeof value !== "boolean";
          box.checked = value === true;
        },
      };
    },

    range(id, changed) {
      const slider = made("input", { id, type: "range" });
      const number = made("input", { id: `${id}-number`, type: "number", step: "any" });
      const unit = made("span", { className: "unit" });
      let places = 0;
      let grid = 0; // between values that the slider gives
      let down = false;
      const onGrid = (value) => grid > 0 && Math.abs(value / grid - Math.round(value / grid)) < 1e-6;
      // All digits of a value that was typed.
      const text = (value) => (onGrid(value) ? value.toFixed(places) : String(Number(value.toPrecision(6))));
      function chosen() {
        const value = Number(slider.value);
        if (!(grid > 0)) return value;
        const near = Number((Math.round(value / grid) * grid).toFixed(9));
        return Math.min(Math.max(near, Number(slider.min)), Number(slider.max));
      }
      slider.addEventListener("pointerdown", () => (down = true));
      for (const name of ["pointerup", "pointercancel"]) slider.addEventListener(name, () => (down = false));
      slider.addEventListener("input", () => {
        number.value = text(chosen());
        changed(chosen());
      });
      slider.addEventListener("change", () => changed(chosen()));
      number.addEventListener("change", () => {
        slider.value = number.value;
        if (number.value !== "") changed(Number(number.value));
      });
      return {
        parts: [made("div", { className: "range" }, slider, number, unit)],
        held: () => down || document.activeElement === number,
        shape(field) {
          places = digits(field.step);
          grid = field.step;
          slider.min = String(field.least);
          slider.max = String(field.most);
          unit.textContent = field.unit || "";
          number.setAttribute("aria-label", `${field.label} in ${field.unit || "numbers"}`);
        },
        show(value) {
          const none = typeof value !== "number";
          slider.disabled = number.disabled = none;
          // Between two values of the grid the slider stands at the value of the number field.
          slider.step = none || onGrid(value) ? String(grid || "any") : "any";
          slider.value = none ? slider.min : String(value);
          number.value = none ? "" : text(value);
          slider.setAttribute("aria-valuetext", none ? "none" : `${text(value)} ${unit.textContent}`);
        },
      };
    },
  };

  function row(field, request) {
    const id = `field-${field.name}`;
    const label = made("label", { htmlFor: id });
    const help = made("p", { className: "help", id: `${id}-help` });
    const refused = made("p", { className: "refused" });
    refused.setAttribute("role", "alert");
    let value;
    let wanted;
    let busy = false;
    const input = INPUTS[field.kind](id, (newValue) => {
      wanted = newValue;
      if (!busy) send();
    });
    const element = made("div", { className: `field ${field.kind}` }, label, ...input.parts, help, refused);
    input.parts.forEach((part) => {
      const inputs = part.matches("input, select") ? [part] : part.querySelectorAll("input");
      inputs.forEach((one) => one.setAttribute("aria-describedby", help.id));
    });

    // One change at a time, the newest first, so that a slider never runs ahead of the robot.
    async function send() {
      busy = true;
      element.setAttribute("aria-busy", "true");
      while (wanted !== undefined) {
        const sent = wanted;
        wanted = undefined;
        const reply = await request({ do: "change", name: field.name, value: sent });
        refused.textContent = reply.status === 200 ? "" : Phasmid.refusal(reply);
      }
      busy = false;
      element.removeAttribute("aria-busy");
      if (!input.held() || refused.textContent) input.show(value);
    }

    function shape(newField) {
      field = newField;
      label.textContent = field.label;
      help.textContent = field.help || "";
      element.title = field.help || "";
      input.shape(field);
    }

    function show(newValue) {
      value = newValue;
      if (!busy && !input.held()) input.show(value);
    }

    return { element, shape, show, kind: field.kind };
  }

  Phasmid.controls = (host, request) => {
    const rows = new Map();
    const parts = new Map();
    let setting = {};

    // Controls that stay keep their place, and with it the focus.
    function catalogue(groups) {
      const fields = Object.values(groups).flat();
      for (const [name, one] of rows) {
        if (fields.some((field) => field.name === name && field.kind === one.kind)) continue;
        one.element.remove();
        rows.delete(name);
      }
      for (const [name, own] of Object.entries(groups)) {
        if (!parts.has(name)) {
          parts.set(name, made("details", { className: "group", open: true }, made("summary", { textContent: name })));
          host.append(parts.get(name));
        }
        parts.get(name).hidden = own.length === 0;
        let before = parts.get(name).firstElementChild;
        for (const field of own) {
          if (!rows.has(field.name)) rows.set(field.name, row(field, request));
          const { element, shape } = rows.get(field.name);
          shape(field);
          if (before.nextElementSibling !== element) before.after(element);
          before = element;
        }
      }
      show(setting);
    }

    function show(newSetting) {
      setting = newSetting;
      for (const [name, one] of rows) one.show(setting[name]);
    }

    return { catalogue, show };
  };

  Object.assign(Phasmid, { made, range: INPUTS.range });
})();
