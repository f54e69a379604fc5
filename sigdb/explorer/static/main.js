// The page: its state is in its address; each change asks for one picture.

import { Latest, request, takeToken } from "./api.js";
import { readAddress } from "./address.js";
import { Controls } from "./controls.js";
import { DatabaseTab, escaped, showNearest } from "./database.js";
import { MeasurementTab } from "./measurement.js";
import { Panels, digits, write } from "./plots.js";
import { RecipeTab } from "./recipe.js";

const $ = (id) => document.getElementById(id);
const ask = window.sigdbStatic?.request ?? request;
let panels, controls, live, start, tabs = null, tab = "live", rows = [], kept = {}, shownNow = null;

function message(text) { $("message").hidden = !text; write($("message"), text ?? ""); }
function behind(text) { $("legend-behind").hidden = !text; write($("behind"), text); }
const fail = (error) => message(error.message);

// Write the state of the page into its address. Entries of the tabs are those of the address until the tabs are made.
function address() {
  const settings = new URLSearchParams(controls.view());
  if (!controls.view().tooth) settings.set("tooth", "0");
  if (tab !== "live") settings.set("tab", tab);
  if (rows.length) settings.set("rows", rows.join(","));
  for (const [name, value] of Object.entries(tabs ? Object.assign({}, ...Object.values(tabs).map((each) => each.state())) : kept)) settings.set(name, value);
  history.replaceState(null, "", "#" + settings);
}

// Set the page to its address; return the tab that is chosen there.
function restore(settings) {
  const { tab: wanted = "live", rows: listed = "", ...others } = settings;
  rows = listed ? listed.split(",").map(Number).filter(Number.isInteger) : [];
  controls.set(others);
  kept = Object.fromEntries(Object.entries(others).filter(([name]) => !controls.has(name)));
  if (tabs) for (const each of Object.values(tabs)) each.restore(kept, rows);
  return wanted;
}

// Ask for the picture of the settings, and keep when they changed.
function want() { live.want({ view: controls.view(), at: performance.now() }); }

function changed() {
  want();
  rest();
}

// The rest waits until the settings rest: the address, and what takes longer than a picture.
let resting = 0;
function rest() {
  clearTimeout(resting);
  resting = setTimeout(() => {
    address();
    if (live.busy) return;
    writeTiming();
    if (tab === "live" && !window.sigdbStatic) checkStability(controls.view());
  }, 300);
}

function paint(shown, others, text) {
  message(null);
  clearTimeout(numbering);
  shownNow = shown;
  panels.paint(shown, others);
  write($("shown"), text);
}

// Numbers follow in the frame after their picture, at most ten times a second: nobody reads faster.
let numbered = 0, numbering = 0;
function numbers(shown) {
  if (shown !== shownNow) return;
  clearTimeout(numbering);
  numbering = setTimeout(() => { numbered = performance.now(); facts(shown.facts); }, Math.max(0, numbered + 100 - performance.now()));
}

let timing = "", timed = 0;
function writeTiming() { timed = performance.now(); write($("timing"), timing); }

function showLive(shown, { view, at }) {
  if (tab === "database" || tab === "measurement") return;
  const { facts: f } = shown;
  behind("healthy");
  const damage = f.damaged.length ? `tooth ${f.damaged.join(", ")} of ${start.rig.gear}, ${f.teeth} teeth` : `undamaged ${start.rig.gear}, ${f.teeth} teeth`;
  paint(shown, [], `${damage}${view.snr_db === undefined ? "; without noise" : `; ${view.averages ?? 102} averages at ${view.snr_db} dB`}`);
  rest();
  // A task after the frame's callback runs once the frame is painted.
  requestAnimationFrame(() => setTimeout(() => {
    const { simulation, signature } = f.milliseconds, milliseconds = performance.now() - at;
    timing = `simulation ${simulation.toFixed(0)} ms, signature ${signature.toFixed(0)} ms, painted after ${milliseconds.toFixed(0)} ms`;
    document.body.dataset.painted = JSON.stringify({ view, milliseconds, simulation: simulation + signature });
    numbers(shown);
    if (performance.now() - timed > 1000) writeTiming();
  }));
}

async function checkStability(view) {
  try {
    const { stable, multiplier } = await request("stability", view);
    if (tab !== "live") return;
    document.body.dataset.stable = stable;
    const near = start.database ? await request("nearest", { view, sensor: view.sensor }) : null;
    if (tab !== "live") return;
    if (near) showNearest($("nearest"), near);
    if (!stable) message(`The rig is unstable with this damage (Floquet multiplier ${digits(multiplier)}): the picture is no steady state.`);
  } catch (error) { fail(error); }
}

