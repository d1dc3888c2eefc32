// What a person types: understood as a whole, or refused with the reason.
import { INPUTS, hasUnit, toSI } from "./inputs.js";

const SUPERSCRIPT = "⁰¹²³⁴⁵⁶⁷⁸⁹";

/** Signs that look alike become one: spaces, minus, apostrophe, powers of ten. */
function plain(text) {
  return text.trim()
    .replace(/[\s\u00a0\u2007-\u200a\u202f]+/g, " ").replace(/[−–]/g, "-").replace(/’/g, "'")
    .replace(/⁻/g, "-").replace(/[⁰¹²³⁴⁵⁶⁷⁸⁹]/g, (digit) => SUPERSCRIPT.indexOf(digit))
    .replace(/^([+-]?[\d.,' ]*\d) ?[x×·*] ?10 ?\^? ?([+-]?\d+)/, "$1e$2");
}

/** Digits with separators as a text that Number() reads; null if they are no number, undefined if they may be two. */
function digits(body) {
  if (/^[1-9]\d{0,2},\d{3}$/.test(body)) return undefined;
  if (/^(\d+[.,]?\d*|[.,]\d+)$/.test(body)) return body.replace(",", ".");
  if (/^\d{1,3}(?:([ '])\d{3})(?:\1\d{3})*([.,]\d+)?$/.test(body)) return body.replace(/[ ']/g, "").replace(",", ".");
  if (/^\d{1,3}(?: \d{3})*[.,]\d{3}(?: \d{3})*(?: \d{1,3})?$/.test(body)) return body.replace(/ /g, "").replace(",", ".");
  if (/^\d{1,3}(,\d{3}){2,}(\.\d+)?$|^\d{1,3}(,\d{3})+\.\d+$/.test(body)) return body.replace(/,/g, "");
  if (/^\d{1,3}(\.\d{3}){2,}(,\d+)?$|^\d{1,3}(\.\d{3})+,\d+$/.test(body)) return body.replace(/\./g, "").replace(",", ".");
  return null;
}

/** { value, unit } of a typed number, unit "" where there is none; or { fault } in words. */
export function readNumber(text) {
  const tidy = plain(text);
  if (tidy === "") return { fault: "give a number" };
  const found = /^([+-]?) ?(\d(?:(?! 1\/)[\d.,' ])*|[.,]\d+)(?:e([+-]?\d+))?(?![\d.,'])(.*)$/i.exec(tidy);
  if (!found) return { fault: `“${text.trim()}” is not a number` };
  const [, sign, body, exponent = "0", rest] = found;
  const unit = rest.trim();
  const read = digits(body.trim());
  if (read === undefined) {
    const [whole, part] = body.trim().split(",");
    return { fault: `“${body.trim()}” can be ${whole}${part} or ${whole}.${part}: write one of them` };
  }
  if (read === null) return { fault: `“${text.trim()}” is not a number` };
  const value = Number(`${sign}${read}e${exponent}`);
  if (!Number.isFinite(value)) return { fault: `“${text.trim()}” is too large` };
  if (value === 0 && /[1-9]/.test(read)) return { fault: `“${text.trim()}” is too small` };
  return { value, unit };
}

/** The unit of an input that is meant by a text; { fault } if none is. */
function readUnit(name, text) {
  const tidy = text.replace(/[\s·[\]()]/g, "");
  if (hasUnit(name, tidy)) return { unit: tidy };
  const { units, offered, symbol } = INPUTS[name];
  if (units[tidy] === null) return { fault: `“${text}” can be Hz or rad/s: write one of them` };
  const near = Object.keys(units).filter((unit) => unit.toLowerCase() === tidy.toLowerCase());
  if (near.length) return { fault: `“${text}” is not a unit: did you mean ${near.join(" or ")}?` };
  const known = name === "mu0" ? "leave it out" : `give ${offered.join(", ")}`;
  return { fault: `“${text}” is not a unit of ${symbol}: ${known}` };
}

/** { si, value, unit } of a typed value of an input, in `unit` where none is typed; { rigid } or { fault }. */
export function readValue(name, text, unit) {
  if (name === "k" && /^(rigid|inf|infinity|∞)$/i.test(text.trim())) return { rigid: true };
  const number = readNumber(text);
  if (number.fault) return number;
  const named = number.unit === "" ? { unit } : readUnit(name, number.unit);
  if (named.fault) return named;
  return inBounds(name, number.value, named.unit);
}

function inBounds(name, value, unit, positive = INPUTS[name].positive) {
  const si = toSI(name, unit, value);
  if (!Number.isFinite(si) || si < 0 || (positive && si === 0)) return { fault: `must be ${positive ? INPUTS[name].bound : "finite and >= 0"}` };
  if (si === 0 && value !== 0) return { fault: "is too small" };
  return { si, value, unit };
}

/** { si } of a typed standard deviation: in the input's unit, or in % of its value; { fault } if it is neither. */
export function readDeviation(name, text, unit, ofValue) {
  if (text.trim() === "") return { si: 0 };
  const number = readNumber(text.replace(/^\s*±/, ""));
  if (number.fault) return number;
  if (number.value < 0) return { fault: "must be >= 0" };
  if (number.unit === "%") return { si: (number.value / 100) * ofValue };
  const named = number.unit === "" ? { unit } : readUnit(name, number.unit);
  return named.fault ? named : inBounds(name, number.value, named.unit, false);
}
