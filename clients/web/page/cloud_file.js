// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
"use strict";

// The clouds as slsd writes them (docs/formats.md). Both readers give the same: a PLY, and how to make the organised PCD
// of it; and as `cells` the record of the point in each cell of the organised cloud, -1 where there is none. Clouds of symbols come as PLY, whose points say where on the lattice they are; clouds of pixels come as PCD when
// they are scanned or live on a map, else as PLY, which does not say it.

function readCloud(buffer) {
  const begin = new TextDecoder("latin1").decode(new Uint8Array(buffer, 0, Math.min(6, buffer.byteLength)));
  if (begin.startsWith("# .PCD")) {
    const {plyBuffer, cells} = plyOfPixels(buffer);
    return Object.assign(readPly(plyBuffer), {cells, pcd: () => [buffer]});
  }
  const ply = readPly(buffer);
  const onLattice = ply.fields.column && ply.fields.row && ply.comments.lattice_columns;
  return Object.assign(ply, {cells: onLattice ? cellsOfSymbols(ply) : null, pcd: onLattice ? () => pcdOfSymbols(ply) : null});
}

const kSizes = {float: 4, uchar: 1, int: 4};

// A binary little-endian PLY as slsd writes it: a header, and one record a point.
function readPly(buffer) {
  const bytes = new Uint8Array(buffer);
  const head = new TextDecoder("latin1").decode(bytes.subarray(0, 4096));
  const end = head.indexOf("end_header\n");
  if (end < 0) throw new Error("the cloud is not a PLY");
  const header = head.slice(0, end);
  const count = Number(/^element vertex (\d+)$/m.exec(header)[1]);
  const fields = {};
  let record = 0;
  for (const [, type, name] of header.matchAll(/^property (\w+) (\w+)$/gm)) {
    fields[name] = {type, offset: record};
    record += kSizes[type];
  }
  const begin = end + "end_header\n".length;
  if (buffer.byteLength < begin + count * record) throw new Error("the cloud is cut off");
  const comments = Object.fromEntries([...header.matchAll(/^comment (\w+) (.*)$/gm)].map(([, name, value]) => [name, value]));
  return {buffer, begin, count, record, fields, comments};
}

const kNameInPcd = {nx: "normal_x", ny: "normal_y", nz: "normal_z"};
const kNameInPly = Object.fromEntries(Object.entries(kNameInPcd).map(([ply, pcd]) => [pcd, ply]));
const kTypeInPcd = {float: "F", uchar: "U", int: "I"};
const kFirstLine = "# .PCD v0.7 - Point Cloud Data file format";

// A PCD has a colour as one number, 0 red green blue from its highest byte: the PLY's bytes backwards.
const kColours = ["red", "green", "blue"];

// Organised: the lattices of the cameras one below the other, NaN where there is no point. Readers of PCD expect the
// intensity as a float.
function pcdOfSymbols(ply) {
  const columns = Number(ply.comments.lattice_columns), rows = Number(ply.comments.lattice_rows);
  const from = new DataView(ply.buffer, ply.begin);
  let cameras = Number(ply.comments.cameras || 1), record = 0;
  const fields = Object.entries(ply.fields).filter(([name]) => !kColours.includes(name)).map(([name, {type, offset}]) => {
    const field = {name, type, offset, typeInPcd: name === "intensity" ? "float" : type, offsetInPcd: record};
    record += kSizes[field.typeInPcd];
    return field;
  });
  const colour = kColours.map((name) => ply.fields[name]), offsetOfColour = record;
  if (colour[0]) record += 4;
  const {camera, column, row} = ply.fields;
  for (let i = 0; i < ply.count; ++i) cameras = Math.max(cameras, 1 + from.getUint8(i * ply.record + camera.offset));
  const cells = new Uint8Array(cameras * rows * columns * record), to = new DataView(cells.buffer);
  const known = {camera: (cell) => Math.floor(cell / (rows * columns)), row: (cell) => Math.floor(cell / columns) % rows,
                 column: (cell) => cell % columns, intensity: () => 0};
  for (let cell = 0, at = 0; cell < cameras * rows * columns; ++cell, at += record) {
    for (const {name, typeInPcd, offsetInPcd} of fields)
      put(to, at + offsetInPcd, typeInPcd, known[name] ? known[name](cell) : typeInPcd === "float" ? NaN : 0);
  }
  for (let i = 0, at = 0; i < ply.count; ++i, at += ply.record) {
    const place = [from.getInt32(at + column.offset, true), from.getInt32(at + row.offset, true)];
    if (place[0] < 0 || place[0] >= columns || place[1] < 0 || place[1] >= rows) continue;
    const cell = (from.getUint8(at + camera.offset) * rows + place[1]) * columns + place[0];
    for (const {type, offset, typeInPcd, offsetInPcd} of fields)
      put(to, cell * record + offsetInPcd, typeInPcd, get(from, at + offset, type));
    if (colour[0]) colour.forEach(({offset}, i) => to.setUint8(cell * record + offsetOfColour + 2 - i, from.getUint8(at + offset)));
  }
  const all = colour[0] ? [...fields, {name: "rgb", typeInPcd: "float"}] : fields;
  const told = ["scan_id", "time", "frame", "sigma_calibration_mm", "units", "coordinate_frame"];
  const header = [kFirstLine, ...told.filter((name) => name in ply.comments).map((name) => `# ${name} ${ply.comments[name]}`),
    "VERSION 0.7", "FIELDS " + all.map(({name}) => kNameInPcd[name] || name).join(" "),
    "SIZE " + all.map(({typeInPcd}) => kSizes[typeInPcd]).join(" "),
    "TYPE " + all.map(({typeInPcd}) => kTypeInPcd[typeInPcd]).join(" "), "COUNT " + all.map(() => 1).join(" "),
    "WIDTH " + columns, "HEIGHT " + cameras * rows, "VIEWPOINT 0 0 0 1 0 0 0", "POINTS " + cameras * columns * rows,
    "DATA binary", ""].join("\n");
  return [header, cells];
}

