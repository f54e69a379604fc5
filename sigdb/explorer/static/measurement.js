// Recordings that are dropped onto the page: their average, and the diagnosis of the command line.

import { request } from "./api.js";
import { changedFields, setFields } from "./address.js";
import { escaped } from "./database.js";

export class MeasurementTab {
  constructor(place, given, { onShown, onError }) {
    this.place = place; this.onShown = onShown; this.onError = onError; this.run = null; this.healthy = [];
    place.innerHTML = `
      <p>Drop a recording, or an average of one revolution. Nothing leaves this machine.</p>
      <div class="drop" id="drop-run" tabindex="0" role="button">Recording: drop it here or click<br><b></b></div>
      <div class="drop" id="drop-healthy" tabindex="0" role="button">Healthy recordings (one or several)<br><b></b></div>
      <input type="file" id="file-run" hidden><input type="file" id="file-healthy" multiple hidden>
      <div class="pair">
        <label>tooth counts <input type="text" id="counts" placeholder="of the rig; or 32/80"></label>
        <label>tacho <input type="text" id="tacho" placeholder="name of a channel"></label>
        <label>sampling rate, Hz <input type="number" id="rate" min="0" step="any"></label>
        <label>speed, rpm <input type="number" id="rpm" min="0" step="any"></label>
        <label>channel <input type="text" id="channel"></label>
        <label><input type="checkbox" id="mesh-phase"> angle from the mesh</label>
      </div>
      <p class="buttons"><button id="diagnose" disabled>Diagnose</button></p>
      <p id="answer" class="answer" role="status"></p>
      <ul id="notes"></ul>`;
    this.drop("run", (files) => this.take(files[0]));
    this.drop("healthy", (files) => this.takeHealthy(files));
    this.find("#diagnose").addEventListener("click", () => this.diagnose());
    for (const [key, name] of Object.entries(given)) if (!this.run) this.took({ recording: key, name });
  }

  find(selector) { return this.place.querySelector(selector); }
  state() { return changedFields(this.place); }
  restore(settings) { setFields(this.place, settings); }

  drop(name, take) {
    const zone = this.find("#drop-" + name), file = this.find("#file-" + name);
    zone.addEventListener("click", () => file.click());
    zone.addEventListener("keydown", (event) => { if (event.key === "Enter" || event.key === " ") file.click(); });
    file.addEventListener("change", () => take([...file.files]));
    for (const kind of ["dragenter", "dragover"]) zone.addEventListener(kind, (event) => { event.preventDefault(); zone.classList.add("over"); });
    for (const kind of ["dragleave", "drop"]) zone.addEventListener(kind, () => zone.classList.remove("over"));
    zone.addEventListener("drop", (event) => { event.preventDefault(); take([...event.dataTransfer.files]); });
  }

  async upload(file) { return request("upload?name=" + encodeURIComponent(file.name), file, { raw: true }); }

  async take(file) {
    try { this.took(await this.upload(file)); await this.diagnose(); } catch (error) { this.onError(error); }
  }

  took(kept) {
    this.run = kept;
    this.find("#drop-run b").textContent = kept.name;
    this.find("#diagnose").disabled = false;
  }

  async takeHealthy(files) {
    try {
      this.healthy = await Promise.all(files.map((file) => this.upload(file)));
      this.find("#drop-healthy b").textContent = this.healthy.map(({ name }) => name).join(", ");
      if (this.run) await this.diagnose();
    } catch (error) { this.onError(error); }
  }

  async diagnose() {
    const number = (selector) => this.find(selector).value === "" ? null : Number(this.find(selector).value);
    const options = { tacho: this.find("#tacho").value, sampling_rate: number("#rate"), speed_rpm: number("#rpm"), channel: this.find("#channel").value, mesh_phase: this.find("#mesh-phase").checked };
    const button = this.find("#diagnose");
    button.disabled = true; this.find("#answer").textContent = "Reading and comparing …"; this.find("#notes").replaceChildren();
    try {
      const shown = await request("diagnosis", { recording: this.run.recording, healthy: this.healthy.map(({ recording }) => recording), teeth: this.find("#counts").value.trim() || null, options });
      this.find("#answer").textContent = shown.facts.answer ?? "An average of one revolution.";
      this.find("#notes").innerHTML = (shown.facts.notes ?? []).map((note) => `<li>${escaped(note)}</li>`).join("");
      this.onShown(shown, this.run.name);
    } catch (error) { this.find("#answer").textContent = ""; this.onError(error); }
    button.disabled = false;
  }
}
