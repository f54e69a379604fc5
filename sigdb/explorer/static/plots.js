// The four panels of an average, and a map of colours.

// Colours of the style sheet, read once: reading them makes the browser lay the page out.
const colours = new Map();
function colour(name) {
  if (!colours.has(name)) colours.set(name, getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim());
  return colours.get(name);
}

// Numbers with three digits: 0.0123, 12.3, 1.23e-6.
export function digits(value) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (typeof value !== "number") return String(value);
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) return value.toExponential(2).replace("e+", "e");
  return String(Number(value.toPrecision(4)));
}

// A cell of a table: whole numbers with all their digits, since ids are some of them.
export function cell(value) { return Number.isInteger(value) ? String(value) : digits(value); }

const overlayColours = ["#b8860b", "#2a9d8f", "#8e6bbf", "#d1495b", "#6b8e23", "#c2682a", "#4a7fb5", "#a3548f"];

// Write a text where it differs from what stands there: a new text makes the browser lay out and paint.
export function write(element, text) { if (element.textContent !== text) element.textContent = text; }

export class Panels {
  constructor() {
    this.marked = { teeth: 1, damaged: [] };
    this.stiffness = this.line("plot-stiffness");
    this.signal = this.line("plot-signal");
    this.spectrum = this.bars("plot-spectrum");
    this.canvas = document.getElementById("wigner");
    this.labels = document.createElement("div");
    this.canvas.parentElement.append(this.labels);
    new ResizeObserver(() => this.resize()).observe(document.getElementById("pictures"));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.restyle());
  }

  axes(xFormat) {
    const common = { stroke: () => colour("quiet"), grid: { stroke: () => colour("line"), width: 0.5 }, ticks: { show: false }, font: "11px system-ui" };
    return [
      { ...common, size: 20, gap: 2, values: (_, ticks) => ticks.map(xFormat) },
      { ...common, size: 56, values: (_, ticks) => ticks.map(digits), splits: undefined, space: 24 },
    ];
  }

  line(id) {
    const place = document.getElementById(id);
    return new uPlot({
      width: place.clientWidth || 600, height: place.clientHeight, legend: { show: false },
      series: [{}, { stroke: () => colour("healthy"), width: 1 }, { stroke: () => colour("now"), width: 1 }],
      cursor: { y: false, points: { show: false } },
      scales: { x: { time: false, range: [0, 360] } },
      axes: this.axes((angle) => angle + "°").map((axis, i) => i ? axis : { ...axis, splits: () => [0, 60, 120, 180, 240, 300, 360] }),
      hooks: { drawClear: [(plot) => this.passes(plot)] },
    }, [[0, 360], [null, null], [null, null]], place);
  }

  bars(id) {
    const place = document.getElementById(id), paths = uPlot.paths.bars({ size: [0.7, 6, 1] });
    return new uPlot({
      width: place.clientWidth || 600, height: place.clientHeight, legend: { show: false },
      series: [{}, { stroke: () => colour("healthy"), fill: () => colour("healthy"), paths: uPlot.paths.bars({ size: [1, 9, 1] }), points: { show: false } },
        { stroke: () => colour("now"), fill: () => colour("now"), paths, points: { show: false } }],
      scales: { x: { time: false } }, cursor: { y: false, points: { show: false } },
      axes: this.axes((order) => order).map((axis, i) => i ? axis : { ...axis, splits: (plot) => {
        const Z = this.marked.teeth, top = plot.scales.x.max ?? 4 * Z;
        return Array.from({ length: Math.floor(top / Z) + 1 }, (_, h) => h * Z);
      } }),
    }, [[0, 1], [null, null], [null, null]], place);
  }

  // Bands over the passes of damaged teeth, lines between all passes, and their numbers.
  passes(plot) {
    const { ctx } = plot, { left, top, width, height } = plot.bbox, { teeth, damaged } = this.marked;
    ctx.save();
    ctx.fillStyle = colour("band");
    for (const tooth of damaged) ctx.fillRect(left + (tooth - 1) / teeth * width, top, width / teeth, height);
    ctx.strokeStyle = colour("line");
    ctx.lineWidth = devicePixelRatio * 0.5;
    const every = Math.ceil(teeth / 24);
    ctx.font = `${10 * devicePixelRatio}px system-ui`;
    ctx.textAlign = "center";
    for (let tooth = 1; tooth <= teeth; tooth++) {
      const x = left + (tooth - 1) / teeth * width;
      ctx.beginPath(); ctx.moveTo(x, top); ctx.lineTo(x, top + height); ctx.stroke();
      if ((tooth - 1) % every && !damaged.includes(tooth)) continue;
      ctx.fillStyle = damaged.includes(tooth) ? colour("damage") : colour("quiet");
      ctx.fillText(tooth, x + width / teeth / 2, top + 10 * devicePixelRatio);
    }
    ctx.restore();
  }

  // Paint an average; others are {name, tsa} that lie over it.
  paint(shown, others = []) {
    const { facts, arrays } = shown;
    this.shown = shown; this.others = others;
    this.marked = { teeth: facts.teeth, damaged: facts.damaged ?? [] };
    const n = arrays.tsa.length, angle = angles(n);
    const over = others.slice(0, overlayColours.length).map((other) => resampled(other.tsa, n));
    for (let i = this.signal.series.length - 3; i < over.length; i++) this.signal.addSeries({ stroke: overlayColours[i], width: 1 });
    while (this.signal.series.length > over.length + 3) this.signal.delSeries(this.signal.series.length - 1);
    this.signal.setData([angle, arrays.tsa_healthy ?? blank(n), arrays.tsa, ...over]);
    const stiffness = document.getElementById("plot-stiffness").parentElement;
    stiffness.hidden = !arrays.stiffness;
    if (arrays.stiffness) {
      const m = arrays.stiffness.length, at = angles(m);
      this.stiffness.setData([at, arrays.stiffness_healthy, arrays.stiffness]);
    }
    const orders = Float64Array.from(arrays.spectrum.keys());
    this.spectrum.setData([orders, withoutMean(arrays.spectrum_healthy) ?? blank(orders.length), withoutMean(arrays.spectrum)]);
    this.distribution(shown);
    const unit = facts.unit ? `, ${facts.unit}` : "";
    write(document.getElementById("signal-caption"), `Averaged signal, ${facts.sensor}${unit}`);
    write(document.getElementById("spectrum-caption"), `Order spectrum, peak amplitude${unit} (ticks at mesh harmonics)`);
    write(document.getElementById("wigner-caption"), `Wigner-Ville distribution over angle and order${facts.unit ? `, ${/[/ ]/.test(facts.unit) ? `(${facts.unit})` : facts.unit}²` : ""}`);
  }

  distribution({ arrays, shapes, facts }) {
    const [columns, rows] = shapes.wigner_ville, w = arrays.wigner_ville;
    let limit = 0;
    for (const value of w) limit = Math.max(limit, Math.abs(value));
    // Colours saturate at a fifth of the greatest magnitude, so that cross-terms stay visible.
    if (!facts.saturated) limit *= 0.2;
    paintMap(this.canvas, columns, rows, w, limit || 1);
    const highest = arrays.orders[rows - 1];
    const labelled = `${facts.teeth} ${highest}`;
    if (labelled === this.labelled) return;
    this.labelled = labelled;
    this.labels.replaceChildren();
    for (let h = 0; h * facts.teeth <= highest; h++) this.label(`${h * facts.teeth}`, { right: "calc(100% - 50px)", bottom: `calc(18px + (100% - 26px) * ${h * facts.teeth / highest} - 7px)` });
    for (let angle = 0; angle <= 360; angle += 60) this.label(`${angle}°`, { left: `calc(56px + (100% - 81px) * ${angle / 360} - 8px)`, bottom: "0" });
  }

  label(text, place) {
    const label = document.createElement("span");
    label.className = "axis-label"; label.textContent = text;
    Object.assign(label.style, place);
    this.labels.append(label);
  }

  resize() {
    for (const plot of [this.stiffness, this.signal, this.spectrum]) {
      const place = plot.root.parentElement;
      if (place.clientWidth) plot.setSize({ width: place.clientWidth, height: place.clientHeight });
    }
  }

  restyle() { colours.clear(); if (this.shown) { this.paint(this.shown, this.others); for (const plot of [this.stiffness, this.signal, this.spectrum]) plot.redraw(); } }
}