// The lattices of the cameras one below the other.
function cellsOfSymbols(ply) {
  const columns = Number(ply.comments.lattice_columns), rows = Number(ply.comments.lattice_rows);
  const from = new DataView(ply.buffer, ply.begin), {camera, column, row} = ply.fields;
  let cameras = 1;
  for (let i = 0; i < ply.count; ++i) cameras = Math.max(cameras, 1 + from.getUint8(i * ply.record + camera.offset));
  const at = new Int32Array(cameras * rows * columns).fill(-1);
  for (let i = 0, base = 0; i < ply.count; ++i, base += ply.record) {
    const place = [from.getInt32(base + column.offset, true), from.getInt32(base + row.offset, true)];
    if (place[0] < 0 || place[0] >= columns || place[1] < 0 || place[1] >= rows) continue;
    at[(from.getUint8(base + camera.offset) * rows + place[1]) * columns + place[0]] = i;
  }
  return {columns, rows: cameras * rows, at, firstRow: Array.from({length: cameras}, (_, i) => i * rows)};
}

function get(view, at, type) {
  return type === "float" ? view.getFloat32(at, true) : type === "int" ? view.getInt32(at, true) : view.getUint8(at);
}

function put(view, at, type, value) {
  if (type === "float") view.setFloat32(at, value, true);
  else if (type === "int") view.setInt32(at, value, true);
  else view.setUint8(at, value);
}

// The measured pixels of an organised PCD, as the PLY that slsd writes of the same cloud; and where each of them is.
function plyOfPixels(buffer) {
  const head = new TextDecoder("latin1").decode(new Uint8Array(buffer, 0, Math.min(4096, buffer.byteLength)));
  const end = head.indexOf("\nDATA binary\n");
  if (end < 0) throw new Error("the cloud is not a PCD");
  const words = (key) => new RegExp(`^${key} (.*)$`, "m").exec(head)[1].split(" ");
  const count = Number(words("POINTS")[0]), begin = end + "\nDATA binary\n".length;
  const sizes = words("SIZE").map(Number), types = words("TYPE");
  let record = 0, recordInPly = 0;
  const fields = words("FIELDS").flatMap((nameInPcd, i) => {
    if (nameInPcd === "rgb") {
      const bytes = kColours.map((name, c) =>
        ({name, type: "uchar", offset: record + 2 - c, typeInPly: "uchar", offsetInPly: recordInPly + c}));
      [record, recordInPly] = [record + 4, recordInPly + 3];
      return bytes;
    }
    const name = kNameInPly[nameInPcd] || nameInPcd, type = types[i] === "F" ? "float" : types[i] === "I" ? "int" : "uchar";
    const typeInPly = name === "intensity" ? "uchar" : type;
    const field = {name, type, offset: record, typeInPly, offsetInPly: recordInPly};
    [record, recordInPly] = [record + sizes[i], recordInPly + kSizes[typeInPly]];
    return [field];
  });
  if (buffer.byteLength < begin + count * record) throw new Error("the cloud is cut off");
  const from = new DataView(buffer, begin), records = new Uint8Array(count * recordInPly), to = new DataView(records.buffer);
  const z = fields.find(({name}) => name === "z"), camera = fields.find(({name}) => name === "camera");
  const columns = Number(words("WIDTH")[0]), cells = new Int32Array(count).fill(-1), firstRow = [];
  let points = 0, cameras = 0;
  for (let at = 0, cell = 0, end = count * record; at < end; at += record, ++cell) {
    const which = from.getUint8(at + camera.offset);
    if (which >= cameras) [cameras, firstRow[which]] = [which + 1, Math.floor(cell / columns)];
    if (Number.isNaN(from.getFloat32(at + z.offset, true))) continue;
    for (const {type, offset, typeInPly, offsetInPly} of fields)
      put(to, points * recordInPly + offsetInPly, typeInPly, get(from, at + offset, type));
    cells[cell] = points++;
  }
  const header = new TextEncoder().encode(["ply", "format binary_little_endian 1.0",
    ...[...head.slice(0, end).matchAll(/^# (?!\.PCD)(.*)$/gm)].map(([, told]) => "comment " + told),
    "comment cameras " + cameras, "element vertex " + points,
    ...fields.map(({name, typeInPly}) => `property ${typeInPly} ${name}`), "end_header", ""].join("\n"));
  const ply = new Uint8Array(header.length + points * recordInPly);
  ply.set(header);
  ply.set(records.subarray(0, points * recordInPly), header.length);
  return {plyBuffer: ply.buffer, cells: {columns, rows: count / columns, at: cells, firstRow}};
}
