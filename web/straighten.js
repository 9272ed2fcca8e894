/** Straightens a frame with a grid: the server returns the positions of its nodes in the frame for any lens. */

/** The color outside the lens image and the frame: black. */
const BEYOND = [0, 0, 0, 255];

/**
 * Draws a view into `target` (`ImageData`) from the pixels of a frame (`ImageData`). `grid` has
 * `(cells + 1)²` nodes, row by row, in pixels of a frame that is `frameWidth` wide; null beyond the lens image.
 */
export function straighten(pixels, frameWidth, grid, cells, target) {
  const places = continued(grid, cells);
  const scale = pixels.width / frameWidth;
  const { width, height, data } = target;
  for (let y = 0; y < height; y += 1) {
    const [row, down] = cellAt((y + 0.5) / height, cells);
    for (let x = 0; x < width; x += 1) {
      const [column, right] = cellAt((x + 0.5) / width, cells);
      const node = row * (cells + 1) + column;
      const below = node + cells + 1;
      const place = [0, 1].map((axis) => {
        const top = places[node][axis] * (1 - right) + places[node + 1][axis] * right;
        const bottom = places[below][axis] * (1 - right) + places[below + 1][axis] * right;
        return (top * (1 - down) + bottom * down) * scale - 0.5;
      });
      sample(pixels, place[0], place[1], data, 4 * (y * width + x));
    }
  }
}

/** The cell that contains a fraction of a side, and the fraction within the cell. */
function cellAt(share, cells) {
  const cell = Math.min(Math.floor(share * cells), cells - 1);
  return [cell, share * cells - cell];
}

/** Extrapolates nodes beyond the lens image linearly, so that the drawing covers the lens image up to its border. */
export function continued(grid, cells) {
  const side = cells + 1;
  const places = [...grid];
  const steps = [1, -1, side, -side];
  let open = places.flatMap((place, index) => (place ? [] : [index]));
  while (open.length) {
    const found = [];
    for (const index of open) {
      const column = index % side;
      for (const step of steps) {
        const last = index + 2 * step;
        const turns = Math.abs(step) === 1 && (column + 2 * step < 0 || column + 2 * step >= side);
        const [near, far] = [places[index + step], places[last]];
        if (turns || !near || !far) continue;
        found.push([index, [2 * near[0] - far[0], 2 * near[1] - far[1]]]);
        break;
      }
    }
    if (!found.length) break;
    for (const [index, place] of found) places[index] = place;
    open = open.filter((index) => !places[index]);
  }
  return places.map((place) => place ?? [NaN, NaN]);
}

/** Copies the bilinear sample at a position (pixel centers). */
function sample({ data, width, height }, x, y, target, at) {
  const inside = x >= -0.5 && y >= -0.5 && x <= width - 0.5 && y <= height - 0.5;
  if (!inside) {
    target.set(BEYOND, at);
    return;
  }
  const left = Math.min(Math.max(Math.floor(x), 0), width - 2);
  const top = Math.min(Math.max(Math.floor(y), 0), height - 2);
  const [right, down] = [Math.min(Math.max(x - left, 0), 1), Math.min(Math.max(y - top, 0), 1)];
  const first = 4 * (top * width + left);
  const below = first + 4 * width;
  for (let channel = 0; channel < 3; channel += 1) {
    const upper = data[first + channel] * (1 - right) + data[first + 4 + channel] * right;
    const lower = data[below + channel] * (1 - right) + data[below + 4 + channel] * right;
    target[at + channel] = upper * (1 - down) + lower * down;
  }
  target[at + 3] = 255;
}

/** Returns a canvas with the view, `side` pixels along its longer side. */
export function viewCanvas(view, cells, frame, frameWidth, side) {
  const [width, height] = view.size.map((own) => Math.round((own / Math.max(...view.size)) * side));
  const canvas = document.createElement("canvas");
  Object.assign(canvas, { width, height });
  const context = canvas.getContext("2d");
  const target = context.createImageData(width, height);
  straighten(frame.pixels, frameWidth, view.grid, cells, target);
  context.putImageData(target, 0, 0);
  return canvas;
}
