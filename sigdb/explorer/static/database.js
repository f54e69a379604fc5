// Looking through a database: SQL, rows, maps.

import { Latest, request } from "./api.js";
import { changedFields, setFields } from "./address.js";
import { cell, digits, paintMap } from "./plots.js";

export class DatabaseTab {
  constructor(place, facts, { onRows, onError, onChange }) {
    Object.assign(this, { place, facts, onRows, onError, onChange, chosen: [], sort: "", table: null });
    const numbers = facts.columns.filter((column) => column.number).map((column) => column.name);
    const options = (chosen) => numbers.map((name) => `<option${name === chosen ? " selected" : ""}>${name}</option>`).join("");
    place.innerHTML = `
      <p><b>${escaped(facts.name)}</b>, ${facts.rows} rows. <span class="quiet">${facts.coverage ? `Coverage was studied for ${escaped(facts.coverage.sensor)}: a signature is outside the database where its residual distance is above ${digits(facts.coverage.threshold)}.` : "Its coverage was not studied; sigdb coverage does."}</span></p>
      <label>Only rows with <input type="text" id="where" placeholder="tooth = 6 and stiffness_loss > 0.2"></label>
      <label>or one SELECT <textarea id="sql" spellcheck="false"></textarea></label>
      <p class="buttons"><button id="ask">Show rows</button></p>
      <div class="scroll"><table id="cases" aria-label="Rows"></table></div>
      <p class="quiet">Click a row to show it; with Ctrl or ⌘ to lay it over the others.</p>
      <h2>Map</h2>
      <div class="pair"><label>over <select id="map-x">${options("tooth")}</select></label><label>and <select id="map-y"><option value="">the values themselves</option>${options("")}</select></label></div>
      <label>show <select id="map-value">${options("fm4")}</select></label>
      <p class="buttons"><button id="draw-map">Draw the map</button></p>
      <canvas class="map" id="map" role="img" aria-label="Map of an indicator over two axes" hidden></canvas>
      <p id="map-text" class="quiet"></p>`;
    this.find("#sql").defaultValue = this.statement("");
    this.tables = new Latest((sql) => request("table", { sql }), (table) => { this.table = table; this.fill(); }, onError);
    this.maps = new Latest((wanted) => request("map", wanted), (map, wanted) => this.showMap(map, wanted), onError);
    this.find("#where").addEventListener("change", () => { this.find("#sql").value = this.statement(this.find("#where").value); this.ask(); });
    this.find("#ask").addEventListener("click", () => this.ask());
    this.find("#draw-map").addEventListener("click", () => this.map());
    this.find("#map").addEventListener("mousemove", (event) => this.point(event));
  }

  find(selector) { return this.place.querySelector(selector); }

  statement(where) {
    const wanted = ["id", "tooth", "damaged_teeth", "stiffness_loss", "phase_shift_deg", "snr_db", "fm4"];
    const names = wanted.filter((name) => this.facts.columns.some((column) => column.name === name));
    return `select ${names.join(", ")} from cases${where ? ` where ${where}` : ""} order by id limit 200`;
  }

  // What an address holds of the tab, and back.
  state() {
    return { ...changedFields(this.place), ...(this.sort ? { sort: this.sort } : {}), ...(this.mapped ? { map: "1" } : {}) };
  }

  restore(settings, rows) {
    setFields(this.place, settings);
    if (settings.where && !settings.sql) this.find("#sql").value = this.statement(settings.where);
    this.sort = settings.sort ?? "";
    this.chosen = rows;
    this.ask();
    if (settings.map) this.map();
  }

  ask() { this.tables.want(this.find("#sql").value); }

  // Rows by the column of the sort, which has a minus where they fall; empty cells are last.
  sorted({ columns, rows }) {
    const falls = this.sort.startsWith("-"), at = columns.indexOf(falls ? this.sort.slice(1) : this.sort);
    if (at < 0) return rows;
    const order = (a, b) => (a[at] === null) - (b[at] === null) || (a[at] < b[at] ? -1 : a[at] > b[at] ? 1 : 0) * (falls ? -1 : 1);
    return [...rows].sort(order);
  }

  sortBy(name) {
    this.sort = this.sort === name ? "-" + name : name;
    this.fill();
    this.onChange();
    this.find(`#cases th[data-name="${CSS.escape(name)}"] button`).focus();
  }

