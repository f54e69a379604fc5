// Stands for the server in a page without one: a grid of simulated cases at tooth 1, turned to the wanted tooth.

const { start, cases, facts } = window.sigdbCases;

function numbers(text, Kind) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Kind(bytes.buffer);
}

function decoded(packed) {
  const arrays = {}, shapes = {};
  for (const [name, { shape, scale, bits, data }] of Object.entries(packed)) {
    arrays[name] = Float32Array.from(numbers(data, bits === 8 ? Int8Array : Int16Array), (value) => value * scale);
    shapes[name] = shape;
  }
  return { arrays, shapes };
}

function turned(array, passes, teeth, width = 1) {
  const by = passes * array.length / teeth / width * width, copy = new Float32Array(array.length);
  copy.set(array.subarray(array.length - by), 0);
  copy.set(array.subarray(0, array.length - by), by);
  return copy;
}

async function staticRequest(name, view) {
  if (name === "start") return { facts: { start } };
  const sensor = view.sensor ?? start.sensors[0].name, tooth = view.tooth ?? 0;
  const wanted = tooth ? { stiffness_loss: view.stiffness_loss ?? 0, phase_shift_deg: view.phase_shift_deg ?? 0 } : { stiffness_loss: 0, phase_shift_deg: 0 };
  const apart = (one) => 10 * Math.abs(one.stiffness_loss - wanted.stiffness_loss) + Math.abs(one.phase_shift_deg - wanted.phase_shift_deg);
  const among = cases.filter((one) => one.sensor === sensor);
  const [chosen, healthy] = [apart, (one) => one.stiffness_loss + Math.abs(one.phase_shift_deg)].map((cost) => among.reduce((best, one) => cost(one) < cost(best) ? one : best));
  const { arrays, shapes } = decoded(chosen.arrays), reference = decoded(healthy.arrays).arrays, Z = start.rig.teeth, passes = tooth ? tooth - 1 : 0;
  for (const key of ["tsa", "stiffness", "wigner_ville"]) arrays[key] = turned(arrays[key], passes, Z);
  Object.assign(arrays, { tsa_healthy: reference.tsa, stiffness_healthy: reference.stiffness, spectrum_healthy: reference.spectrum });
  const values = chosen.indicators.map((one, i) => ({ ...one, healthy: healthy.indicators[i].value }));
  return { facts: { ...facts, saturated: true, sensor, unit: chosen.unit, damaged: tooth ? [tooth] : [], indicators: values, least_force: chosen.least_force, least_compression: chosen.least_compression, contact: chosen.least_force > 0, milliseconds: { simulation: 0, signature: 0 } }, arrays, shapes };
}

window.sigdbStatic = { request: staticRequest };
