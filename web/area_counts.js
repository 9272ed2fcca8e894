/** The persons in a zone, counted on the page: a zone has a count before it is saved. */

import { foot, holds, pointBelow } from "./geometry.js";

/** The number of persons of `report` in a zone of a calibration file; null if the report cannot give it. */
export function personsIn({ space, corners }, report, file) {
  if (!report) return null;
  const { image } = file;
  const below = pointBelow(file, report);
  const [scaleX, scaleY] = [image.width / report.image.width, image.height / report.image.height];
  const placeOf = (person) => {
    if (space === "floor_m") return person.floor && [person.floor.x_m, person.floor.y_m];
    const [x, y] = foot(person, below);
    return [x * scaleX, y * scaleY];
  };
  return report.persons.map(placeOf).filter((place) => place && holds(corners, place)).length;
}
