// A screen as the server describes it enters, the page that shows it leaves, with its form: one for both plugins.

import { make, say, spoken } from "./elements.js";
import { item } from "./items.js";

/**
 * Show a screen in `display`, and call `submitted(values)` with what was answered, once it is whole.
 *
 * `submitted` returns a promise: while it is open, further submits are ignored and everything stays in its place. It may
 * be rejected with {place, sentence}: the sentence is shown at that item, and the form can be sent again.
 */
export function show(display, trial, cards, submitted) {
    const { screen } = trial;
    const heading = make("h1", { tabindex: "-1" }, screen.title);
    const items = screen.records.map((record, number) => item(record, number, cards && number === 0 ? screen.cards : null));
    const notice = make("p", { class: "fault", role: "alert" });
    const consent = gate(screen);
    const form = make("form", { novalidate: true, class: "form" }, consent ? consent.element : items.map((each) => each.element));
    const next = make("button", { type: "submit" }, say("continue"));
    if (!trial.locked) form.append(notice, ...(consent ? [] : [make("div", { class: "buttons" }, next)]));
    const picture = figure(screen, trial.picture);
    const told = [
        trial.again ? make("p", { class: "fault", role: "alert" }, trial.again) : null,
        screen.paragraphs.map((text) => make("p", { class: "paragraph" }, text)),
        screen.explanation ? make("blockquote", { class: "explanation", "aria-label": say("explanation") }, make("p", spoken(screen.language), screen.explanation)) : null,
        trial.locked ? make("p", { class: "said" }, trial.locked) : form,
        hint(items, cards, trial.locked || consent),
    ];
    const article = make("article", { class: picture ? "screen with-map" : "screen", "data-screen": screen.id }, heading);
    if (picture) article.append(picture.element, make("div", { class: "told" }, told.flat()));
    else article.append(...told.flat().filter(Boolean));
    display.append(article);

    let busy = false;
    const send = async (values) => {
        if (busy) return;
        busy = true;
        form.setAttribute("aria-busy", "true");
        try {
            await submitted(values);
        } catch (refusal) {
            if (refusal?.sentence === undefined) throw refusal;
            const at = items.find((each) => refusal.place.split(".").at(-1) === each.record.name);
            if (at) {
                at.complain(refusal.sentence);
                at.focus();
            } else notice.textContent = refusal.sentence;
            busy = false;
            form.removeAttribute("aria-busy");
        }
    };
    form.addEventListener("submit", (event) => {
        event.preventDefault();
        if (busy || trial.locked) return;
        if (picture && !picture.loaded()) {
            notice.textContent = say("map-missing");
            return;
        }
        if (consent) {
            send({ [screen.records[0].name]: consent.value(event.submitter) });
            return;
        }
        const faults = items.map((each) => each.fault());
        items.forEach((each, number) => each.complain(faults[number]));
        const missing = faults.filter(Boolean).length;
        notice.textContent = missing ? say("to-mend", { n: missing }) : "";
        if (missing) items[faults.findIndex(Boolean)].focus();
        else send(values(items));
    });
    scrollTo(0, 0);
    heading.focus({ preventScroll: true });
}

/** What was answered; what may be left out and is empty is left out. */
function values(items) {
    const answered = items.map((each) => [each.record.name, each.value()]);
    return Object.fromEntries(answered.filter(([, value]) => value !== undefined));
}

/** The consent screen's answers as buttons, where it asks one thing of few answers; else null. */
function gate(screen) {
    const [record, ...more] = screen.records;
    if (screen.phase !== "consent" || more.length || record?.type !== "choice" || !(record.options.length < 4)) return null;
    const buttons = record.options.map((option, at) =>
        make("button", { type: "submit", class: at ? "quiet" : null, "data-at": at }, option.label),
    );
    const element = make("div", { class: "item", role: "group", "aria-labelledby": "consent-question" },
        make("p", { id: "consent-question", class: "question" }, record.label), make("div", { class: "buttons" }, buttons));
    // Enter in no field at all has no submitter: then nobody has pressed a button, and the first one is meant.
    return { element, value: (button) => record.options[Number(button?.dataset.at ?? 0)].value };
}

/** The picture of the map, which is asked for again until it is there. */
function figure(screen, picture) {
    if (!picture) return null;
    let loaded = false;
    const image = make("img", { src: picture.address, alt: picture.text || say("map"), width: picture.width, height: picture.height });
    image.addEventListener("load", () => {
        loaded = true;
        image.dispatchEvent(new CustomEvent("shown", { bubbles: true }));
    });
    let tries = 0;
    image.addEventListener("error", () => {
        tries += 1;
        setTimeout(() => {
            image.src = picture.address;
        }, Math.min(15000, 500 * 2 ** tries));
    });
    const frame = make("div", { class: "frame" }, image);
    const button = make("button", { type: "button", class: "quiet small", "aria-pressed": "false" }, say("enlarge"));
    const element = make("figure", { class: "map" }, frame, button);
    button.addEventListener("click", () => {
        const large = element.classList.toggle("large");
        button.setAttribute("aria-pressed", String(large));
        // What can be scrolled must be reached by the keyboard, too.
        if (large) Object.entries({ tabindex: "0", role: "group", "aria-label": image.alt }).forEach(([name, value]) => frame.setAttribute(name, value));
        else ["tabindex", "role", "aria-label"].forEach((name) => frame.removeAttribute(name));
    });
    return { element, loaded: () => loaded };
}

/** How to answer with the keyboard, where there is something to choose. */
function hint(items, cards, locked) {
    const choices = items.filter((each) => each.chosen);
    if (locked || choices.length === 0) return null;
    const keys = choices.every((each) => each.hint) ? choices[0].hint : null;
    const told = keys === null ? say("keys-list") : say(cards ? "keys-choose" : "keys", keys);
    return make("p", { class: "hint keyboard" }, told);
}
