// The server's screens enter, one after the other, and what is answered leaves: the page on which people take part.
//
// The server owns the order, the progress and what is valid. This page shows the screen that is due, and after a reload,
// after a crash or in a second tab again the one that is due.

import { Clock } from "./clock.js";
import { Courier, Refused } from "./courier.js";
import { make, say } from "./elements.js";
import { end } from "./ending.js";
import { Choose, Rate } from "./plugins.js";
import * as shelf from "./shelf.js";

const PREVIEW = "ASSIGNMENT_ID_NOT_AVAILABLE"; // what MTurk says for an assignment while somebody only looks
const SLOW = 400; // milliseconds after which it is said that an answer is being saved

const place = document.getElementById("screen");
const saving = document.getElementById("saving");
const platform = asked();
const known = told();
let opening = true;
let present = null; // the server's last reply: where this participant stands
let patience = null;

const courier = new Courier((how) => {
    clearTimeout(patience);
    if (how === "through") saving.replaceChildren();
    else if (!saving.querySelector("button")) {
        const button = make("button", { type: "button", class: "quiet" }, say("retry-now"));
        button.addEventListener("click", () => courier.hurry());
        saving.replaceChildren(make("span", {}, say(opening ? "opening-again" : "retrying")), " ", button);
    }
});
const clock = new Clock(() => courier.time({ screen: present.screen.id, attempt: present.attempt, ...clock.read() }));

/** What the platform put into the address. */
function asked() {
    const query = [...new URLSearchParams(location.search)].slice(0, 20);
    return Object.fromEntries(query.map(([name, value]) => [name.slice(0, 64), value.slice(0, 500)]));
}

/** Whether the platform tells people apart by itself, so that this browser need not remember them. */
function told() {
    if (location.search === "") return shelf.kept("known") === true;
    return ["PROLIFIC_PID", "SESSION_ID", "assignmentId", "preview"].some((name) => name in platform);
}

/** The token to come with: this tab's, or that of somebody who began in this browser, if it is the same person. */
async function token() {
    const own = shelf.kept("token");
    if (own !== null || known) return own;
    const earlier = shelf.remembered();
    if (earlier === null || (earlier.ended && "new" in platform)) return null;
    if (earlier.ended) return earlier.token;
    return new Promise((resolve) => {
        const goOn = make("button", { type: "button" }, say("resume-same"));
        const anew = make("button", { type: "button", class: "quiet" }, say("resume-other"));
        goOn.addEventListener("click", () => resolve(earlier.token));
        anew.addEventListener("click", () => {
            shelf.remember(null);
            resolve(null);
        });
        const heading = make("h1", { tabindex: "-1" }, say("resume-title"));
        const buttons = make("div", { class: "buttons" }, goOn, anew);
        hideOpening();
        place.replaceChildren(make("article", { class: "screen", "data-screen": "resume" }, heading, make("p", {}, say("resume-text")), buttons));
        heading.focus({ preventScroll: true });
    });
}

function hideOpening() {
    document.getElementById("opening")?.remove();
}

/** Come in; the first reply, or the one to the answer that was still on its way. */
async function enter() {
    const old = await token();
    if (location.search === "" && old !== null) courier.token = old;
    else {
        const entered = await courier.enter(platform, old);
        if (courier.token === null) return { state: entered.state };
    }
    shelf.keep("token", courier.token);
    shelf.keep("known", known);
    if (!known) shelf.remember(courier.token);
    // Identities leave the address. Not MTurk's: only with it the page may stand in MTurk's frame, where nobody sees it.
    if (shelf.lasting && !["preview", "assignmentId"].some((name) => name in platform)) history.replaceState(null, "", location.pathname);
    return (await courier.leftover()) ?? courier.now();
}

