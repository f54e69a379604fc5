// The page: its state is in its address; each change asks for one picture.

import { Latest, request, takeToken } from "./api.js";
import { Controls } from "./controls.js";
import { DatabaseTab, escaped, showNearest } from "./database.js";
import { MeasurementTab } from "./measurement.js";
import { Panels, digits } from "./plots.js";
import { RecipeTab } from "./recipe.js";

const $ = (id) => document.getElementById(id);
const ask = window.sigdbStatic?.request ?? request;
let panels, controls, live, start, tab = "live", rows = [], sql = "", shownNow = null;

function message(text) { $("message").hidden = !text; $("message").textContent = text ?? ""; }
function behind(text) { $("legend-behind").hidden = !text; $("behind").textContent = text; }
const fail = (error) => message(error.message);

function address() {
  const settings = new URLSearchParams();
  for (const [name, value] of Object.entries(controls.view())) settings.set(name, value);
  if (!controls.view().tooth) settings.set("tooth", "0");
  if (tab !== "live") settings.set("tab", tab);
  if (rows.length) settings.set("rows", rows.join(","));
  if (sql) settings.set("sql", sql);
  history.replaceState(null, "", "#" + settings);
}

function readAddress() {
  const settings = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
  rows = settings.rows ? settings.rows.split(",").map(Number).filter(Number.isInteger) : [];
  const wantedTab = settings.tab ?? "live";
  sql = settings.sql ?? "";
  for (const name of ["tab", "rows", "sql"]) delete settings[name];
  if (Object.keys(settings).length) controls.set(settings); else controls.first();
  return wantedTab;
}

// Ask for the picture of the settings, and keep when they changed.
function want() { live.want({ view: controls.view(), at: performance.now() }); }

function changed() {
  address();
  want();
}

function paint(shown, others, text) {
  message(null);
  shownNow = shown;
  panels.paint(shown, others);
  $("shown").textContent = text;
  facts(shown.facts);
}

function showLive(shown, { view, at }) {
  if (tab === "database" || tab === "measurement") return;
  const { facts: f } = shown;
  behind("healthy");
  const damage = f.damaged.length ? `tooth ${f.damaged.join(", ")} of ${start.rig.gear}, ${f.teeth} teeth` : `undamaged ${start.rig.gear}, ${f.teeth} teeth`;
  paint(shown, [], `${damage}${view.snr_db === undefined ? "; without noise" : `; ${view.averages ?? 102} averages at ${view.snr_db} dB`}`);
  // A task after the frame's callback runs once the frame is painted.
  checkStability(view);
  requestAnimationFrame(() => setTimeout(() => {
    const { simulation, signature } = f.milliseconds;
    $("timing").textContent = `simulation ${simulation.toFixed(0)} ms, signature ${signature.toFixed(0)} ms, painted after ${(performance.now() - at).toFixed(0)} ms`;
    document.body.dataset.painted = JSON.stringify({ view, milliseconds: performance.now() - at, simulation: simulation + signature });
  }));
}

// The check of stability takes longer than a picture, so it waits until the settings rest.
let resting = 0;
function checkStability(view) {
  clearTimeout(resting);
  if (window.sigdbStatic) return;
  resting = setTimeout(async () => {
    try {
      const { stable, multiplier } = await request("stability", view);
      if (tab !== "live") return;
      document.body.dataset.stable = stable;
      const near = start.database ? await request("nearest", { view, sensor: view.sensor }) : null;
      if (tab !== "live") return;
      if (near) showNearest($("nearest"), near);
      if (!stable) message(`The rig is unstable with this damage (Floquet multiplier ${digits(multiplier)}): the picture is no steady state.`);
    } catch (error) { fail(error); }
  }, 300);
}

