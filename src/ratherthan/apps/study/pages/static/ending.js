// The state that a participant ended in enters, the last page leaves: thanks or why not, the code, and the way back.

import { keepsake, make, say } from "./elements.js";

const STATES = ["finished", "screened-out", "no-consent", "withdrawn", "closed", "full", "paused", "failed"];

/** Show the last page in `place`. `reply` is the server's; `sentence` is said in place of the usual one. */
export function end(place, reply, sentence = null) {
    const state = STATES.includes(reply.state) ? reply.state : "failed";
    const own = reply.screen && state !== "paused" ? reply.screen : null;
    const heading = make("h1", { tabindex: "-1" }, own ? own.title : say(`${state}-title`));
    const paragraphs = own ? own.paragraphs : [sentence ?? say(`${state}-text`)];
    const article = make("article", { class: "screen ending", "data-screen": own ? own.id : state }, heading);
    article.append(...paragraphs.map((text) => make("p", { class: "paragraph" }, text)));
    const ending = reply.ending ?? null;
    const label = say(state === "finished" ? "code" : "code-other");
    if (ending?.code) article.append(keepsake(label, ending.code, ending.redirect || ending.post ? null : say("code-why")));
    if (ending?.redirect && /^https?:\/\//i.test(ending.redirect)) {
        const link = make("a", { class: "button", href: ending.redirect, rel: "noreferrer" }, say("redirect"));
        article.append(make("p", {}, say("redirect-why")), make("div", { class: "buttons" }, link));
    }
    if (ending?.post) article.append(submission(ending.post));
    if (state === "paused" || state === "failed") {
        const button = make("button", { type: "button" }, say("retry-now"));
        button.addEventListener("click", () => location.reload());
        article.append(make("div", { class: "buttons" }, button));
    }
    if (reply.withdrawal_code && ["finished", "screened-out"].includes(state)) {
        article.append(keepsake(say("withdrawal-code"), reply.withdrawal_code, say("withdrawal-why")));
    }
    place.replaceChildren(article);
    scrollTo(0, 0);
    heading.focus({ preventScroll: true });
    return article;
}

/** The form by which a platform is told that the work is done. */
function submission(post) {
    const fields = Object.entries(post.fields).map(([name, value]) => make("input", { type: "hidden", name, value }));
    const button = make("button", { type: "submit" }, say("post"));
    return make("form", { method: "post", action: post.action, class: "buttons" }, fields, button);
}