const angleLists = new Map();
function angles(n) {
  if (!angleLists.has(n)) angleLists.set(n, Float64Array.from({ length: n }, (_, i) => i * 360 / n));
  return angleLists.get(n);
}
const blanks = new Map();
function blank(n) { if (!blanks.has(n)) blanks.set(n, Array(n).fill(null)); return blanks.get(n); }
function withoutMean(spectrum) { if (!spectrum) return null; const copy = Float64Array.from(spectrum); copy[0] = 0; return copy; }
function resampled(x, n) { return x.length === n ? x : Float64Array.from({ length: n }, (_, i) => x[Math.floor(i * x.length / n)]); }

// Colours of 513 numbers from -1 to 1: blue below and red above zero.
const shades = Uint32Array.from({ length: 513 }, (_, k) => {
  const part = (k - 256) / 256, size = Math.abs(part) ** 0.7, [r, g, b] = (part >= 0 ? [178, 24, 43] : [33, 102, 172]).map((c) => Math.round(250 + (c - 250) * size));
  return (255 << 24 | b << 16 | g << 8 | r) >>> 0;
});

// A map of columns of numbers, upwards, saturated at the limit; with a low end, from light there to dark at the limit.
export function paintMap(canvas, columns, rows, values, limit, low = -limit) {
  if (canvas.width !== columns || canvas.height !== rows) Object.assign(canvas, { width: columns, height: rows });
  const context = canvas.getContext("2d"), image = context.createImageData(columns, rows), pixels = new Uint32Array(image.data.buffer);
  const scale = low < 0 ? 256 / limit : 256 / (limit - low || 1), from = low < 0 ? 0 : low;
  for (let i = 0, k = 0; i < columns; i++) {
    for (let j = rows - 1; j >= 0; j--, k++) {
      const value = values[k];
      if (value === null || Number.isNaN(value)) continue;
      pixels[j * columns + i] = shades[Math.max(low < 0 ? 0 : 256, Math.min(512, 256 + Math.round((value - from) * scale)))];
    }
  }
  context.putImageData(image, 0, 0);
}