function facts(f) {
  const contact = $("contact");
  contact.className = f.contact === false ? "parts" : "";
  contact.textContent = f.least_force === undefined ? "" : f.contact
    ? `Least mesh force: ${digits(f.least_force)} of the static one.`
    : `The teeth part: the least mesh force is ${digits(f.least_force)} of the static one. The picture, which is linear, does not hold.`;
  const body = $("indicators").tBodies[0], names = (f.indicators ?? []).map(({ name, unit }) => name + unit).join();
  if (names && names === body.dataset.names) {
    f.indicators.forEach(({ value, healthy }, i) => {
      body.rows[i].cells[1].textContent = digits(value);
      body.rows[i].cells[2].textContent = digits(healthy);
    });
    return;
  }
  body.dataset.names = names;
  body.innerHTML = (f.indicators ?? []).map(({ name, unit, value, healthy, help }) =>
    `<tr title="${escaped(help)}"><td>${escaped(name)}${unit === "-" || !unit ? "" : ` <span class="quiet">${escaped(unit)}</span>`}</td><td>${digits(value)}</td><td>${digits(healthy)}</td></tr>`).join("");
}

async function showRows(chosen) {
  rows = chosen;
  address();
  try {
    const shown = await Promise.all(chosen.slice(0, 9).map((id) => request("row", { id, sensor: start.database.sensors.includes(controls.sensor.value) ? controls.sensor.value : null })));
    const [first, ...others] = shown;
    behind("");
    paint(first, others.map((other) => ({ name: String(other.facts.id), tsa: other.arrays.tsa })), chosen.map((id, i) => caseText(shown[i].facts.case)).join("; "));
    showNearest($("nearest"), await request("nearest", { id: first.facts.id }));
  } catch (error) { fail(error); }
}

function caseText(row) {
  const damage = row.tooth ? `tooth ${row.tooth}, ${row.damaged_teeth} damaged, loss ${digits(row.stiffness_loss)}, shift ${digits(row.phase_shift_deg)}°` : "undamaged";
  return `row ${row.id}: ${damage}, ${digits(row.snr_db)} dB, specimen ${row.specimen}`;
}

// The case of the tab Damage as a line over a measured average: without its mean, and as strong as the average.
async function simulatedOver(shown) {
  let simulated;
  try { simulated = await request("live", controls.view()); } catch { return []; }
  if (simulated.facts.teeth !== shown.facts.teeth) return [];
  const [x, y] = [shown, simulated].map(({ arrays }) => arrays.tsa), mean = (v) => v.reduce((a, b) => a + b, 0) / v.length;
  const [m, k] = [mean(x), mean(y)], spread = (v, c) => Math.sqrt(mean(v.map((one) => (one - c) ** 2)));
  const scale = spread(x, m) / (spread(y, k) || 1);
  return [{ name: "simulated", tsa: y.map((one) => m + scale * (one - k)) }];
}

async function showMeasured(shown, name) {
  if (!shown.arrays.tsa) { message(null); return; }
  behind(shown.arrays.tsa_healthy ? "healthy recording" : "");
  const over = await simulatedOver(shown);
  const text = `${name}: ${shown.facts.teeth} teeth${shown.facts.speed_rpm ? `, ${digits(shown.facts.speed_rpm)} rpm` : ""}`;
  paint(shown, over, text + (over.length ? "; the thin line is the simulated case of the tab Damage, scaled to the same rms" : ""));
  if (!start.database) return;
  try { showNearest($("nearest"), await request("nearest", { tsa: [...shown.arrays.tsa], teeth: shown.facts.teeth })); } catch { $("nearest").hidden = true; }
}

function choose(name) {
  tab = name;
  clearTimeout(resting);
  for (const button of document.querySelectorAll("[data-tab]")) button.setAttribute("aria-selected", button.dataset.tab === name);
  $("controls").hidden = name === "database" || name === "measurement" || name === "recipe";
  for (const id of ["database", "measurement", "recipe"]) $(id).hidden = id !== name;
  $("nearest").hidden = true;
  address();
  if (name === "live" || name === "recipe") want();
  if (name === "database" && rows.length) showRows(rows);
}

