// A withdrawal code enters, the withdrawal leaves: people take their answers back by themselves.

import { say } from "./elements.js";
import * as shelf from "./shelf.js";

const form = document.getElementById("withdrawal");
const code = document.getElementById("code");
const fault = document.getElementById("fault");
const button = form.querySelector("button");
code.value = shelf.kept("withdrawal") ?? "";

function complain(sentence) {
    fault.textContent = sentence;
    code.toggleAttribute("aria-invalid", Boolean(sentence));
    if (sentence) code.setAttribute("aria-invalid", "true");
}

async function withdraw(erase) {
    const body = JSON.stringify({ code: code.value.trim(), erase });
    const headers = { "Content-Type": "application/json" };
    const reply = await fetch("/api/withdraw", { method: "POST", headers, body, cache: "no-store", credentials: "omit" });
    const said = await reply.json().catch(() => ({}));
    if (reply.ok) return said;
    const key = reply.status >= 500 ? "withdrawal-away" : `fault-${said.error?.kind}`;
    throw new Error(say(key) ?? said.error?.sentence ?? say("refused"));
}

form.addEventListener("submit", async (event) => {
    event.preventDefault();
    if (form.getAttribute("aria-busy")) return;
    if (code.value.trim() === "") {
        complain(say("withdrawal-missing"));
        code.focus();
        return;
    }
    complain("");
    form.setAttribute("aria-busy", "true");
    try {
        const said = await withdraw(document.getElementById("erase").checked);
        for (const key of ["token", "known", "outbox", "withdrawal"]) shelf.drop(key);
        shelf.remember(null);
        form.hidden = true;
        document.getElementById("done").hidden = false;
        const text = document.getElementById("done-text");
        text.textContent = say(said.erased ? "withdrawal-erased" : "withdrawal-done");
        text.focus();
    } catch (trouble) {
        complain(trouble instanceof TypeError ? say("withdrawal-away") : trouble.message);
        button.focus();
    } finally {
        form.removeAttribute("aria-busy");
    }
});
