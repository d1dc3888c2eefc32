// The page's reading of texts, its numbers, its address and its questions: node --test, started by
// test_page.py.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import {
  RIGID,
  about,
  attempt,
  caption,
  caseAround,
  caseOf,
  friction,
  fromAddress,
  inUnit,
  movedAlong,
  question,
  readExponent,
  readInterval,
  readPoints,
  readQuantity,
  readValue,
  show,
  startState,
  toAddress,
  valueOf,
} from "../../../service/static/page/inputs.js";

const names = JSON.parse(readFileSync(process.env.PAGE_NAMES, "utf8")); // as the service tells them
Object.assign(about, names);

const near = (value, expected) =>
  assert.ok(Math.abs(value - expected) <= 1e-15 * Math.abs(expected), `${value}, not ${expected}`);

const READ = [
  // input, unit of its field, text: SI value, or part of the reason
  ["y0", "µm", "5 mm", 5e-3],
  ["y0", "µm", "2um", 2e-6],
  ["y0", "µm", "2 μm", 2e-6],
  ["y0", "µm", "2", 2e-6],
  ["y0", "m", "2e-6", 2e-6],
  ["y0", "µm", ".5", 0.5e-6],
  ["Fz", "N", "10N", 10],
  ["Fz", "kN", "3 [N]", 3],
  ["k", "N/m", "1 N/um", 1e6],
  ["k", "N/µm", "300 N/mm", 3e5],
  ["omega", "kHz", "20", 2 * Math.PI * 20e3],
  ["omega", "Hz", "20kHz", 2 * Math.PI * 20e3],
  ["omega", "kHz", "130 krad/s", 1.3e5],
  ["omega", "kHz", "6000 rpm", 2 * Math.PI * 100],
  ["mu0", "-", "30 %", 0.3],
  ["v0", "mm/s", "0", 0],
  ["v0", "mm/s", "−0", 0],
  ["Fz", "N", "1.5E3", 1500],
  ["y0", "µm", "2,9", 2.9e-6],
  ["mu0", "-", "0,125", 0.125],
  ["y0", "µm", "0,2um", 2e-7],
  ["v0", "mm/s", "1,5e3", 1.5],
  ["Fz", "N", "1,500", "can be 1.500 or 1500: write one of them"],
  ["Fz", "N", "1 500", "“500” is not a unit of Fz"],
  ["Fz", "N", "1,500,000", "is not a number"],
  ["Fz", "N", "1.2.3", "is not a number"],
  ["Fz", "N", "", "give a number"],
  ["Fz", "N", "abc", "is not a number"],
  ["Fz", "N", "1e", "“e” is not a unit of Fz: give N, mN, kN"],
  ["Fz", "N", "5 mm", "“mm” is not a unit of Fz"],
  ["Fz", "N", "3 n", "did you mean N?"],
  ["omega", "Hz", "20khz", "did you mean kHz?"],
  ["Fz", "N", "1e999", "too large"],
  ["Fz", "N", "1e-999", "too small"],
  ["Fz", "N", "1e-324 mN", "too small"],
  ["Fz", "N", "-1", "must be finite and > 0"],
  ["Fz", "N", "0", "must be finite and > 0"],
  ["v0", "mm/s", "-1", "must be finite and >= 0"],
  ["k", "N/m", "1e308 N/µm", "must be finite"],
  ["omega", "kHz", "5 1/s", "can be Hz or rad/s"],
  ["mu0", "-", "3 N", "leave it out"],
  ["y0", "µm", "constructor", "is not a number"],
  ["y0", "µm", "5 constructor", "is not a unit"],
  ["k", "N/m", "1..2 mm", "“mm” is not a unit of k"],
  ["k", "N/m", "2..1", "must go up"],
  ["k", "N/m", "1..1", "must go up"],
  ["k", "N/m", "1..rigid", "two numbers"],
  ["k", "N/m", "1..2..3", "not an interval"],
  ["k", "N/m", "..2", "give a number"],
  ["k", "N/µm", "0.8-1.2", "write an interval as 0.8..1.2"],
  ["k", "N/µm", "0.8 – 1.2 N/um", "0.8..1.2 N/um"],
  ["Fz", "N", "1..2", "is not a number"],
];
for (const [name, unit, text, expected] of READ) {
  test(`${name}: “${text}”`, () => {
    const { result, fault } = attempt(() => readValue(name, text, unit));
    if (typeof expected === "string") assert.ok(fault.includes(expected), fault);
    else near(result.low, expected);
  });
}