async function copy(kind) {
  try {
    let text;
    if (tab === "database" && rows.length) {
      text = { python: `import sigdb\n\ndatabase = sigdb.open(${JSON.stringify(start.database.name)})\naverages = database.signals(${JSON.stringify(rows)})["tsa"]\n`, command: `sigdb show ${start.database.name} ${rows.join(" ")}` }[kind];
    }
    text ??= (await request("code", controls.view()))[kind];
    $("copied").hidden = false;
    $("copied").textContent = text;
    try { await navigator.clipboard.writeText(text); } catch { getSelection().selectAllChildren($("copied")); }
  } catch (error) { fail(error); }
}

async function save(form) {
  try {
    const name = `signature.${form}`;
    if (form === "csv") { download(new Blob([csv()], { type: "text/csv" }), name); return; }
    const wanted = tab === "database" && rows.length ? { ids: rows.slice(0, 6) } : tab === "measurement" && shownNow ? measured(shownNow) : { view: controls.view() };
    download(await request("picture", { ...wanted, format: form, title: $("shown").textContent }), name);
  } catch (error) { fail(error); }
}

function measured({ arrays, facts: f }) {
  const healthy = arrays.tsa_healthy ? { healthy: [...arrays.tsa_healthy] } : {};
  return { tsa: [...arrays.tsa], teeth: f.teeth, sensor: f.sensor, unit: f.unit, ...healthy };
}

function csv() {
  const over = Object.fromEntries(panels.others.map(({ name, tsa }) => [`tsa ${name}`, tsa]));
  const { facts: f } = shownNow, arrays = { ...shownNow.arrays, ...over }, n = arrays.tsa.length, names = ["tsa", "tsa_healthy", "stiffness", "stiffness_healthy", ...Object.keys(over)].filter((name) => arrays[name]?.length === n);
  const lines = [`angle_deg,${names.map((name) => name.startsWith("tsa") ? `${name} (${f.unit})` : `${name} (N/m)`).join(",")}`];
  for (let i = 0; i < n; i++) lines.push([i * 360 / n, ...names.map((name) => arrays[name][i])].join(","));
  return lines.join("\n") + "\n";
}

function download(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob); link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

function keys(event) {
  const typing = event.target.matches("input, select, textarea") && event.target.type !== "checkbox";
  if (typing || tab !== "live" || event.ctrlKey || event.metaKey || event.altKey) return;
  const by = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
  if (by) { event.preventDefault(); controls.step("tooth", by); }
}

async function main() {
  if (!window.sigdbStatic) takeToken();
  try { start = await ask("start"); } catch (error) { fail(error); return; }
  $("rig-name").textContent = start.rig.name;
  document.title = `sigdb: ${start.rig.name}`;
  if (window.sigdbStatic) for (const element of document.querySelectorAll("[data-server]")) element.hidden = true;
  panels = new Panels();
  controls = new Controls($("controls"), start.controls, start.sensors, changed);
  live = new Latest(({ view }) => ask("live", view), showLive, fail);
  const wantedTab = readAddress();
  if (!window.sigdbStatic) {
    if (start.database) {
      $("tab-database").hidden = false;
      const database = new DatabaseTab($("database"), start.database, { onRows: showRows, onError: fail, onSql: (text) => { sql = text; address(); } }, sql);
      database.ask();
      if (start.row !== null && !rows.length) { rows = [start.row]; database.chosen = rows; }
    }
    new MeasurementTab($("measurement"), start.offered, { onShown: showMeasured, onError: fail });
    new RecipeTab($("recipe"), start.controls, () => controls.view(), fail);
    request("drawing").then(async (blob) => { $("drawing").innerHTML = await blob.text(); }).catch(fail);
  }
  for (const button of document.querySelectorAll("[data-tab]")) button.addEventListener("click", () => choose(button.dataset.tab));
  for (const button of document.querySelectorAll("[data-copy]")) button.addEventListener("click", () => copy(button.dataset.copy));
  for (const button of document.querySelectorAll("[data-save]")) button.addEventListener("click", () => save(button.dataset.save));
  addEventListener("keydown", keys);
  addEventListener("hashchange", () => choose(readAddress()));
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => event.preventDefault());
  choose(start.row !== null && start.database ? "database" : start.database && wantedTab === "database" ? "database" : wantedTab === "database" ? "live" : wantedTab);
}

main();
