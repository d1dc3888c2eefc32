// Numbers as the page writes them, and the state as an address: node --test, started by
// test_page.py.  PAGE_NAMES is the file names.json of the service.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { describe, test } from "node:test";
import vm from "node:vm";

const STATIC = new URL("../../../service/static/", import.meta.url);
for (const name of ["array", "format"])
  vm.runInThisContext(readFileSync(new URL(`lib/d3-${name}.min.js`, STATIC), "utf8"));
// what the state looks for in a browser
globalThis.addEventListener = () => {};
const words = await import(new URL("page/words.js", STATIC));
const state = await import(new URL("page/state.js", STATIC));
Object.assign(words.about, JSON.parse(readFileSync(process.env.PAGE_NAMES, "utf8")));
state.useStart(words.about.start);

describe("a number for people", () => {
  const cases = [
    [() => words.show(0.24046650645751833), "0.2405"],
    [() => words.show(-2.5e-9, 2), "−2.5e-9"],
    [() => words.show(null), "–"],
    [() => words.show(Infinity), "∞"],
    [() => words.show(0), "0"],
    [() => words.prefixed(0.013402857, "W"), "13.4 mW"],
    [() => words.prefixed(68.677865e-3, "m/s", 3), "68.7 mm/s"],
    [() => words.prefixed(0, "W"), "0 W"],
    [() => words.prefixed(-3.2e-6, "W", 2), "−3.2 µW"],
    [() => words.prefixed(null, "W"), "– W"],
    [() => words.prefixed(1e-300, "W"), "1e-300 W"],
    [() => words.inUnit("y0", 2e-6, "um"), "2 µm"],
    [() => words.inUnit("y0", 2.866e-6), "2.866 µm"],
    [() => words.inUnit("k", 1e6), "1 N/µm"],
    [() => words.around(1e6), "0.9..1.1 N/µm"],
    [() => words.around(5e5), "0.45..0.55 N/µm"],
    [() => words.inUnit("mu0", 0.3), "0.3"],
    [() => words.friction(0.24046650645751833, 4), "0.2405"],
    [() => words.friction(0.1, 4), "0.1000"],
    [() => words.friction(0, 4), "0"],
    [() => words.friction(2.208e-5, 4), "2.208e-5"],
    [() => words.percent(0.8016), "80 %"],
    [() => words.percent(0.9989), "99.9 %"],
    [() => words.percent(0.99996), "100 %"],
    [() => words.percent(1), "100 %"],
    [() => words.percent(0.0034), "0.34 %"],
    [() => words.capital("a ball"), "A ball"],
    [() => words.capital("k decides most"), "k decides most"],
    [() => words.percent(1.12), "112 %"],
    [() => words.left("80 %"), "80 % of µ₀ is left"],
    [() => words.left("100 %", "about "), "About all of µ₀ is left"],
    [() => words.left(words.percent(0)), "Nothing of µ₀ is left"],
    [() => words.capital("v₀ is large"), "v₀ is large"],
    [() => words.withDeviation(0.240466, 0.01432).join(" ± "), "0.240 ± 0.014"],
    [() => words.withEnds(0.034596, 0.299667).join(" to "), "0.035 to 0.300"],
    [() => words.withEnds(0.22601, 0.25312).join(" to "), "0.2260 to 0.2531"],
    [() => words.withEnds(2.1e-6, 0.3).join(" to "), "2.1e-6 to 0.300"],
    [() => words.withUnit("y0", "2.9", "um"), "2.9 µm"],
    [() => words.withUnit("f", "20", "kHz"), "20 kHz"],
    [() => words.withUnit("f", "20", null), "20 Hz"],
    [() => words.withUnit("k", "1 ± 0.1", "N/um"), "1 ± 0.1 N/µm"],
    [() => words.withUnit("k", "1 +- 10 %", "N/um"), "1 N/µm +- 10 %"],
    [() => words.withUnit("k", "0.8..1.2", "N/um"), "0.8..1.2 N/µm"],
    [() => words.withUnit("k", "8e5 .. 1.2e6", "N/m"), "8e5 .. 1.2e6 N/m"],
    [() => words.withUnit("v0", "1,5e1", "mm/s"), "1,5e1 mm/s"],
    [() => words.withUnit("y0", "2 nm", "um"), "2 nm"],
    [() => words.withUnit("mu0", "0.3 ± 0.02", "-"), "0.3 ± 0.02"],
    [() => words.withUnit("y0", "much", "um"), "much"],
    [() => words.withUnit("y0", "", "um"), ""],
    [() => words.digitsWithin(0.24, 1e-13), 12],
    [() => words.digitsWithin(0.24, 0), 15],
  ];
  for (const [make, text] of cases) test(`${make} is ${text}`, () => assert.equal(make(), text));
  test("units are scales there and back", () => {
    for (const [name, { units, offered }] of Object.entries(words.about.inputs)) {
      for (const unit of offered) assert.ok(unit in units, `${name} in ${unit}`);
      for (const unit of Object.keys(units)) {
        const back = words.toSI(name, words.toUnit(name, 3.7, unit), unit);
        assert.ok(Math.abs(back / 3.7 - 1) < 1e-15, `${name} in ${unit}`);
      }
    }
  });
});

describe("the address holds the case", () => {
  const asked = (hash) => state.caseOf(state.fromAddress(hash).state);
  test("of the start", () => {
    assert.deepEqual(asked(""), {
      mu0: "0.3",
      Fz: "10 N",
      k: "1 N/µm",
      y0: "2 µm",
      f: "20 kHz",
      v0: "10 mm/s",
      contact: "spring",
      direction: "across",
    });
  });
  const addresses = [
    "#mu0=0.3±0.02&k=0.8..1.2 N/um&contact=ball&direction=along&digits=all",
    "#direction=normal&Fz_amplitude=3 N&along=Fz_amplitude&scale=linear&from=1 N&to=9 N",
    "#k=rigid&target=0.15&quantity=mu_macro&unknown=v0",
    "#y0=2 %26 3&v0=1 %2B- 0.1 mm/s",
    "#f=20&exponent=1/3&along=Fz",
  ];
  for (const address of addresses)
    test(`there and back: ${address}`, () => {
      const first = state.fromAddress(address).state;
      const again = state.fromAddress(state.toAddress(first)).state;
      assert.deepEqual(state.caseOf(again), state.caseOf(first));
      assert.equal(state.toAddress(again), state.toAddress(first));
    });
  test("what the page does not know is named", () => {
    for (const name of ["constructor", "toString", "__proto__"]) {
      const { unknown: names } = state.fromAddress(`#${name}=1&mu0=0.4`);
      assert.deepEqual(names, [`${name}=1`]);
    }
    const { state: read, unknown } = state.fromAddress("#mu0=0.4&omega=3&contact=box");
    assert.equal(read.mu0, "0.4");
    assert.deepEqual(unknown, ["omega=3", "contact=box"]);
  });
  test("a rigid contact is asked by its word, and the earlier k comes back", () => {
    const { state: rigid } = state.fromAddress("#k=rigid&contact=ball");
    assert.equal(rigid.contact, "rigid");
    assert.equal(state.caseOf(rigid).k, "rigid");
    assert.equal(state.caseOf({ ...rigid, contact: "spring" }).k, "1 N/µm");
  });
  test("what is swept or unknown is an input of the direction", () => {
    const { state: read } = state.fromAddress("#direction=normal&along=y0&unknown=y0");
    assert.deepEqual([read.along, read.unknown], ["Fz_amplitude", "Fz_amplitude"]);
  });
});
