"use strict";
// Charts of the report. Drag: zoom in time; double click: whole history; pointer: values; click on a name: hide or show it.
(() => {
  const SPACE = { left: 64, right: 12, top: 10, bottom: 26 };
  const HEIGHT = 260, PRINTED_WIDTH = 680, SHORTEST_DRAG = 5; // px
  const charts = [];

  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  const shape = (name, attributes, parent) => {
    const node = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    return parent.appendChild(node);
  };
  const rounded = (value) => Number(value.toPrecision(5)).toString();

  // Round values between two ends, about `count` of them.
  function ticks(low, high, count) {
    const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
    const first = Math.ceil(low / step), found = [];
    for (let k = first; k * step <= high + 1e-9 * step; k++) found.push(k * step);
    return found;
  }

  // The first index whose time is not below the given one.
  function indexAt(time, wanted) {
    let low = 0, high = time.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (time[middle] < wanted) low = middle + 1; else high = middle;
    }
    return low;
  }

  class Chart {
    constructor(host) {
      const data = JSON.parse(host.querySelector("script").textContent);
      this.host = host;
      this.unit = data.unit;
      this.time = new Float64Array(bytes(data.time));
      this.lines = data.lines.map((line) => ({ ...line, values: new Float32Array(bytes(line.values)), shown: true }));
      this.group = host.dataset.group;
      this.whole = [this.time[0], this.time[this.time.length - 1]];
      this.range = this.whole;
      this.picture = shape("svg", { role: "img", "aria-label": data.title }, host);
      this.readout = host.appendChild(document.createElement("div"));
      this.readout.className = "readout";
      this.addNames();
      this.addPointer();
    }

    addNames() {
      const names = this.host.appendChild(document.createElement("div"));
      names.className = "names";
      for (const line of this.lines) {
        const name = names.appendChild(document.createElement("button"));
        name.type = "button";
        name.textContent = line.name;
        name.style.borderColor = line.color;
        name.addEventListener("click", () => {
          line.shown = !line.shown;
          name.classList.toggle("hidden", !line.shown);
          this.draw();
        });
      }
    }

    addPointer() {
      let start = null;
      const at = (event) => event.clientX - this.picture.getBoundingClientRect().left;
      this.picture.addEventListener("pointerdown", (event) => { start = at(event); });
      this.picture.addEventListener("pointermove", (event) => this.show(at(event), start));
      this.picture.addEventListener("pointerleave", () => { start = null; this.draw(); });
      this.picture.addEventListener("pointerup", (event) => {
        const ends = [start, at(event)].sort((a, b) => a - b);
        const wide = start !== null && ends[1] - ends[0] > SHORTEST_DRAG;
        start = null;
        if (wide) this.zoom(ends.map((x) => this.timeAt(x)));
      });
      this.picture.addEventListener("dblclick", () => this.zoom(null));
    }

    // Zoom this chart and those of its group; null: the whole history.
    zoom(range) {
      for (const chart of charts.filter((other) => other === this || (this.group && other.group === this.group))) {
        const [low, high] = range ?? chart.whole;
        const clipped = [Math.max(low, chart.whole[0]), Math.min(high, chart.whole[1])];
        if (clipped[1] > clipped[0]) chart.range = clipped;
        chart.draw();
      }
    }

    timeAt(x) {
      const [low, high] = this.range, inner = this.width - SPACE.left - SPACE.right;
      return low + (high - low) * Math.min(1, Math.max(0, (x - SPACE.left) / inner));
    }

    draw(width) {
      this.width = width ?? this.host.clientWidth;
      const [from, until] = this.range, { time } = this;
      const first = Math.max(0, indexAt(time, from) - 1), last = Math.min(time.length, indexAt(time, until) + 2);
      const shown = this.lines.filter((line) => line.shown);
      let low = Infinity, high = -Infinity;
      for (const line of shown) {
        for (let k = first; k < last; k++) {
          if (line.values[k] < low) low = line.values[k];
          if (line.values[k] > high) high = line.values[k];
        }
      }
      if (!(low <= high)) [low, high] = [0, 1];
      const margin = high > low ? 0.06 * (high - low) : Math.abs(high) || 1;
      [low, high] = [low - margin, high + margin];
      const inner = this.width - SPACE.left - SPACE.right, tall = HEIGHT - SPACE.top - SPACE.bottom;
      this.x = (value) => SPACE.left + (inner * (value - from)) / (until - from || 1);
      this.y = (value) => SPACE.top + (tall * (high - value)) / (high - low);
      this.picture.setAttribute("viewBox", `0 0 ${this.width} ${HEIGHT}`);
      this.picture.replaceChildren();
      this.drawAxes(from, until, low, high);
      for (const line of shown) {
        const attributes = { d: this.path(line.values, first, last), stroke: line.color, class: "line" };
        shape("path", line.dashed ? { ...attributes, "stroke-dasharray": "6 3" } : attributes, this.picture);
      }
    }

    drawAxes(from, until, low, high) {
      const bottom = HEIGHT - SPACE.bottom, right = this.width - SPACE.right;
      for (const value of ticks(low, high, 7)) {
        shape("path", { d: `M${SPACE.left} ${this.y(value)}H${right}`, class: "grid" }, this.picture);
        const place = { x: SPACE.left - 6, y: this.y(value) + 4, "text-anchor": "end" };
        shape("text", place, this.picture).textContent = rounded(value);
      }
      for (const value of until > from ? ticks(from, until, Math.max(3, this.width / 120)) : [from]) {
        shape("path", { d: `M${this.x(value)} ${SPACE.top}V${bottom}`, class: "grid" }, this.picture);
        const place = { x: this.x(value), y: bottom + 16, "text-anchor": "middle" };
        shape("text", place, this.picture).textContent = rounded(value);
      }
      shape("text", { x: right, y: HEIGHT - 2, "text-anchor": "end" }, this.picture).textContent = "s";
      shape("text", { x: 2, y: 12 }, this.picture).textContent = this.unit;
    }

    // A line; where several samples fall on one pixel, through the first, smallest, largest and last of them.
    path(values, first, last) {
      const points = [];
      const add = (k) => points.push(`${this.x(this.time[k]).toFixed(1)} ${this.y(values[k]).toFixed(1)}`);
      for (let k = first; k < last; ) {
        const pixel = Math.floor(this.x(this.time[k]));
        let end = k, least = k, most = k;
        for (; end < last && Math.floor(this.x(this.time[end])) === pixel; end++) {
          if (values[end] < values[least]) least = end;
          if (values[end] > values[most]) most = end;
        }
        [...new Set([k, Math.min(least, most), Math.max(least, most), end - 1])].forEach(add);
        k = end;
      }
      return `M${points.join("L")}`;
    }

    // The values at the pointer, and the part that is being marked.
    show(x, start) {
      const time = this.timeAt(x), k = indexAt(this.time, time);
      const nearer = k > 0 && (k === this.time.length || time - this.time[k - 1] < this.time[k] - time) ? k - 1 : k;
      this.picture.querySelectorAll(".pointer").forEach((node) => node.remove());
      const tall = HEIGHT - SPACE.top - SPACE.bottom;
      const [left, wide] = start === null ? [this.x(this.time[nearer]), 1] : [Math.min(x, start), Math.abs(x - start)];
      shape("rect", { x: left, y: SPACE.top, width: wide, height: tall, class: "pointer" }, this.picture);
      const values = this.lines.filter((line) => line.shown).map((line) => `${line.name} ${rounded(line.values[nearer])}`);
      this.readout.textContent = `${rounded(this.time[nearer])} s: ${values.join(", ")} ${this.unit}`;
    }
  }

  document.querySelectorAll(".chart").forEach((host) => charts.push(new Chart(host)));
  const drawAll = (width) => charts.forEach((chart) => chart.draw(width));
  drawAll();
  window.addEventListener("resize", () => drawAll());
  window.addEventListener("beforeprint", () => {
    document.querySelectorAll("details").forEach((part) => { part.open = true; });
    drawAll(PRINTED_WIDTH);
  });
  window.addEventListener("afterprint", () => drawAll());
})();
