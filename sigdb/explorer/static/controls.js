// Sliders with number fields, from the server's description of the settings.

export class Controls {
  constructor(form, described, sensors, changed) {
    this.form = form; this.described = described; this.changed = changed; this.fields = {};
    const groups = new Map();
    const group = (name) => { if (!groups.has(name)) groups.set(name, this.group(name)); return groups.get(name); };
    for (const control of described) group(control.group).append(this.control(control));
    this.noise = this.checkbox("with noise", "noise");
    if (this.fields.snr_db) group("Measurement").append(this.noise.parentElement);
    group("Measurement").append(this.sensors(sensors));
    form.addEventListener("submit", (event) => event.preventDefault());
  }

  group(name) {
    const set = document.createElement("fieldset"), legend = document.createElement("legend");
    legend.textContent = name;
    set.append(legend);
    this.form.append(set);
    return set;
  }

  control(control) {
    const box = document.createElement("div"), label = document.createElement("label");
    const number = document.createElement("input"), slider = document.createElement("input"), unit = document.createElement("span");
    box.className = "control";
    box.title = control.help;
    label.textContent = control.label; label.htmlFor = "number-" + control.name;
    number.type = "number"; number.id = "number-" + control.name; number.step = "any";
    slider.type = "range"; slider.id = "slider-" + control.name;
    slider.setAttribute("aria-label", `${control.label}${control.unit === "-" ? "" : ", " + control.unit}`);
    Object.assign(slider, { min: control.low, max: control.high, step: control.step });
    unit.className = "unit"; unit.textContent = control.unit === "-" ? "" : control.unit;
    for (const [field, other] of [[slider, number], [number, slider]]) {
      field.value = control.value;
      field.addEventListener("input", () => { if (field.value !== "") { other.value = field.value; this.changed(control.name); } });
    }
    this.fields[control.name] = { control, number, slider };
    box.append(label, number, unit, slider);
    return box;
  }

  checkbox(text, id) {
    const label = document.createElement("label"), field = document.createElement("input");
    field.type = "checkbox"; field.id = id;
    field.addEventListener("input", () => this.changed(id));
    label.append(field, " " + text);
    return field;
  }

  sensors(sensors) {
    const label = document.createElement("label");
    this.sensor = document.createElement("select");
    this.sensor.id = "sensor";
    for (const { name, unit } of sensors) this.sensor.append(new Option(`${name}, ${unit}`, name));
    this.sensor.addEventListener("input", () => this.changed("sensor"));
    label.append("sensor ", this.sensor);
    return label;
  }

  // Settings of a view; those at their defaults are left out.
  view() {
    const view = {};
    for (const [name, { control, number }] of Object.entries(this.fields)) {
      const value = Number(number.value) * control.scale;
      if (name === "snr_db" ? this.noise.checked : value !== control.default) view[name] = Number(value.toPrecision(12));
    }
    if (!view.tooth) for (const { name, group } of this.described) if (group === "Damage") delete view[name];
    if (this.sensor.selectedIndex > 0) view.sensor = this.sensor.value;
    return view;
  }

  has(name) { return name in this.fields || name === "sensor"; }

  // Set all settings; those that are not named have their defaults, or their first values where none is named.
  set(view) {
    const none = !Object.keys(view).some((name) => this.has(name));
    for (const [name, { control, number, slider }] of Object.entries(this.fields)) {
      const value = view[name] !== undefined ? Number(view[name]) : none || control.default === null ? control.value * control.scale : control.default;
      number.value = slider.value = Number((value / control.scale).toPrecision(9));
    }
    this.noise.checked = view.snr_db !== undefined;
    this.sensor.value = view.sensor;
    if (this.sensor.selectedIndex < 0) this.sensor.selectedIndex = 0;
  }

  step(name, by) {
    const field = this.fields[name];
    if (!field) return;
    const { low, high } = field.control, span = high - Math.max(low, 1) + 1;
    const value = ((Number(field.number.value) - 1 + by) % span + span) % span + 1;
    field.number.value = field.slider.value = value;
    this.changed(name);
  }
}