test("a stiffness is rigid by its word, an interval by two numbers", () => {
  assert.equal(readValue("k", " Rigid ", "N/m"), RIGID);
  for (const [text, unit, shown, ends] of [
    ["0.8..1.2 N/um", "N/m", "0.8..1.2 N/µm", [8e5, 1.2e6]],
    ["1..2", "kN/m", "1..2 kN/m", [1e3, 2e3]],
    ["800 N/mm .. 1.2 N/um", "N/m", "0.8..1.2 N/µm", [8e5, 1.2e6]],
  ]) {
    const read = readValue("k", text, unit);
    assert.equal(read.text, shown);
    ends.forEach((end, i) => near([read.low, read.high][i], end));
  }
  assert.equal(readInterval("mu0", "0.1..0.2", "-").text, "0.1..0.2");
});

test("an argument of a geometry has its units, and its bounds at the service", () => {
  near(readQuantity("radius", "5 mm", "m").low, 5e-3);
  near(readQuantity("E", "210GPa", "Pa").low, 210e9);
  near(readQuantity("nu", "-0.3", "-").low, -0.3);
  assert.match(attempt(() => readQuantity("nu", "0.3 m", "-")).fault, /leave it out/);
  assert.match(attempt(() => readQuantity("E", "210 gpa", "Pa")).fault, /did you mean GPa\?/);
});

for (const [text, expected] of [
  [
    "v0 [mm/s]\tmu_macro\tstd\n1\t0.1\t0.01\n\n2 m/s\t20 %\t0",
    { v0: [1e-3, 2], mu_macro: [0.1, 0.2], std: [0.01, 0] },
  ],
  ["# measured\n1e-3 0.1\r\n0.1   0.2", { v0: [1e-3, 0.1], mu_macro: [0.1, 0.2] }],
  ["mu;speed (um/s)\n0.1;1", { mu_macro: [0.1], v0: [1e-6] }],
  ["1, 0.1, 0.01", { v0: [1], mu_macro: [0.1], std: [0.01] }],
  ["", "paste points"],
  ["1", "two or three columns"],
  ["v0;mu", "paste points"],
  ["1 2 3 4", "two or three columns"],
  ["1 0.1\n2", "line 2 has 1 values, not 2"],
  ["v0\tmu\n1\tx", "line 2, mu_macro: “x” is not a number"],
  ["1;0,25", { v0: [1], mu_macro: [0.25] }],
  ["1,5 0,25\n2 ,3", { v0: [1.5, 2], mu_macro: [0.25, 0.3] }],
  [
    "v0 [mm/s]\tmu\tstd\n1,5\t0,2\t1e-2\n2,5 m/s\t20,5 %\t1,5e-2",
    { v0: [1.5e-3, 2.5], mu_macro: [0.2, 0.205], std: [0.01, 0.015] },
  ],
  ["1,0.25", { v0: [1], mu_macro: [0.25] }],
  ["1, 0.25", { v0: [1], mu_macro: [0.25] }],
  ["1,2", { v0: [1], mu_macro: [2] }],
  ["1,500;0.2", "“1,500” has a decimal comma, “0.2” a decimal point"],
  ["1;1,500,000", "“1,500,000” is not a number"],
  ["1,5,0,2", "two or three columns"],
  ["1,5 0,2\n1.5 0,2", "a decimal point: use one of them"],
  ["v0;mu_macro;mu0\n1;0,2;0,3", { v0: [1], mu_macro: [0.2], mu0: [0.3] }],
  ["µ₀,µ,v₀\n0.3,0.2,1", { mu0: [0.3], mu_macro: [0.2], v0: [1] }],
  ["v0 mu0\n1 0.3", "two or three columns"],
  ["v0;mu;std;mu0\n1;0.2;0.01;0.3", { v0: [1], mu_macro: [0.2], std: [0.01], mu0: [0.3] }],
  ["v0 mu\n1 mm 0.1", "line 2 has 3 values"],
  ["v0;v0\n1;2", "column “v0” is not one of"],
  ["v0;force\n1;2", "column “force” is not one of"],
  ["v0 [N];mu\n1;2", "“N” is not a unit of v₀"],
  ["mu;std\n1;2", "two or three columns"],
]) {
  test(`points: ${JSON.stringify(text)}`, () => {
    const { result, fault } = attempt(() => readPoints(text));
    if (typeof expected === "string") assert.ok(fault?.includes(expected), JSON.stringify(result));
    else {
      assert.deepEqual(Object.keys(result), Object.keys(expected));
      for (const [name, column] of Object.entries(expected))
        column.forEach((value, i) => near(result[name][i], value));
    }
  });
}

