// What this browser keeps between two loads of the page: the token, the answer on its way, the withdrawal code.
// Where the browser forbids storage (some iframes), it is kept in memory, and `lasting` is false.

const memory = new Map();

function usable(name) {
    try {
        const storage = globalThis[name];
        storage.setItem("study.probe", "1");
        storage.removeItem("study.probe");
        return storage;
    } catch {
        return null;
    }
}

const tab = usable("sessionStorage");
const browser = usable("localStorage");

/** Whether what is kept outlives a reload of the page. */
export const lasting = tab !== null;

/** Keep a value for this tab. */
export function keep(key, value) {
    memory.set(key, value);
    try {
        tab?.setItem(`study.${key}`, JSON.stringify(value));
    } catch {
        // The browser's storage is full: what is in memory lasts as long as the page does.
    }
}

/** What was kept for this tab, or null. */
export function kept(key) {
    if (memory.has(key)) return memory.get(key);
    return tab ? parsed(tab.getItem(`study.${key}`)) : null;
}

/** Forget a value of this tab. */
export function drop(key) {
    memory.delete(key);
    tab?.removeItem(`study.${key}`);
}

/** Keep the token beyond this tab, for those who come back later: with whether they came to the end; null forgets it. */
export function remember(token, ended = false) {
    try {
        if (token === null) browser?.removeItem("study.token");
        else browser?.setItem("study.token", JSON.stringify({ token, ended }));
    } catch {
        // Full storage: this tab's own copy of the token is enough unless the browser goes down.
    }
}

/** Who was here before, {token, ended}, or null. */
export function remembered() {
    const found = browser ? parsed(browser.getItem("study.token")) : null;
    return typeof found?.token === "string" ? found : null;
}

function parsed(text) {
    try {
        return text === null ? null : JSON.parse(text);
    } catch {
        return null;
    }
}
