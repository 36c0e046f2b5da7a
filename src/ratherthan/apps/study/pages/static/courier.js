// What is to be told the server enters, its reply leaves: whatever fails on the way is tried again until it arrives.
//
// An answer lies in the outbox (this tab's storage) until the server has confirmed that it is saved; it is sent again
// with the same body, which the server takes once only. A reply that refuses the answer for what it says ends the trying.

import * as shelf from "./shelf.js";

const PATIENCE = 20000; // milliseconds after which a request is given up and made again
const LONGEST = 15000; // milliseconds between two tries, at most

/** The server's refusal: trying again would not help. */
export class Refused extends Error {
    constructor(status, fault) {
        super(fault.sentence);
        this.status = status;
        this.kind = String(fault.kind ?? "");
        this.place = String(fault.place ?? "");
    }
}

export class Courier {
    #wake = null;

    /** `told` hears of each failed try and of the end of the trouble: told("trying") and told("through"). */
    constructor(told) {
        this.token = null;
        this.told = told;
        addEventListener("online", () => this.hurry());
        addEventListener("beforeunload", (event) => {
            if (shelf.kept("outbox") !== null && this.#wake !== null) event.preventDefault();
        });
    }

    /** Try again at once. */
    hurry() {
        if (this.#wake !== null) this.#wake();
    }

    /** Say who is coming; the reply has the token, which is kept. */
    async enter(platform, token) {
        const reply = await this.#insist("POST", "/api/enter", token === null ? { platform } : { platform, token });
        this.token = reply.token || null;
        return reply;
    }

    /** Where this participant stands. */
    now() {
        return this.#insist("GET", "/api/now");
    }

    /** Send an answer; resolves with where the participant stands then, once the answer is saved. */
    async answer(answer) {
        shelf.keep("outbox", { token: this.token, answer });
        return this.#deliver(answer);
    }

    /** Send what was left in the outbox, if it is this participant's; null if there was nothing. */
    async leftover() {
        const left = shelf.kept("outbox");
        if (left === null) return null;
        if (left.token === this.token) {
            try {
                return await this.#deliver(left.answer);
            } catch (refusal) {
                if (!(refusal instanceof Refused) || refusal.status === 401) throw refusal;
            }
        }
        shelf.drop("outbox");
        return null;
    }

    /** Tell how long a screen was seen so far; nobody waits for it, and nothing is lost where it does not arrive. */
    time(times) {
        const body = JSON.stringify(times);
        fetch("/api/time", { ...this.#request("POST", body), keepalive: true }).catch(() => undefined);
    }

    async #deliver(answer) {
        try {
            const reply = await this.#insist("POST", "/api/answer", answer);
            shelf.drop("outbox");
            return reply;
        } catch (refusal) {
            if (refusal instanceof Refused && refusal.status !== 401) shelf.drop("outbox");
            // Another screen is due, because another tab answered or the study was changed: show that one.
            if (refusal instanceof Refused && refusal.status === 409) return this.now();
            throw refusal;
        }
    }

    /** Make a request until there is a reply. */
    async #insist(method, path, content) {
        const body = content === undefined ? undefined : JSON.stringify(content);
        for (let tries = 0; ; tries += 1) {
            let wait = null;
            try {
                const reply = await fetch(path, { ...this.#request(method, body), signal: AbortSignal.timeout(PATIENCE) });
                const said = await reply.json().catch(() => null);
                if (reply.ok && said !== null) {
                    if (tries > 0) this.told("through");
                    return said;
                }
                if (!reply.ok && reply.status < 500 && ![408, 425, 429].includes(reply.status)) {
                    if (tries > 0) this.told("through");
                    throw new Refused(reply.status, said?.error ?? {});
                }
                wait = Number(reply.headers.get("Retry-After")) * 1000 || null;
            } catch (fault) {
                if (fault instanceof Refused) throw fault;
            }
            this.told("trying");
            await this.#pause(wait ?? Math.min(LONGEST, 500 * 2 ** Math.min(tries, 8)));
        }
    }

    #request(method, body) {
        const headers = {};
        if (body !== undefined) headers["Content-Type"] = "application/json";
        if (this.token !== null) headers.Authorization = `Bearer ${this.token}`;
        return { method, headers, body, cache: "no-store", credentials: "omit", referrerPolicy: "no-referrer" };
    }

    /** Wait, a little more or less than that so that not all come back at once, or until somebody hurries. */
    #pause(milliseconds) {
        return new Promise((resolve) => {
            const done = () => {
                clearTimeout(timer);
                this.#wake = null;
                resolve();
            };
            const timer = setTimeout(done, Math.min(milliseconds, 60000) * (0.75 + Math.random() / 2));
            this.#wake = done;
        });
    }
}
