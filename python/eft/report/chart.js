"use strict";
// Draws the charts of a report on canvases. Drag to zoom, and double-click to show all.
// Charts of one link group share their horizontal range.
(() => {
  const MARGIN = { left: 70, right: 14, top: 10, bottom: 42 };
  const charts = [];

  // The color of the page with that name. It depends on dark mode, except in print.
  let printing = false;
  function tint(name, color) {
    return (!printing && getComputedStyle(document.documentElement).getPropertyValue(name).trim()) || color;
  }

  function floats(id) {
    const text = atob(document.getElementById(id).textContent.trim());
    const bytes = Uint8Array.from(text, (character) => character.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  }

  // Abscissae are stored, or given by start and step.
  function abscissa(x) {
    if (typeof x === "string") {
      const values = floats(x);
      return (i) => values[i];
    }
    return (i) => x.start + i * x.step;
  }

  // As many as fit, but at least three, because fewer do not show the scale.
  function ticks(low, high, room) {
    const rough = (high - low) / Math.max(room, 1);
    const size = (k) => [1, 2, 5][((k % 3) + 3) % 3] * 10 ** Math.floor(k / 3);
    const count = (step) => Math.floor(high / step + 1e-9) - Math.ceil(low / step) + 1;
    let k = 3 * Math.floor(Math.log10(rough));
    while (size(k) < rough) k++;
    while (count(size(k)) < 3) k--;
    const step = size(k);
    const answer = [];
    for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k++) answer.push(k * step);
    return [answer, Math.max(0, Math.min(10, -Math.floor(Math.log10(step) + 1e-9)))];
  }

  function spread(low, high) {
    if (!(high > low)) return [low - (Math.abs(low) || 1) * 0.1, high + (Math.abs(high) || 1) * 0.1];
    return [low - 0.05 * (high - low), high + 0.05 * (high - low)];
  }

  class Chart {
    constructor(figure, spec) {
      this.figure = figure;
      this.spec = spec;
      this.canvas = figure.querySelector("canvas");
      this.reading = figure.querySelector("output");
      this.series = spec.series.map((s) => ({ ...s, xs: abscissa(s.x), ys: floats(s.y) }));
      this.whole = this.extent();
      this.view = null; // null shows all
      this.drag = null;
      this.listen();
      this.draw();
    }

    extent() {
      let [low, high] = [Infinity, -Infinity];
      for (const s of this.series) {
        if (this.spec.box) {
          for (let i = 0; i < s.ys.length; i++) [low, high] = [Math.min(low, s.xs(i)), Math.max(high, s.xs(i))];
        } else if (s.ys.length) {
          [low, high] = [Math.min(low, s.xs(0)), Math.max(high, s.xs(s.ys.length - 1))];
        }
      }
      return this.spec.box || !(high > low) ? spread(low, high) : [low, high];
    }

    // Vertical range of the visible data; without zoom it includes the ruled lines.
    vertical(low, high) {
      if (this.view && this.view.y) return this.view.y;
      let [bottom, top] = [Infinity, -Infinity];
      for (const s of this.series) {
        for (let i = 0; i < s.ys.length; i++) {
          const [x, y] = [s.xs(i), s.ys[i]];
          if (x >= low && x <= high) [bottom, top] = [Math.min(bottom, y), Math.max(top, y)];
        }
      }
      if (!this.view) for (const rule of this.spec.rules) [bottom, top] = [Math.min(bottom, rule.y), Math.max(top, rule.y)];
      return bottom > top ? [0, 1] : spread(bottom, top);
    }

    draw() {
      // At least twice the pixels, for sharp lines in print.
      const scale = Math.max(2, window.devicePixelRatio || 1);
      const [width, height] = [this.canvas.clientWidth || 900, this.canvas.clientHeight || 260];
      this.canvas.width = width * scale;
      this.canvas.height = height * scale;
      const pen = this.canvas.getContext("2d");
      pen.scale(scale, scale);
      const [x0, x1] = this.view ? this.view.x : this.whole;
      const [y0, y1] = this.vertical(x0, x1);
      const inner = { w: width - MARGIN.left - MARGIN.right, h: height - MARGIN.top - MARGIN.bottom };
      const px = (x) => MARGIN.left + ((x - x0) / (x1 - x0)) * inner.w;
      const py = (y) => MARGIN.top + (1 - (y - y0) / (y1 - y0)) * inner.h;
      this.map = { x0, x1, y0, y1, inner };
      this.axes(pen, px, py, width, height);
      pen.save();
      pen.beginPath();
      pen.rect(MARGIN.left, MARGIN.top, inner.w, inner.h);
      pen.clip();
      for (const rule of this.spec.rules) this.rule(pen, py(rule.y), width);
      for (const s of this.series) this.line(pen, s, px, py);
      for (const rule of this.spec.rules) this.label(pen, py(rule.y), rule.label, width);
      this.spec.marks.forEach((mark, row) => this.mark(pen, px(mark.x), mark.label, row));
      if (this.drag) this.selection(pen);
      pen.restore();
      this.drawn = (this.drawn || 0) + 1;
    }

    axes(pen, px, py, width, height) {
      const { x0, x1, y0, y1, inner } = this.map;
      pen.font = "12px system-ui, sans-serif";
      pen.fillStyle = tint("--ink", "#333");
      pen.strokeStyle = tint("--grid", "#e4e4e4");
      const [xs, xDigits] = ticks(x0, x1, inner.w / 90);
      const [ys, yDigits] = ticks(y0, y1, inner.h / 40);
      pen.beginPath();
      for (const x of xs) { pen.moveTo(px(x), MARGIN.top); pen.lineTo(px(x), MARGIN.top + inner.h); }
      for (const y of ys) { pen.moveTo(MARGIN.left, py(y)); pen.lineTo(MARGIN.left + inner.w, py(y)); }
      pen.stroke();
      pen.textAlign = "center";
      for (const x of xs) pen.fillText(x.toFixed(xDigits), px(x), height - MARGIN.bottom + 16);
      pen.fillText(this.spec.xlabel, MARGIN.left + inner.w / 2, height - 8);
      pen.textAlign = "right";
      for (const y of ys) pen.fillText(y.toFixed(yDigits), MARGIN.left - 6, py(y) + 4);
      pen.save();
      pen.translate(14, MARGIN.top + inner.h / 2);
      pen.rotate(-Math.PI / 2);
      pen.textAlign = "center";
      pen.fillText(this.spec.ylabel, 0, 0);
      pen.restore();
      pen.strokeStyle = tint("--axis", "#999");
      pen.strokeRect(MARGIN.left, MARGIN.top, inner.w, inner.h);
    }

    rule(pen, y, width) {
      pen.save();
      pen.strokeStyle = tint("--limit", "#b00020");
      pen.setLineDash([6, 4]);
      pen.beginPath();
      pen.moveTo(MARGIN.left, y);
      pen.lineTo(width, y);
      pen.stroke();
      pen.restore();
    }

    // A moment with its name on the side with more room. Several names are placed below each other.
    mark(pen, x, words, row) {
      pen.save();
      pen.strokeStyle = tint("--limit", "#b00020");
      pen.setLineDash([2, 2]);
      pen.beginPath();
      pen.moveTo(x, MARGIN.top);
      pen.lineTo(x, MARGIN.top + this.map.inner.h);
      pen.stroke();
      pen.restore();
      const left = x > MARGIN.left + this.map.inner.w / 2;
      this.words(pen, words, [left ? x - 5 : x + 5, MARGIN.top + 14 * (row + 1)], left ? "right" : "left");
    }

    label(pen, y, words, width) {
      this.words(pen, words, [width - MARGIN.right - 6, y < MARGIN.top + 16 ? y + 14 : y - 4], "right");
    }

    words(pen, words, place, align) {
      pen.save();
      // A white rim against the curves behind it.
      pen.strokeStyle = tint("--ground", "#fff");
      pen.fillStyle = tint("--limit", "#b00020");
      pen.lineWidth = 4;
      pen.lineJoin = "round";
      pen.textAlign = align;
      pen.strokeText(words, ...place);
      pen.fillText(words, ...place);
      pen.restore();
    }

    line(pen, s, px, py) {
      pen.strokeStyle = s.color;
      pen.lineWidth = s.width;
      pen.setLineDash({ dashed: [9, 5], dotted: [2, 3] }[s.dash] || []);
      pen.beginPath();
      if (s.points) return this.dots(pen, s, px, py);
      if (this.spec.box) {
        for (let i = 0; i < s.ys.length; i++) pen.lineTo(px(s.xs(i)), py(s.ys[i]));
      } else {
        this.envelope(pen, s, px, py);
      }
      pen.stroke();
    }

    dots(pen, s, px, py) {
      pen.fillStyle = s.color;
      if (s.ys.length > 500) pen.globalAlpha = 0.5;
      for (let i = 0; i < s.ys.length; i++) {
        pen.beginPath();
        pen.arc(px(s.xs(i)), py(s.ys[i]), 2.5, 0, 2 * Math.PI);
        pen.fill();
      }
      pen.globalAlpha = 1;
    }

    // One stroke from the lowest to the highest value in each column of pixels, so that all peaks are visible.
    envelope(pen, s, px, py) {
      const { x0, x1 } = this.map;
      let [column, low, high, last] = [null, 0, 0, 0];
      const flush = () => {
        if (column === null) return;
        pen.lineTo(column, py(low));
        if (high !== low) pen.lineTo(column, py(high));
        pen.lineTo(column, py(last));
      };
      for (let i = 0; i < s.ys.length; i++) {
        // One point beyond each edge, so that the line reaches the edge.
        if (i + 1 < s.ys.length && s.xs(i + 1) < x0) continue;
        const y = s.ys[i];
        const here = Math.round(px(s.xs(i)) * 2) / 2;
        if (here !== column) {
          flush();
          [column, low, high] = [here, y, y];
        }
        [low, high, last] = [Math.min(low, y), Math.max(high, y), y];
        if (s.xs(i) > x1) break;
      }
      flush();
    }

    selection(pen) {
      const { from, to } = this.drag;
      pen.fillStyle = "rgba(0, 90, 181, 0.15)";
      if (this.spec.box) pen.fillRect(from.x, from.y, to.x - from.x, to.y - from.y);
      else pen.fillRect(from.x, MARGIN.top, to.x - from.x, this.map.inner.h);
    }

    position(event) {
      const box = this.canvas.getBoundingClientRect();
      return { x: event.clientX - box.left, y: event.clientY - box.top };
    }

    value({ x, y }) {
      const { x0, x1, y0, y1, inner } = this.map;
      return [
        x0 + ((x - MARGIN.left) / inner.w) * (x1 - x0),
        y1 - ((y - MARGIN.top) / inner.h) * (y1 - y0),
      ];
    }

    listen() {
      this.canvas.addEventListener("pointerdown", (event) => {
        const at = this.position(event);
        this.drag = { from: at, to: at };
        event.preventDefault();
      });
      window.addEventListener("pointermove", (event) => {
        if (!this.drag) return;
        this.drag.to = this.position(event);
        this.draw();
      });
      window.addEventListener("pointerup", () => {
        if (!this.drag) return;
        const { from, to } = this.drag;
        this.drag = null;
        if (Math.abs(to.x - from.x) > 4) this.zoom(this.value(from), this.value(to));
        else this.draw();
      });
      this.canvas.addEventListener("dblclick", () => this.show(null));
      this.canvas.addEventListener("pointermove", (event) => this.read(this.value(this.position(event))));
      this.canvas.addEventListener("pointerleave", () => { this.reading.textContent = ""; });
    }

    zoom(a, b) {
      const sorted = (p, q, [low, high]) => [Math.max(Math.min(p, q), low), Math.min(Math.max(p, q), high)];
      const x = sorted(a[0], b[0], this.whole);
      if (!(x[1] > x[0])) return this.draw();
      const y = this.spec.box ? sorted(a[1], b[1], [this.map.y0, this.map.y1]) : null;
      return this.show({ x, y });
    }

    show(view) {
      const group = this.spec.link ? charts.filter((c) => c.spec.link === this.spec.link) : [this];
      for (const chart of group) { chart.view = view; chart.draw(); }
    }

    read([x, y]) {
      const inside = x >= this.map.x0 && x <= this.map.x1;
      this.reading.textContent = inside ? `${x.toPrecision(5)}, ${y.toPrecision(4)}` : "";
    }
  }

  for (const figure of document.querySelectorAll("figure[data-chart]")) {
    charts.push(new Chart(figure, JSON.parse(figure.dataset.chart)));
  }
  const redraw = () => { for (const chart of charts) chart.draw(); };
  window.addEventListener("resize", redraw);
  window.addEventListener("beforeprint", () => { printing = true; redraw(); });
  window.addEventListener("afterprint", () => { printing = false; redraw(); });
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  document.getElementById("reset").addEventListener("click", () => { for (const c of charts) c.show(null); });
  window.eftCharts = charts;
})();
