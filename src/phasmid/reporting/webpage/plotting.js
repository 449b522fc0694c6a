"use strict";
// Canvases, lines, round steps and numbers of the plots of pages.

(() => {
  // A canvas cleared for drawing in pixels of the page, and its size in them.
  function prepared(canvas, font) {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [wide, high] = [canvas.clientWidth, canvas.clientHeight];
    const dots = [wide, high].map((length) => Math.round(length * ratio));
    if (canvas.width !== dots[0] || canvas.height !== dots[1]) [canvas.width, canvas.height] = dots;
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, wide, high);
    context.font = `${font} system-ui, sans-serif`;
    return { context, wide, high };
  }

  function line(context, x0, y0, x1, y1) {
    context.beginPath();
    context.moveTo(x0, y0);
    context.lineTo(x1, y1);
    context.stroke();
  }

  // The least of 1, 2, 5, 10, 20, ... that is not below a positive value.
  function roundStep(value) {
    const ten = 10 ** Math.floor(Math.log10(value));
    return [1, 2, 5, 10].map((k) => k * ten).find((k) => k >= 0.999999 * value);
  }

  function text(value, digits = 3) {
    return Number.isFinite(value) ? String(Number(value.toPrecision(digits))).replace("-", "−") : "–";
  }

  // A colour of the page's style sheet.
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  Phasmid.plotting = { prepared, line, roundStep, text, colour };
})();
