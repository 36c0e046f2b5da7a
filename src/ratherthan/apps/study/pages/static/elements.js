// Names and texts enter, elements of the page leave. Texts become text nodes, so nothing in them is ever run.

const WORDS = JSON.parse(document.getElementById("words").textContent);

/** The interface's words for a key, with what stands in braces filled in; `null` where there are none. */
export function say(key, parts = {}) {
    if (!Object.hasOwn(WORDS, key)) return null;
    return Object.entries(parts).reduce((text, [name, part]) => text.replaceAll(`{${name}}`, String(part)), WORDS[key]);
}

/** An element with attributes and children; attributes that are null, undefined or false are left out. */
export function make(tag, attributes = {}, ...children) {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
        if (value === null || value === undefined || value === false) continue;
        element.setAttribute(name, value === true ? "" : String(value));
    }
    element.append(...children.flat().filter((child) => child !== null && child !== undefined));
    return element;
}

/** The attributes of a text in a language of its own; none where it is that of the page. */
export function spoken(language) {
    return language ? { lang: language, dir: "auto" } : {};
}

let made = 0;

/** A text that people are to keep, with a button that copies it. */
export function keepsake(label, text, why) {
    made += 1;
    const id = `kept-${made}`;
    const code = make("code", { class: "code", id }, text);
    const told = make("span", { role: "status", class: "hint" });
    const button = make("button", { type: "button", class: "quiet", "aria-describedby": id }, say("copy"));
    button.addEventListener("click", async () => {
        try {
            await navigator.clipboard.writeText(text);
            told.textContent = say("copied");
        } catch {
            // No right to the clipboard (an iframe, plain http): the text is selected, to be copied by hand.
            getSelection().selectAllChildren(code);
        }
    });
    return make(
        "div",
        { class: "keepsake" },
        make("p", {}, `${label}: `, code, " ", button, " ", told),
        why ? make("p", { class: "hint" }, why) : null,
    );
}
