// The way to a run that goes on: what comes of it, and what it is asked for.

import { unpack } from "./unpack.js";

/** After so many ms without a word the connection is lost; the program says something twice a second. */
const SILENCE = 2500;
/** After so many ms it is tried again. */
const AGAIN = 500;

const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** The messages in a stream of bytes, as ../src/lib.rs puts them: null where one says nothing. */
async function* messages(stream) {
    const reader = stream.getReader();
    let bytes = new Uint8Array(0);
    for (;;) {
        const { value, done } = await reader.read();
        if (done) return;
        const joined = new Uint8Array(bytes.length + value.length);
        joined.set(bytes);
        joined.set(value, bytes.length);
        bytes = joined;
        while (bytes.length >= 8) {
            const lengths = new DataView(bytes.buffer, bytes.byteOffset);
            const [words, rest] = [lengths.getUint32(0, true), lengths.getUint32(4, true)];
            const end = 8 + words + rest;
            if (bytes.length < end) break;
            const text = new TextDecoder().decode(bytes.subarray(8, 8 + words));
            yield words ? { said: JSON.parse(text), bytes: bytes.subarray(8 + words, end) } : null;
            bytes = bytes.subarray(end);
        }
    }
}

export class Live {
    /** `on` has what is done when news came, the run ended, something is said, and the connection is lost or
     * there. */
    constructor(run, on) {
        Object.assign(this, { run, on, had: 0, isOver: false, isThere: false, inspected: null });
        // What the program calls this page while it is connected.
        this.stream = null;
        // Until when it was asked to run, and the wish that waits for its turn.
        Object.assign(this, { until: 0, next: null, isAsking: false });
        // How fast it runs, in s of it a second, and when news came last.
        Object.assign(this, { rate: 0, heard: 0 });
    }

    /** Listens for as long as the page is there. */
    async listen() {
        for (;;) {
            await this.hear().catch(() => {});
            this.be(false);
            await wait(AGAIN);
        }
    }

    async hear() {
        const silence = new AbortController();
        let timer = setTimeout(() => silence.abort(), SILENCE);
        try {
            const answer = await fetch(`live?had=${this.had}`, { signal: silence.signal });
            if (!answer.ok) return;
            this.stream = answer.headers.get("stream");
            for await (const message of messages(answer.body)) {
                clearTimeout(timer);
                timer = setTimeout(() => silence.abort(), SILENCE);
                this.be(true);
                if (message) this.take(message);
            }
        } finally {
            clearTimeout(timer);
        }
    }

    be(isThere) {
        if (this.isThere === isThere) return;
        this.isThere = isThere;
        if (isThere) {
            // What was asked for is forgotten with the connection, if it came there at all.
            const { until } = this;
            this.until = 0;
            if (until > this.run.seconds) this.ask(until);
            if (this.inspected !== null) this.inspect(this.inspected);
        }
        this.on.connected(isThere);
    }

    take({ said, bytes }) {
        this.had++;
        if (said.ended) {
            this.isOver = true;
            this.on.ended(said.ended);
        } else if (said.said) {
            this.on.said(said.said);
        } else if (said.module) {
            this.run.tell(said.module);
            this.on.news();
        } else if ("looks" in said) {
            const before = this.run.seconds;
            this.run.append(said, unpack(bytes, this.run.about, said.looks));
            this.measure(this.run.seconds - before);
            this.on.news();
        }
    }

    measure(came) {
        const now = performance.now();
        const took = (now - this.heard) / 1000;
        if (!came) return;
        // After a pause nothing follows from how long it took.
        if (took < 2) this.rate += 0.2 * (came / Math.max(took, 0.001) - this.rate);
        this.heard = now;
    }

    /** How fast the page may play at a time, so that it need not wait for what comes next. */
    pace(time) {
        if (this.isOver || this.run.seconds >= this.until) return Infinity;
        const ahead = (this.run.seconds - time) / (2 * this.run.about.every);
        return Math.max(this.rate, 0.05) * Math.min(ahead, 2);
    }

    /** The page plays at this speed from this time on. */
    play(time, speed) {
        const lead = Math.max(6 * this.run.about.every, 0.4 * speed);
        if (this.until < time + lead / 2) this.ask(time + lead);
    }

    /** The run is to go on until then, and no further. */
    async ask(until) {
        if (this.isOver || until === this.until) return;
        this.until = this.next = until;
        if (this.isAsking) return;
        this.isAsking = true;
        while (this.next !== null) {
            const wish = { until: this.next };
            this.next = null;
            await this.send(wish).catch(() => {});
        }
        this.isAsking = false;
    }

    /** Wants to be told what there is to see inside of this module, or of none. */
    inspect(module) {
        this.inspected = module;
        if (!this.isOver) this.send({ inspect: module }).catch(() => {});
    }

    /** Asks for something; returns what was said, and throws what speaks against it. */
    async send(wish) {
        const sent = { method: "POST", body: JSON.stringify(wish) };
        const answer = await fetch(`ask?stream=${this.stream}`, sent).catch(() => {
            throw new Error("the connection is lost");
        });
        const text = await answer.text();
        if (!answer.ok) throw new Error(text);
        return text;
    }
}
