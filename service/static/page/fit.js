// The panel "k from measured friction": a table pasted or dropped, what the service read of it, and
// the fit with its residuals.
import { Channel } from "./ask.js";
import d3 from "./d3.js";
import { $, tell, write } from "./dom.js";
import { html, nothing, render } from "../lib/lit-html.js";
import { Plot, circleAt } from "./plot.js";
import { post } from "./service.js";
import { exactCase } from "./state.js";
import { about, inPrint, inUnit, prose, show, toSI, toUnit, unitFor, whole } from "./words.js";

const { area } = d3;

const SIX = 6; // digits of a fitted value, at most
const ROWS = 6; // of the table that was read, which are shown
const KEY = 26; // pixels above the frame, for what the signs mean
const STRIP = 84; // pixels below its axis, for the residuals
/** What a fit takes from the table beside the inputs. */
const MEASURED = ["mu_macro", "std"];

/** The bytes of a file as base64. */
async function encoded(file) {
  const url = await new Promise((done, fail) => {
    const reader = new FileReader();
    reader.onload = () => done(reader.result);
    reader.onerror = () => fail(reader.error);
    reader.readAsDataURL(file);
  });
  return url.slice(url.indexOf(",") + 1);
}

export function fitPanel(store, moved, openCase) {
  let source = { points: "" }; // what is sent: a text, or the bytes of a file
  let table, fit, answer;
  let asked = false; // whether the points are fitted as soon as they and their case are read
  const plot = new Plot($("fit-plot"), paint);
  /** How the table is written, as far as it is chosen; a text has its encoding already. */
  const dialect = () =>
    Object.fromEntries(
      ["sep", "decimal", ...(source.points_base64 ? ["encoding"] : [])]
        .map((name) => [name, $(`points-${name}`).value])
        .filter(([, value]) => value),
    );
  /** A column of the table in SI; mu_macro and its deviation may be in per cent. */
  const column = (name) => {
    const unit = table.units[name];
    const like = MEASURED.includes(name) ? "mu0" : name;
    return unit ? table.columns[name].map((one) => toSI(like, one, unit)) : table.columns[name];
  };
  /** A reason in the words of the service: it names columns as they are typed, and not what has
   * the points, which is seen. */
  const say = (text, calm) => tell("fit-status", text?.replace(/^points(_base64)?: /, ""), calm);

  /** What is asked: the case above without what the table has and what is unknown. */
  function question(more = {}) {
    const unknowns = $("unknowns")
      .value.split(" ")
      .filter((name) => !(table && Object.hasOwn(table.columns, name)));
    const columns = table ? Object.keys(table.columns) : [];
    const body = exactCase(store.state, answer, [
      "v0",
      ...unknowns,
      ...columns.map((name) => (name === "omega" ? "f" : name)),
    ]);
    return { ...body, unknowns, ...source, ...dialect(), ...more };
  }

  const readings = new Channel(
    (body) => post("v1/fit", body),
    (reply) => {
      table = reply;
      fit = undefined;
      say("");
      draw();
      fitIfAsked();
    },
    (reason, calm) => {
      if (reason && !calm) {
        table = fit = undefined;
        draw();
      }
      say(reason, calm);
    },
  );
  const fits = new Channel(
    (body) => post("v1/fit", body),
    (reply, body) => {
      fit = { ...reply, question: body };
      say("");
      draw();
    },
    say,
  );
  /** Fits the points of the example when they are read, and its case is answered. */
  function fitIfAsked() {
    if (!asked || !table || answer?.state !== store.state) return;
    asked = false;
    fits.push(question());
  }
  const read = () => {
    const empty = !(source.points?.trim() || source.points_base64);
    if (empty) {
      table = fit = undefined;
      say("");
      draw();
    } else readings.push({ ...question(), read_only: true });
  };

  /**
   * Values of k or µ₀ as texts, all in one unit and with so many decimals that two digits of their
   * distances are seen; k may be rigid.
   */
  function together(name, all) {
    const numbers = all.filter((one) => typeof one === "number");
    const [least, most] = [Math.min(...numbers), Math.max(...numbers)];
    const unit = unitOf(name);
    const width = toUnit(name, most - least, unit) || toUnit(name, most, unit) / 1000 || 1;
    const sharp = 2 - Math.ceil(Math.log10(width));
    const whole = SIX - 1 - Math.floor(Math.log10(toUnit(name, most, unit) || 1));
    const places = Math.max(Math.min(sharp, whole), 0);
    const words = unit === "-" ? "" : ` ${inPrint(unit)}`;
    const text = (one) =>
      typeof one === "number"
        ? toUnit(name, one, unit).toFixed(places) + words
        : one === null
          ? "∞"
          : one;
    return all.map(text);
  }
  /** The unit of a fitted value in this card: that of the best one. */
  function unitOf(name) {
    const [low, high] = fit.interval[name];
    const known = [fit.values[name], low, high].find((one) => typeof one === "number" && one > 0);
    return unitFor(name, known ?? 1);
  }
  /** A warning, with its stiffnesses in the unit of this card. */
  const warning = (words) =>
    prose(
      words
        .replace(/([\d.]+(?:e[+-]?\d+)?) N\/m\b/g, (_, k) => inUnit("k", Number(k), unitOf("k"), 3))
        .replace(
          /\bk = ([\d.]+(?:e[+-]?\d+)?)/g,
          (_, k) => `k = ${inUnit("k", Number(k), unitOf("k"))}`,
        ),
    );

  function result() {
    if (!fit) return nothing;
    const { values, std, interval, solutions, warnings, reduced_chi2: scatter } = fit;
    const names = Object.keys(values).filter((name) => values[name] !== null);
    const symbol = (name) => about.inputs[name].symbol;
    const best = names.map((name) => {
      const [value, low, high] = together(name, [values[name], ...interval[name]]);
      const known = std[name] === null ? ", not determined" : "";
      const [number, unit] = low.split(" ");
      const from = unit && high.endsWith(` ${unit}`) ? number : low;
      return `${symbol(name)} = ${value}${known} (95 %: ${from} to ${high})`;
    });
    const equals = (name, one) =>
      `${symbol(name)} = ${together(name, [one[name], values[name]])[0]}`;
    const use = (one) => () => {
      const numbers = Object.entries(one).filter(
        ([name, value]) => names.includes(name) && typeof value === "number",
      );
      moved(Object.fromEntries(numbers), 6, one.k === "rigid" ? { contact: "rigid" } : {});
    };
    const line = (words, one) =>
      html`<li>
        <span>${whole(words)}</span
        ><button class="use" aria-label=${`Use ${words}`} @click=${use(one)}>Use</button>
      </li>`;
    return [
      line(whole(best.join("; ")), values),
      ...solutions
        .slice(1)
        .map((other) =>
          line(
            `The points allow as well: ${names.map((name) => equals(name, other)).join(", ")}`,
            other,
          ),
        ),
      fit.question && table?.columns.std && scatter !== null
        ? html`<li>reduced χ² = ${show(scatter, 3)}</li>`
        : nothing,
      ...warnings.map((words) => html`<li class="doubt">${warning(words)}</li>`),
    ];
  }

  /** The table that the service read, before anything is fitted. */
  function readTable() {
    if (!table) return nothing;
    const { columns, units, skipped_lines: skipped, read_as: how } = table;
    const names = Object.keys(columns);
    const count = columns[names[0]]?.length ?? 0;
    const head = (name) =>
      `${name}${units[name] && units[name] !== "-" ? ` [${units[name]}]` : ""}`;
    const row = (i) =>
      html`<tr>
        ${names.map((name) => html`<td>${show(columns[name][i], 6)}</td>`)}
      </tr>`;
    const more = skipped.length
      ? `; lines that were skipped: ${skipped.slice(0, 8).join(", ")}` +
        (skipped.length > 8 ? ", …" : "")
      : "";
    return html`<p class="hint">${how ? `Recognised: ${how}; ` : ""}${count} points${more}.</p>
      <details>
        <summary>The points as they were read</summary>
        <div class="scroll">
          <table>
            <thead>
              <tr>
                ${names.map((name) => html`<th scope="col">${head(name)}</th>`)}
              </tr>
            </thead>
            <tbody>
              ${Array.from({ length: Math.min(count, ROWS) }, (_, i) => row(i))}
            </tbody>
          </table>
        </div>
        ${count > ROWS ? html`<p class="hint">and ${count - ROWS} more</p>` : nothing}
      </details>`;
  }

  function draw() {
    render(readTable(), $("points-read"));
    $("fit-button").disabled = !table;
    $("fit-hint").hidden = Boolean(table);
    $("fit-caption").hidden = !fit;
    write("fit-legend", table?.columns.std ? "Bars: ± one standard deviation of a point." : "");
    render(result(), $("fit-lines"));
    const old = fit && JSON.stringify(question()) !== JSON.stringify(fit.question);
    $("fit-lines").classList.toggle("old", Boolean(old));
    plot.redraw();
  }

  /** Points, fit and band; below the axis of v₀ a strip with the residuals. */
  function paint() {
    if (!table?.columns.v0 || !table.columns.mu_macro) {
      plot.clear();
      return;
    }
    const speeds = column("v0");
    const measured = column("mu_macro");
    const unit = unitFor("v0", Math.max(...speeds));
    const x = speeds.map((value) => toUnit("v0", value, unit));
    const moving = x.filter((value) => value > 0);
    const log = Math.min(...moving) < Math.max(...moving) / 10;
    const domain = log
      ? [Math.min(...moving) / 1.3, Math.max(...moving) * 1.3]
      : [0, 1.05 * Math.max(...x)];
    const std = table.columns.std ? column("std") : x.map(() => 0);
    const curve = fit?.curve;
    const top =
      1.08 * Math.max(...measured.map((mu, i) => mu + (std[i] || 0)), ...(curve?.high ?? [0]));
    const residuals = fit?.residuals ?? [];
    const worst = Math.max(...residuals.map((one, i) => Math.abs(one) + (std[i] || 0)), 1e-12);
    plot.axes({
      x: { domain, log, title: `v₀ [${inPrint(unit)}]` },
      y: { domain: [0, top], log: false, title: "friction µ" },
      top: KEY,
      below: residuals.length ? STRIP : 0,
    });
    const { inside } = plot;
    if (curve) {
      const at = curve.v0.map((value) => toUnit("v0", value, unit));
      const band = area()
        .x((_, i) => plot.x(at[i]))
        .y0((_, i) => plot.y(curve.low[i]))
        .y1((_, i) => plot.y(curve.high[i]));
      inside.append("path").attr("class", "band").attr("d", band(at));
      plot.path(
        at.map((one, i) => [one, curve.mu_macro[i]]),
        "curve",
      );
    }
    const dot = (i, y, layer = inside, kind = "measured", radius = 3.5) =>
      layer
        .append("circle")
        .attr("class", kind)
        .attr("r", radius)
        .attr("cx", plot.x(x[i]))
        .attr("cy", y);
    /** A point with its deviation, on a scale of µ. */
    const measuredAt = (i, mu, scale, layer) => {
      if (std[i]) {
        const [from, to] = [mu - std[i], mu + std[i]].map(scale);
        layer
          .append("path")
          .attr("class", "measured")
          .attr("d", `M${plot.x(x[i])} ${from}V${to}`);
      }
      dot(i, scale(mu), layer);
    };
    measured.forEach((mu, i) => measuredAt(i, mu, plot.y, inside));
    key(curve);
    if (!residuals.length) return;
    // µ₀ of each point is another one: there is no curve, but rings and a thin line for the eye
    if (!curve) {
      const fitted = measured.map((mu, i) => mu - residuals[i]);
      const order = x.map((_, i) => i).sort((a, b) => x[a] - x[b]);
      plot.path(
        order.map((i) => [x[i], fitted[i]]),
        "fitted thin",
      );
      fitted.forEach((mu, i) => dot(i, plot.y(mu), inside, "fitted", 6));
    }
    const strip = plot.strip({ most: worst, title: "residuals", pixels: STRIP });
    residuals.forEach((one, i) => measuredAt(i, one, strip, plot.over));
  }

  /** What the signs of the plot mean, above its frame. */
  function key(curve) {
    const { over, box } = plot;
    const sign = (kind, shape, words, x) => {
      over.append("path").attr("class", kind).attr("d", shape);
      plot.text(words, x, 14, "note", "start");
    };
    sign("measured", circleAt(box.x + 6, 10, 3.5), "measured", box.x + 14);
    if (!fit) return;
    const at = box.x + 90;
    if (curve) sign("curve", `M${at} 10h18`, "fit, 95 % band", at + 24);
    else sign("fitted", circleAt(at + 6, 10, 6), "fit, at µ₀ of each point", at + 18);
  }

  $("points").addEventListener("change", ({ target }) => {
    source = { points: target.value };
    asked = false;
    $("file-name").textContent = "";
    read();
  });
  async function take(file) {
    if (!file) return;
    source = { points_base64: await encoded(file) };
    asked = false;
    $("points").value = "";
    $("file-name").textContent = `${file.name}, ${prefixedBytes(file.size)}`;
    read();
  }
  const prefixedBytes = (size) => (size < 1000 ? `${size} bytes` : `${Math.round(size / 1000)} kB`);
  $("points-file").addEventListener("change", ({ target }) => take(target.files[0]));
  const zone = $("fit-form");
  zone.addEventListener("dragover", (event) => {
    event.preventDefault();
    zone.classList.add("over");
  });
  zone.addEventListener("dragleave", () => zone.classList.remove("over"));
  zone.addEventListener("drop", (event) => {
    event.preventDefault();
    zone.classList.remove("over");
    take(event.dataTransfer.files[0]);
  });
  for (const name of ["sep", "decimal", "encoding"])
    $(`points-${name}`).addEventListener("change", read);
  $("unknowns").addEventListener("change", () => draw());
  $("fit-form").addEventListener("submit", (event) => {
    event.preventDefault();
    fits.push(question());
  });
  $("fit-example").addEventListener("click", () => {
    $("points").value = about.example.points;
    $("unknowns").value = about.example.unknowns;
    source = { points: about.example.points };
    asked = true;
    openCase(about.example.case);
    read();
  });
  $("fit-image").addEventListener(
    "click",
    () =>
      fit &&
      plot.save(
        $("fit-lines").textContent.replaceAll(/\s+/g, " ").trim().slice(0, 200),
        "friction-fit.svg",
      ),
  );

  return (latest) => {
    answer = latest;
    if (table) draw();
    fitIfAsked();
  };
}