test("numbers are short, and as exact as they are known", () => {
  for (const [value, digits, text] of [
    [0.24, 6, "0.24"],
    [1e-5, 3, "1e-5"],
    [123456789, 4, "1.235e8"],
    [0, 6, "0"],
    [Infinity, 3, "∞"],
    [null, 3, "–"],
  ])
    assert.equal(show(value, digits), text);
  assert.equal(friction(0.2405049), "0.2405");
  assert.equal(friction(0.2400049, 0.0146), "0.240");
  assert.equal(friction(0.2405049, 0.3), "0.24");
  assert.equal(friction(0.24, 2.4e-11, 15), "0.240000000000");
  assert.equal(friction(0, 1e-12), "0");
  assert.equal(inUnit("v0", 0.2), "200 mm/s");
  assert.equal(inUnit("power", 0.0134), "13.4 mW");
  assert.equal(inUnit("power", 0), "0 W");
});

test("an address in the words of the command line gives the same state back", () => {
  assert.equal(toAddress(startState()), "#mu0=0.3&Fz=10N&k=1N/um&y0=2um&f=20kHz&v0=10mm/s");
  for (const address of [
    "#mu0=0.3&Fz=10N&k=0.8..1.2N/um&y0=1e-7m&omega=130000rad/s&v0=1e-310m/s&contact=ball" +
      "&digits=all&along=y0&scale=linear&range=1..2000nm",
    "#mu0=0.3&Fz=10N&k=rigid&Fz_amplitude=5N&f=20kHz&v0=10mm/s&direction=normal",
  ]) {
    const { state, faults } = fromAddress(address);
    assert.deepEqual(faults, []);
    assert.equal(toAddress(state), address);
  }
  const { state } = fromAddress("#y0=1e-6&Fz=5&f=1000");
  assert.deepEqual(
    [state.y0, state.Fz, state.omega].map(({ text }) => text),
    ["0.000001 m", "5 N", "1000 Hz"],
  );
});

for (const [address, reason] of [
  ["mu0=-1", "mu0 = -1 (must be finite and > 0)"],
  ["k=", "k = nothing (give a number)"],
  ["v0=5 mm", "v0 = 5 mm (“mm” is not a unit of v₀"],
  ["along=constructor", "along = constructor (must be one of"],
  ["scale=<script>", "scale = <script> (must be one of log, linear)"],
  ["omega=1&f=1", "f = 1 (omega is given, too)"],
  [
    "std_mu0=1&range=z",
    "range = z (“z” is not an interval: write low..high); std_mu0 = 1 (unknown)",
  ],
  ["along=k&range=1..rigid", "range = 1..rigid (must be an interval of two numbers)"],
  ["direction=normal&y0=1um", "y0 = 1um (unknown)"],
  ["contact=box", "contact = box (must be one of spring, ball)"],
  ["contact=ball&direction=normal", "direction = normal (not for a ball)"],
]) {
  test(`a link with ${address} is reported`, () => {
    const { state, faults } = fromAddress(
      `#${encodeURIComponent(address).replace(/%(3D|26)/g, decodeURIComponent)}`,
    );
    assert.ok(faults.join("; ").includes(reason), faults.join("; "));
    assert.ok(Number.isFinite(caseOf(state).mu0));
  });
}

