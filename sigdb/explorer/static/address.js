// The state of the page in its address: the settings of the view by their names, and the fields of the tabs by their ids.

export function readAddress() { return Object.fromEntries(new URLSearchParams(location.hash.slice(1))); }

const fields = "[id]:is(input:not([type=file]), select, textarea)";
const first = (field) => field.tagName === "SELECT" ? ([...field.options].find((option) => option.defaultSelected) ?? field.options[0])?.value : field.defaultValue;

// The fields of a place that a person changed, by id.
export function changedFields(place) {
  const changed = {};
  for (const field of place.querySelectorAll(fields)) {
    if (field.type === "checkbox") { if (field.checked) changed[field.id] = "1"; }
    else if (field.value !== first(field)) changed[field.id] = field.value;
  }
  return changed;
}

// Set the fields of a place; those that are not named are as at first.
export function setFields(place, settings) {
  for (const field of place.querySelectorAll(fields)) {
    if (field.type === "checkbox") field.checked = settings[field.id] === "1";
    else field.value = settings[field.id] ?? first(field);
  }
}
