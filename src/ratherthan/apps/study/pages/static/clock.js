// A screen appears, milliseconds leave: how long it could be seen, and how long it was hidden behind another tab or window.

export class Clock {
    #visible = 0;
    #hidden = 0;
    #since = null;
    #wasHidden = false;
    #onHide;

    /** `onHide` is called when the page is hidden or left, so that the time so far can be told. */
    constructor(onHide) {
        this.#onHide = onHide;
        this.changed = () => {
            this.#add();
            if (document.hidden && this.running) this.#onHide();
        };
        this.left = () => {
            if (this.running) this.#onHide();
        };
        document.addEventListener("visibilitychange", this.changed);
        addEventListener("pagehide", this.left);
    }

    get running() {
        return this.#since !== null;
    }

    /** Begin at zero. */
    start() {
        this.#visible = 0;
        this.#hidden = 0;
        this.resume();
    }

    /** Go on from where it was stopped. */
    resume() {
        this.#since = performance.now();
        this.#wasHidden = document.hidden;
    }

    /** The times so far, in whole milliseconds. */
    read() {
        this.#add();
        return { time_ms: Math.round(this.#visible), hidden_ms: Math.round(this.#hidden) };
    }

    /** The times at the end; the clock stands still afterwards. */
    stop() {
        const times = this.read();
        this.#since = null;
        return times;
    }

    #add() {
        if (this.#since === null) return;
        const now = performance.now();
        if (this.#wasHidden) this.#hidden += now - this.#since;
        else this.#visible += now - this.#since;
        this.#since = now;
        this.#wasHidden = document.hidden;
    }
}