test("the question says what was chosen, and nothing else", () => {
  const plain = question(startState());
  assert.deepEqual(Object.keys(plain), ["mu0", "Fz", "k", "y0", "omega", "v0", "include"]);
  const { state } = fromAddress("#k=0.8..1.2N/um&contact=ball&direction=along");
  const inputs = question(state);
  assert.deepEqual([inputs.contact, inputs.direction, "k" in inputs], ["ball", "along", false]);
  inputs.k_range.forEach((value, i) => near(value, [8e5, 1.2e6][i]));
  near(caseOf(state).k, Math.sqrt(8e5) * Math.sqrt(1.2e6));
  near(valueOf(state, "k"), caseOf(state).k);
  const normal = question(fromAddress("#direction=normal&k=rigid").state);
  assert.deepEqual([normal.Fz_amplitude, normal.k, "y0" in normal], [5, "rigid", false]);
  assert.deepEqual(
    [plain, normal].map(({ include }) => include.includes("power")),
    [true, false],
  );
});

test("an exponent of the stiffness is a number or a fraction, or is left out", () => {
  for (const [text, value] of [
    ["0.5", 0.5],
    [" 1/3 ", 1 / 3],
    ["1 / 2", 0.5],
    ["0", 0],
    ["1,5", 1.5],
    ["", undefined],
  ]) {
    assert.equal(readExponent(text).value, value);
  }
  for (const [text, reason] of [
    ["x", "is not a number"],
    ["1/x", "is not a number"],
    ["1/0", "is not a number"],
    ["1/2/3", "is not a number"],
    ["1/", "give a number"],
    ["0.5 N", "m has no unit"],
  ])
    assert.ok(attempt(() => readExponent(text)).fault.includes(reason), text);
});

test("a question about Fz holds the load at which k holds where k grows with it", () => {
  const state = { ...startState(), stiffness_exponent: readExponent("1/2") };
  const { Fz, stiffness_exponent: exponent } = caseAround(state, "Fz");
  assert.deepEqual([Fz, exponent], [10, 0.5]);
  assert.equal(caseAround({ ...startState(), contact: "ball" }, "Fz").stiffness_exponent, 1 / 3);
  for (const [constant, name] of [
    [startState(), "Fz"],
    [state, "v0"],
    [{ ...state, stiffness_exponent: readExponent("0") }, "Fz"],
  ]) {
    const inputs = caseAround(constant, name);
    assert.deepEqual([name in inputs, "stiffness_exponent" in inputs], [false, false]);
  }
  assert.ok(caption(state, "Fz").endsWith("k at Fz = 10 N, growing as Fz^(1/2)"));
  assert.ok(!caption(state, "v0").includes("growing"));
});

test("a move along Fz takes k along", () => {
  const state = {
    ...startState(),
    stiffness_exponent: readExponent("1/2"),
    k: readValue("k", "0.8..1.2 N/um"),
  };
  const { Fz, k } = movedAlong(state, "Fz", 40, 4);
  assert.deepEqual([Fz.text, k.text], ["40 N", "1.6..2.4 N/µm"]);
  assert.deepEqual(Object.keys(movedAlong(state, "v0", 1, 4)), ["v0"]);
  for (const without of [{ stiffness_exponent: readExponent("") }, { k: RIGID }]) {
    assert.deepEqual(Object.keys(movedAlong({ ...state, ...without }, "Fz", 40, 4)), ["Fz"]);
  }
});

test("the exponent is a part of the address", () => {
  const address = toAddress({ ...startState(), stiffness_exponent: readExponent("1/2") });
  assert.ok(address.endsWith("&stiffness_exponent=1/2"));
  assert.equal(fromAddress(address).state.stiffness_exponent.value, 0.5);
  assert.deepEqual(fromAddress("#stiffness_exponent=x").faults, [
    "stiffness_exponent = x (“x” is not a number)",
  ]);
});
