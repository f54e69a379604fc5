// A recipe from ranges that are chosen on the page, with its size and time.

import { request } from "./api.js";
import { changedFields, setFields } from "./address.js";
import { digits } from "./plots.js";

export class RecipeTab {
  constructor(place, controls, view, onError) {
    this.place = place; this.view = view; this.onError = onError;
    const axes = controls.filter(({ name }) => !["specimen", "averages"].includes(name));
    place.innerHTML = `
      <p>Choose ranges; settings without one keep the values of the tab Damage.</p>
      <table><thead><tr><th>setting</th><th>from</th><th>to</th><th>steps</th></tr></thead><tbody>${axes.map((axis) => `
        <tr><td><label><input type="checkbox" data-axis="${axis.name}" id="range-${axis.name}"> ${axis.label}${axis.unit === "-" ? "" : ` <span class="quiet">${axis.unit}</span>`}</label></td>
        <td><input type="number" step="any" id="range-${axis.name}-from" aria-label="${axis.label} from" value="${Number(Math.max(axis.low, axis.name === "tooth" ? 1 : axis.low).toPrecision(4))}"></td>
        <td><input type="number" step="any" id="range-${axis.name}-to" aria-label="${axis.label} to" value="${Number(axis.high.toPrecision(4))}"></td>
        <td><input type="number" min="1" step="1" id="range-${axis.name}-steps" aria-label="${axis.label} steps" value="${["tooth", "damaged_teeth", "teeth"].includes(axis.name) ? axis.high - Math.max(axis.low, 1) + 1 : 5}"></td></tr>`).join("")}</tbody></table>
      <p class="buttons"><button id="make-recipe">Make the recipe</button><button id="save-recipe" disabled>Save it</button></p>
      <p id="recipe-size" role="status"></p><pre id="recipe-text" tabindex="0"></pre>`;
    this.scales = Object.fromEntries(controls.map(({ name, scale }) => [name, scale]));
    this.find("#make-recipe").addEventListener("click", () => this.make());
    this.find("#save-recipe").addEventListener("click", () => this.save());
  }

  find(selector) { return this.place.querySelector(selector); }
  state() { return changedFields(this.place); }
  restore(settings) { setFields(this.place, settings); }

  ranges() {
    const ranges = {};
    for (const box of this.place.querySelectorAll("[data-axis]:checked")) {
      const [low, high, steps] = [...box.closest("tr").querySelectorAll("input[type=number]")].map((field) => Number(field.value));
      const scale = this.scales[box.dataset.axis];
      ranges[box.dataset.axis] = Array.from({ length: Math.max(1, steps) }, (_, i) => Number((scale * (steps > 1 ? low + i * (high - low) / (steps - 1) : low)).toPrecision(9)));
    }
    return ranges;
  }

  async make() {
    this.find("#recipe-size").textContent = "Measuring a sample …";
    try {
      const { recipe, rows, templates, bytes, seconds } = await request("recipe", { view: this.view(), ranges: this.ranges() });
      this.find("#recipe-text").textContent = recipe;
      this.find("#recipe-size").textContent = `${rows} rows from ${templates} templates: about ${digits(bytes / 1e6)} MB and ${digits(seconds)} s with all cores, measured on a sample.`;
      this.find("#save-recipe").disabled = false;
    } catch (error) { this.find("#recipe-size").textContent = ""; this.onError(error); }
  }

  save() {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([this.find("#recipe-text").textContent], { type: "application/toml" }));
    link.download = "recipe.toml";
    link.click();
  }
}
