// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// Distances between points of the cloud that is shown. A point is known by its record in the PLY.

function pointOf(ply, record) {
  const from = new DataView(ply.buffer, ply.begin + record * ply.record, ply.record);
  const value = (name) => ply.fields[name] ? get(from, ply.fields[name].offset, ply.fields[name].type) : undefined;
  return {record, at: [value("x"), value("y"), value("z")], sigma: value("sigma_mm") ?? NaN, first: !value("camera")};
}

// One standard deviation: each point is uncertain along its ray, and of that what points along the line between them counts.
// Rays of other cameras than the first do not come from the origin: theirs counts in full.
function distanceOf(a, b) {
  const between = a.at.map((value, axis) => b.at[axis] - value);
  const distance = Math.hypot(...between);
  const along = (point) => {
    if (!point.first || distance === 0) return point.sigma;
    const length = Math.hypot(...point.at);
    return point.sigma * Math.abs(point.at.reduce((sum, value, axis) => sum + value * between[axis], 0)) / length / distance;
  };
  return {a, b, between, distance, sigma: Math.hypot(along(a), along(b))};
}

class Measurements {
  // onChange() when what is to be drawn has changed.
  constructor(list, status, onChange) {
    [this.list, this.status, this.onChange] = [list, status, onChange];
    this.clear();
  }

  clear() {
    this.distances = [];
    this.pending = null;  // the first point of the next distance
    this.status.textContent = "";
    this.show();
  }

  // @param point  of pointOf(), or null where there is none
  add(point) {
    if (!point) {
      this.status.textContent = "No point there.";
      return;
    }
    if (this.pending) {
      const made = distanceOf(this.pending, point);
      this.distances.push(made);
      this.pending = null;
      this.status.textContent = `${made.distance.toFixed(2)} mm ± ${made.sigma.toFixed(2)} mm (one standard deviation)`;
    } else {
      this.pending = point;
      this.status.textContent = "Now press the second point.";
    }
    this.show();
  }

  remove(index) {
    this.distances.splice(index, 1);
    this.status.textContent = "";
    this.show();
  }

  points() {
    return [...this.distances.flatMap(({a, b}) => [a, b]), ...(this.pending ? [this.pending] : [])];
  }

  show() {
    this.list.hidden = this.distances.length === 0;
    this.list.tBodies[0].replaceChildren(...this.distances.map((made, index) => {
      const row = element("tr", ""), remove = element("button", "×");
      remove.setAttribute("aria-label", `Remove distance ${index + 1}`);
      remove.addEventListener("click", () => this.remove(index));
      const numbers = [made.distance, made.sigma, ...made.between].map((value) => element("td", value.toFixed(2)));
      const last = element("td", "");
      last.append(remove);
      row.append(element("th", String(index + 1)), ...numbers, last);
      return row;
    }));
    this.onChange();
  }
}
