// The grid of mu~ over (v~, y~) that the map draws: values between its nodes, colours, isolines.

const VIRIDIS = ["440154", "482878", "3e4989", "31688e", "26828e", "1f9e89", "35b779", "6ece58", "b5de2b", "fde725"].map((hex) =>
  [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16)));

/** [red, green, blue] of a share from 0 to 1. */
export const colourOf = (share) => {
  const x = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
  const i = Math.min(Math.floor(x), VIRIDIS.length - 2);
  return VIRIDIS[i].map((low, channel) => Math.round(low + (x - i) * (VIRIDIS[i + 1][channel] - low)));
};

export class Grid {
  constructor({ v_tilde, y_tilde, unit, mu_ratio }) {
    Object.assign(this, { v_tilde, y_tilde, unit, values: mu_ratio });
  }

  /** Place in the grid, in cells. */
  cell(v, y) {
    const { v_tilde: a, y_tilde: b } = this;
    const place = ({ start, stop, n }, value) =>
      ((Math.log10(value) - Math.log10(start)) / (Math.log10(stop) - Math.log10(start))) * (n - 1);
    return [place(a, v), place(b, y)];
  }

  node(i, j) {
    return this.values[j * this.v_tilde.n + i] * this.unit;
  }

  interpolate(x, y) {
    const i = Math.min(Math.max(Math.floor(x), 0), this.v_tilde.n - 2);
    const j = Math.min(Math.max(Math.floor(y), 0), this.y_tilde.n - 2);
    const [s, t] = [x - i, y - j];
    return (1 - t) * ((1 - s) * this.node(i, j) + s * this.node(i + 1, j)) + t * ((1 - s) * this.node(i, j + 1) + s * this.node(i + 1, j + 1));
  }

  ratio(v, y) {
    return this.interpolate(...this.cell(v, y));
  }

  paint() {
    const { v_tilde: { n }, y_tilde: { n: m } } = this;
    const [width, height] = [4 * (n - 1), 4 * (m - 1)];
    const image = new ImageData(width, height);
    for (let row = 0; row < height; row += 1) {
      for (let column = 0; column < width; column += 1) {
        const rgb = colourOf(this.interpolate((column + 0.5) / 4, (height - row - 0.5) / 4));
        image.data.set([...rgb, 255], 4 * (row * width + column));
      }
    }
    const canvas = document.createElement("canvas");
    Object.assign(canvas, { width, height });
    canvas.getContext("2d").putImageData(image, 0, 0);
    return canvas;
  }

  /** Segments [x1, y1, x2, y2] in cells where mu~ = level: marching squares, saddles by the mean. */
  isoline(level) {
    const { v_tilde: { n }, y_tilde: { n: m } } = this;
    const found = [];
    for (let j = 0; j < m - 1; j += 1) {
      for (let i = 0; i < n - 1; i += 1) {
        const corners = [this.node(i, j), this.node(i + 1, j), this.node(i + 1, j + 1), this.node(i, j + 1)].map((value) => value - level);
        const places = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
        const cuts = [];
        for (let e = 0; e < 4; e += 1) {
          const [a, b] = [corners[e], corners[(e + 1) % 4]];
          if (a >= 0 === b >= 0) continue;
          const t = a / (a - b);
          const [p, q] = [places[e], places[(e + 1) % 4]];
          cuts.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
        }
        for (let c = 0; c + 1 < cuts.length; c += 2) found.push([...cuts[c], ...cuts[c + 1]]);
      }
    }
    return found;
  }
}