function facts(f) {
  const contact = $("contact");
  contact.className = f.contact === false ? "parts" : "";
  write(contact, f.least_force === undefined ? "" : f.contact
    ? `Least compression of the mesh: ${digits(f.least_compression)} of the static one; least force: ${digits(f.least_force)}.`
    : `The teeth part: the least compression of the mesh is ${digits(f.least_compression)} of the static one, the least force ${digits(f.least_force)}. The picture, which is linear, does not hold.`);
  const body = $("indicators").tBodies[0], names = (f.indicators ?? []).map(({ name, unit }) => name + unit).join();
  if (names && names === body.dataset.names) {
    f.indicators.forEach(({ value, healthy }, i) => {
      write(body.rows[i].cells[1], digits(value));
      write(body.rows[i].cells[2], digits(healthy));
    });
    return;
  }
  body.dataset.names = names;
  body.innerHTML = (f.indicators ?? []).map(({ name, unit, value, healthy, help }) =>
    `<tr title="${escaped(help)}"><td>${escaped(name)}${unit === "-" || !unit ? "" : ` <span class="quiet">${escaped(unit)}</span>`}</td><td>${digits(value)}</td><td>${digits(healthy)}</td></tr>`).join("");
}

const stored = new Latest(storedRows, paintRows, fail);

function showRows(chosen) {
  rows = chosen;
  address();
  stored.want(chosen);
}

async function storedRows(chosen) {
  const sensor = start.database.sensors.includes(controls.sensor.value) ? controls.sensor.value : null;
  return Promise.all(chosen.slice(0, 9).map((id) => request("row", { id, sensor })));
}

async function paintRows(shown) {
  if (tab !== "database") return;
  const [first, ...others] = shown;
  behind("");
  paint(first, others.map((other) => ({ name: String(other.facts.id), tsa: other.arrays.tsa })), shown.map((each) => caseText(each.facts.case)).join("; "));
  facts(first.facts);
  const near = await request("nearest", { id: first.facts.id });
  if (shownNow === first) showNearest($("nearest"), near);
}

// A row in words; rows of recordings may have no label, and no settings of a simulation.
function caseText(row) {
  const has = (name) => row[name] !== null && row[name] !== undefined, damage = !has("tooth") ? "without a label" : row.tooth ? `tooth ${row.tooth}` : "undamaged";
  const words = { damaged_teeth: (x) => `${x} damaged`, stiffness_loss: (x) => `loss ${digits(x)}`, phase_shift_deg: (x) => `shift ${digits(x)}°` };
  const others = { machine: String, snr_db: (x) => `${digits(x)} dB`, specimen: (x) => `specimen ${x}` };
  const named = Object.entries({ ...(row.tooth ? words : {}), ...others }).filter(([name]) => has(name)).map(([name, text]) => text(row[name]));
  return `row ${row.id}: ${[damage, ...named].join(", ")}`;
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
  facts(shown.facts);
  if (!start.database) return;
  try { showNearest($("nearest"), await request("nearest", { tsa: [...shown.arrays.tsa], teeth: shown.facts.teeth })); } catch { $("nearest").hidden = true; }
}

// Make the tabs, which a page does not need at first.
function makeTabs() {
  if (tabs || window.sigdbStatic) return;
  tabs = { measurement: new MeasurementTab($("measurement"), start.offered, { onShown: showMeasured, onError: fail }), recipe: new RecipeTab($("recipe"), start.controls, () => controls.view(), fail) };
  if (start.database) tabs.database = new DatabaseTab($("database"), start.database, { onRows: showRows, onError: fail, onChange: address });
  for (const each of Object.values(tabs)) each.restore(kept, rows);
  $("side").addEventListener("change", address);
}

function choose(name) {
  if (name === "database" && !start.database) name = "live";
  tab = name;
  clearTimeout(resting);
  if (name !== "live") makeTabs();
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
  const settings = readAddress();
  let first;
  try { first = await ask("start", { address: settings }); } catch (error) { fail(error); return; }
  start = first.facts.start;
  write($("rig-name"), start.rig.name);
  document.title = `sigdb: ${start.rig.name}`;
  if (window.sigdbStatic) for (const element of document.querySelectorAll("[data-server]")) element.hidden = true;
  $("tab-database").hidden = !start.database;
  panels = new Panels();
  controls = new Controls($("controls"), start.controls, start.sensors, changed);
  live = new Latest(({ view }) => ask("live", view), showLive, fail);
  let wanted = restore(settings);
  if (start.row !== null && !rows.length) { rows = [start.row]; wanted = "database"; }
  for (const button of document.querySelectorAll("[data-tab]")) button.addEventListener("click", () => choose(button.dataset.tab));
  for (const button of document.querySelectorAll("[data-copy]")) button.addEventListener("click", () => copy(button.dataset.copy));
  for (const button of document.querySelectorAll("[data-save]")) button.addEventListener("click", () => save(button.dataset.save));
  addEventListener("keydown", keys);
  addEventListener("hashchange", () => { takeToken(); choose(restore(readAddress())); });
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => event.preventDefault());
  if (first.facts.shown) showLive({ ...first, facts: first.facts.shown }, { view: controls.view(), at: 0 });
  if (wanted === "live" && first.facts.shown) $("tab-live").setAttribute("aria-selected", true);
  else choose(wanted);
  if (window.sigdbStatic) return;
  requestAnimationFrame(() => setTimeout(() => {
    makeTabs();
    request("drawing").then(async (blob) => { $("drawing").innerHTML = await blob.text(); }).catch(fail);
  }));
}

main();
