/** The sources of a calibration's values: what stays keeps its source, and what is changed gets another one. */

const GIVEN = { source: "given" };
const ASSUMED = { source: "assumed" };

/** The words for sources. */
export const SOURCE_WORDS = { measured: "measured", given: "given", assumed: "assumed", from_people: "from people" };

/** The height of a calibration file, or null. */
export const heightOf = (file) => file?.mount?.height_m ?? null;

/** The file with this height, in meters. The same height keeps its source, another one is given, null removes it. */
export function withHeight(file, height) {
  if (height && height === heightOf(file)) return file;
  const { height_m: _, ...mount } = file.mount ?? {};
  const { height_m: __, ...sources } = file.sources ?? {};
  if (!height) return { ...file, mount, sources };
  return { ...file, mount: { ...mount, height_m: height }, sources: { ...sources, height_m: GIVEN } };
}

/** The sources of a file without those of the lens, the center and the level. */
export function otherSources(file) {
  const { lens: _, lens_model: __, field_of_view: ___, center: ____, world_up: _____, ...others } = file?.sources ?? {};
  return others;
}

/** The sources of a circle that was drawn over the file `base`; `isSame` if its lens and level are those of the file. */
export function sourcesOfCircle(base, isSame) {
  return isSame ? { ...base.sources } : { ...otherSources(base), lens: GIVEN, center: GIVEN, world_up: ASSUMED };
}

/** The entries of a found lens and level, with their words. */
const OF_A_FOUND_LENS = { lens: "lens", lens_model: "lens model", field_of_view: "field of view", center: "center", world_up: "tilt" };

/** Says which values of a file a found lens and level replace. Assumed ones are replaced without a notice. */
export function replacedIn(file) {
  const sources = { lens: {}, ...file?.sources };
  const known = Object.keys(OF_A_FOUND_LENS).filter((name) => sources[name] && sources[name].source !== "assumed");
  return file ? known.map((name) => `Replaces the ${SOURCE_WORDS[sources[name].source] ?? "saved"} ${OF_A_FOUND_LENS[name]}.`) : [];
}