  fill() {
    const { columns } = this.table, table = this.find("#cases"), id = columns.indexOf("id");
    const aria = (name) => this.sort === name ? ' aria-sort="ascending"' : this.sort === "-" + name ? ' aria-sort="descending"' : "";
    table.innerHTML = `<thead><tr>${columns.map((name) => `<th data-name="${escaped(name)}"${aria(name)}><button>${escaped(name)}</button></th>`).join("")}</tr></thead>`;
    for (const head of table.tHead.rows[0].cells) head.firstChild.addEventListener("click", () => this.sortBy(head.dataset.name));
    const body = table.createTBody();
    for (const row of this.sorted(this.table)) {
      const line = body.insertRow();
      for (const value of row) line.insertCell().textContent = cell(value);
      if (id < 0) continue;
      line.tabIndex = 0; line.dataset.id = row[id];
      line.addEventListener("click", (event) => this.choose(row[id], event.ctrlKey || event.metaKey || event.shiftKey));
      line.addEventListener("keydown", (event) => { if (event.key === "Enter") this.choose(row[id], event.ctrlKey || event.metaKey); });
    }
    this.mark();
  }

  choose(id, also) {
    this.chosen = also ? (this.chosen.includes(id) ? this.chosen.filter((other) => other !== id) : [...this.chosen, id]) : [id];
    this.mark();
    if (this.chosen.length) this.onRows(this.chosen);
  }

  mark() {
    for (const line of this.place.querySelectorAll("tr[data-id]")) line.setAttribute("aria-selected", this.chosen.includes(Number(line.dataset.id)));
  }

  map() {
    this.maps.want({ x: this.find("#map-x").value, y: this.find("#map-y").value, value: this.find("#map-value").value, where: this.find("#where").value });
  }

  showMap(map, wanted) {
    this.mapped = map;
    const { x, y, mean, count } = map, shown = wanted.y ? mean : count, what = wanted.y ? `mean of ${wanted.value}` : "number of rows";
    const values = shown.flat().filter((value) => value !== null), low = Math.min(...values), high = Math.max(...values);
    const canvas = this.find("#map");
    canvas.hidden = false;
    paintMap(canvas, x.length, y.length, x.flatMap((_, i) => shown.map((line) => line[i])), high, low < 0 ? -high : low);
    canvas.style.imageRendering = "pixelated";
    const rows = count.flat().reduce((a, b) => a + b, 0);
    this.mapText = `${what} from ${digits(low)} (light) to ${digits(high)} (dark); ${wanted.x} to the right, ${digits(x[0])} to ${digits(x.at(-1))}; ${wanted.y || wanted.value} upwards, ${digits(y[0])} to ${digits(y.at(-1))}; ${rows} rows in ${count.flat().filter((one) => one > 0).length} of ${x.length * y.length} cells.`;
    this.find("#map-text").textContent = this.mapText;
    this.onChange();
  }

  point(event) {
    if (!this.mapped) return;
    const { x, y, mean, count } = this.mapped, box = event.target.getBoundingClientRect();
    const i = Math.min(x.length - 1, Math.floor((event.clientX - box.left) / box.width * x.length));
    const j = Math.min(y.length - 1, Math.floor((box.bottom - event.clientY) / box.height * y.length));
    this.find("#map-text").textContent = `${this.find("#map-x").value} ${digits(x[i])}, ${this.find("#map-y").value || this.find("#map-value").value} ${digits(y[j])}: ${digits(mean[j]?.[i])}, mean of ${count[j]?.[i]} rows. ${this.mapText}`;
  }
}

export function escaped(text) {
  const element = document.createElement("span");
  element.textContent = text;
  return element.innerHTML.replaceAll('"', "&quot;");
}

// A table of the nearest templates with its verdict.
export function showNearest(place, { columns, rows, verdict }) {
  const wanted = ["template", "tooth", "stiffness_loss", "phase_shift_deg", "match", "residual_distance"].filter((name) => columns.includes(name));
  const cells = (row) => wanted.map((name) => `<td>${escaped(cell(row[columns.indexOf(name)]))}</td>`).join("");
  place.hidden = false;
  place.innerHTML = `<h2>Nearest templates</h2><table class="small"><thead><tr>${wanted.map((name) => `<th>${name.replaceAll("_", " ")}</th>`).join("")}</tr></thead><tbody>${rows.map((row) => `<tr>${cells(row)}</tr>`).join("")}</tbody></table><p class="quiet">${escaped(verdict)}</p>`;
}
