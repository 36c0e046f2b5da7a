// A record of the screen enters, the part of the form that asks for it leaves: its element, and how to read and judge it.
//
// What is judged here is only for the person's comfort: the server judges again, and it alone knows what is right.

import { make, say, spoken } from "./elements.js";

const DIGIT = /^[0-9]$/;

/** The part of the form for a record: {record, element, value(), fault(), complain(sentence), focus()}; of a
 * choice also `chosen`, and `hint`, the keys that are written beside its options. */
export function item(record, number, cards = null) {
    if (record.type === "choice" || record.options?.length) return choice(record, `item-${number}`, cards);
    if (record.type === "flag") return flag(record, `item-${number}`);
    return field(record, `item-${number}`);
}

/** Whether the options are points of a scale, to be shown in a row. */
function scaled(options) {
    return options.length <= 11 && options.every((option, at) => option.value === options[0].value + at && Number.isInteger(option.value));
}

/** The keys that choose an option: the points of a scale by their number, other options by their place. */
export function keyed(options) {
    const byValue = scaled(options) && options.every((option) => option.value >= 0 && option.value <= 9);
    if (!byValue && options.length > 9) return null;
    const keys = options.map((option, at) => String(byValue ? option.value : at + 1));
    return { least: keys[0], most: keys.at(-1), keys };
}

function wrapped(record, id, control, body) {
    const complaint = make("p", { class: "fault", id: `${id}-fault` });
    return {
        record,
        complaint,
        complain(sentence) {
            complaint.textContent = sentence ?? "";
            body.classList.toggle("wrong", Boolean(sentence));
            if (sentence) control.setAttribute("aria-invalid", "true");
            else control.removeAttribute("aria-invalid");
        },
    };
}

function choice(record, id, cards) {
    const options = record.options;
    const inRow = cards === null && scaled(options);
    const keys = keyed(options);
    const legend = make("legend", { id: `${id}-label` }, record.label, optional(record));
    const group = make("fieldset", {
        class: cards !== null ? "item cards" : inRow ? "item scale" : "item list",
        role: "radiogroup",
        "aria-labelledby": `${id}-label`,
        "aria-describedby": `${id}-fault`,
        "aria-required": record.required ? "true" : null,
    });
    const part = wrapped(record, id, group, group);
    const radios = options.map((option, at) => make("input", { type: "radio", name: id, id: `${id}-${at}`, value: at }));
    const labels = options.map((option, at) => {
        const key = inRow ? String(option.value) : cards !== null ? String(at + 1) : null;
        const number = key === null ? null : make("span", { class: "key", "aria-hidden": "true" }, key);
        return make("label", { class: "option", for: `${id}-${at}` }, radios[at], number, make("span", { class: "text", ...spoken(cards?.[at]?.language) }, option.label));
    });
    group.append(legend, make("div", { class: "options" }, labels), part.complaint);
    group.addEventListener("change", () => part.complain(null));
    group.addEventListener("keydown", (event) => {
        if (event.ctrlKey || event.altKey || event.metaKey || !DIGIT.test(event.key) || keys === null) return;
        const at = keys.keys.indexOf(event.key);
        if (at < 0) return;
        event.preventDefault();
        radios[at].focus();
        radios[at].checked = true;
        part.complain(null);
    });
    const chosen = () => radios.findIndex((radio) => radio.checked);
    return Object.assign(part, {
        element: group,
        hint: inRow || cards !== null ? keys : null,
        chosen: true,
        value: () => (chosen() < 0 ? undefined : options[chosen()].value),
        fault: () => (record.required && chosen() < 0 ? say("missing-choice") : null),
        focus: () => radios[Math.max(0, chosen())].focus(),
    });
}

function flag(record, id) {
    const box = make("input", { type: "checkbox", id, "aria-describedby": `${id}-fault` });
    const element = make("div", { class: "item" }, make("label", { class: "tick", for: id }, box, make("span", {}, record.label)));
    const part = wrapped(record, id, box, element);
    element.append(part.complaint);
    return Object.assign(part, {
        element,
        value: () => box.checked,
        fault: () => null,
        focus: () => box.focus(),
    });
}

function field(record, id) {
    const isNumber = record.type === "number";
    const long = !isNumber && (record.longest ?? 1000) > 120;
    const input = make(long ? "textarea" : "input", {
        id,
        type: long ? null : "text",
        rows: long ? 4 : null,
        inputmode: isNumber ? (Number.isInteger(record.least ?? 0) ? "numeric" : "decimal") : null,
        autocomplete: "off",
        "aria-required": record.required ? "true" : null,
        "aria-describedby": `${id}-fault`,
    });
    const label = make("label", { for: id }, record.label, isNumber && record.unit ? ` (${record.unit})` : null, optional(record));
    const element = make("div", { class: isNumber ? "item field short" : "item field" }, label, input);
    const part = wrapped(record, id, input, element);
    element.append(part.complaint);
    input.addEventListener("input", () => part.complain(null));
    const text = () => cleaned(input.value);
    return Object.assign(part, {
        element,
        value: () => (text() === "" ? undefined : isNumber ? numbered(text()) : text()),
        fault: () => (isNumber ? wrongNumber(record, text()) : wrongText(record, text())),
        focus: () => input.focus(),
    });
}

function optional(record) {
    return record.required ? null : make("span", { class: "hint" }, ` ${say("optional")}`);
}

/** A text without the characters that only control a terminal; line ends and tabs stay. */
function cleaned(text) {
    // eslint-disable-next-line no-control-regex
    return text.replace(/\r\n?/g, "\n").replace(/[\u0000-\u0008\u000b-\u001f\u007f]/g, "").trim();
}

/** A number as people write it, with a point or a comma; NaN for anything else. */
function numbered(text) {
    return /^[+-]?[0-9]+([.,][0-9]+)?$/.test(text) ? Number(text.replace(",", ".")) : Number.NaN;
}

function wrongNumber(record, text) {
    if (text === "") return record.required ? say("missing-number") : null;
    const value = numbered(text);
    if (!Number.isFinite(value)) return say("missing-number");
    if (typeof record.least === "number" && value < record.least) return say("too-small", { least: record.least });
    if (typeof record.most === "number" && value > record.most) return say("too-large", { most: record.most });
    return null;
}

function wrongText(record, text) {
    if (text === "") return record.required ? say("missing-text") : null;
    if (typeof record.longest === "number" && [...text].length > record.longest) return say("too-long", { longest: record.longest });
    return null;
}