/** Take a reply as where the participant stands, and show what stands around the screen. */
function stand(reply) {
    present = reply;
    document.getElementById("preview").hidden = !reply.preview;
    document.getElementById("withdraw").hidden = Boolean(reply.preview); // there is nobody who could
    const code = reply.withdrawal_code ?? null;
    if (code !== null) {
        shelf.keep("withdrawal", code);
        document.getElementById("withdraw-code").textContent = ` (${say("code-short", { code })})`;
    }
    const progress = document.getElementById("progress");
    progress.hidden = reply.state !== "running" || !reply.of;
    if (!progress.hidden) {
        document.getElementById("progress-text").textContent = say("progress", { number: reply.number, of: reply.of });
        Object.assign(document.getElementById("progress-bar"), { value: reply.number, max: reply.of });
    }
    const title = reply.screen?.title;
    if (title && reply.study?.title) document.title = `${title} – ${reply.study.title}`;
}

/** Send what was answered; resolves when it is saved, and the next screen is known. */
async function deliver(values) {
    const answer = { screen: present.screen.id, attempt: present.attempt, values, ...clock.stop() };
    patience = setTimeout(() => saving.replaceChildren(say("saving")), SLOW);
    try {
        stand(await courier.answer(answer));
    } catch (refusal) {
        if (!(refusal instanceof Refused)) throw refusal;
        if (refusal.status === 401) {
            present = { state: "failed", sentence: sentence(refusal) };
            return;
        }
        clock.resume();
        throw { place: refusal.place, sentence: sentence(refusal) };
    } finally {
        clearTimeout(patience);
        saving.replaceChildren();
    }
}

/** What to tell people of a refusal: in the language of the study, if there are words for it. */
function sentence(refusal) {
    return say(`fault-${refusal.kind}`) ?? (refusal.message || say("refused"));
}

/** Said above a screen that comes once more. */
function again() {
    if (!present.again) return null;
    return present.tries_left > 1 ? say("again", { n: present.tries_left }) : say("again-last");
}

function due(type, cards) {
    const trial = {
        type,
        screen: () => present.screen,
        picture: () => present.screen.picture ?? null,
        again,
        locked: () => (platform.assignmentId === PREVIEW ? say("accept-first") : null),
        deliver,
        shown: () => clock.start(),
    };
    return { timeline: [trial], conditional_function: () => present.state === "running" && Boolean(present.screen.cards?.length) === cards };
}

async function take() {
    opening = false;
    const jsPsych = globalThis.initJsPsych({
        display_element: place,
        use_webaudio: false,
        on_trial_start: () => {
            place.tabIndex = -1; // jsPsych makes the whole study one stop of the Tab key, which reads out all of it
        },
    });
    await jsPsych.run([{ timeline: [due(Rate, false), due(Choose, true)], loop_function: () => present.state === "running" }]);
}

async function main() {
    // In a frame of MTurk's no other page of ours may stand: it opens in a tab of its own.
    if (window.top !== window.self) document.querySelector("#withdraw a").target = "_blank";
    document.getElementById("opening").hidden = false;
    try {
        stand(await enter());
        hideOpening();
        if (present.state === "running") await take();
    } catch (fault) {
        hideOpening();
        if (!(fault instanceof Refused)) {
            end(place, { state: "failed" }, say("broken"));
            throw fault;
        }
        shelf.drop("token");
        shelf.remember(null);
        present = { state: "failed", sentence: sentence(fault) };
    }
    place.removeAttribute("tabindex");
    end(place, present, present.sentence);
    document.getElementById("progress").hidden = true;
    if (!["paused", "failed"].includes(present.state) && courier.token !== null && !known) shelf.remember(courier.token, true);
    if (["withdrawn", "closed", "full", "no-consent"].includes(present.state)) document.getElementById("withdraw").hidden = true;
}

// A fault of this program is told, too: what was saved is saved, and a reload goes on from there.
addEventListener("unhandledrejection", () => {
    const button = make("button", { type: "button", class: "quiet" }, say("reload"));
    button.addEventListener("click", () => location.reload());
    saving.replaceChildren(make("span", {}, say("broken")), " ", button);
});

main();
