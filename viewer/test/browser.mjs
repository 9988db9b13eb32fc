// A headless Chromium, driven through chromedriver by the WebDriver protocol (W3C), with Node alone.

import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
    // Nothing is to be fetched but from this machine, and nothing could be.
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
];

/** The key of a web element in the protocol's answers. */
const ELEMENT = "element-6066-11e4-a52e-4f735466cecf";

/** Starts chromedriver. It ends if the port that it chose is free for IPv6 and not for IPv4; then it is started
 * again, up to nine times. */
async function startDriver(tries = 10) {
    const driver = spawn("chromedriver", ["--port=0"], { stdio: ["ignore", "pipe", "inherit"] });
    let said = "";
    const port = await new Promise((resolve, reject) => {
        driver.stdout.on("data", (text) => {
            said += text;
            const found = /successfully on port (\d+)/.exec(said);
            if (found) resolve(found[1]);
        });
        driver.on("error", reject);
        driver.on("close", () => resolve(null));
    });
    if (port !== null) return { driver, port };
    if (tries > 1 && said.includes("port not available")) return startDriver(tries - 1);
    throw new Error(`chromedriver ended: ${said}`);
}

export class Browser {
    /** Starts a browser with a window of this size. */
    static async start({ width = 1280, height = 720 } = {}) {
        const browser = new Browser();
        browser.profile = mkdtempSync(join(tmpdir(), "superbot-browser-"));
        const { driver, port } = await startDriver();
        browser.driver = driver;
        browser.address = `http://127.0.0.1:${port}/session`;
        const args = [...FLAGS, `--window-size=${width},${height}`, `--user-data-dir=${browser.profile}`];
        const chrome = { args, binary: process.env.CHROMIUM ?? "/usr/bin/chromium" };
        const logs = { "goog:loggingPrefs": { browser: "ALL" } };
        const capabilities = {
            alwaysMatch: { browserName: "chrome", "goog:chromeOptions": chrome, ...logs },
        };
        const { sessionId } = await browser.ask("", { capabilities });
        browser.address += `/${sessionId}`;
        return browser;
    }

    async ask(path, body) {
        const sent = body === undefined ? {} : { method: "POST", body: JSON.stringify(body) };
        const answer = await fetch(this.address + path, sent);
        const { value } = await answer.json();
        if (!answer.ok) throw new Error(`${path}: ${value.error}: ${value.message}`);
        return value;
    }

    /** Opens a page. The one that is open stays, and obeys what stands behind its #. */
    async open(file, hash = "") {
        if (this.file === file) {
            await this.run("superbot.obey(arguments[0]); document.activeElement.blur()", hash.slice(1));
            return;
        }
        this.file = file;
        const address = file.startsWith("http:") ? file : `file://${file}`;
        await this.ask("/url", { url: address + hash });
        await this.until("return window.superbot || !document.getElementById('faults').hidden");
    }

    /** Leaves the page. */
    async blank() {
        this.file = null;
        await this.ask("/url", { url: "about:blank" });
    }

    /** What a script returns. */
    run(script, ...args) {
        return this.ask("/execute/sync", { script, args });
    }

    /** What a script returns once that is true. In half a minute a machine that tests simavr, too, gets there. */
    async until(script, ...args) {
        for (let tries = 0; tries < 600; tries++) {
            const value = await this.run(script, ...args);
            if (value) return value;
            await new Promise((resolve) => setTimeout(resolve, 50));
        }
        throw new Error(`never true: ${script}`);
    }

    /** What the page is about to draw. */
    state() {
        return this.run("return superbot.describe()");
    }

    /** What it has drawn: two frames later all is. */
    drawn() {
        return this.run(
            "return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => " +
                "done(superbot.describe()))))",
        );
    }

    text(name) {
        return this.run("return document.getElementById(arguments[0]).innerText", name);
    }

    async find(selector) {
        return (await this.ask("/element", { using: "css selector", value: selector }))[ELEMENT];
    }

    async press(keys) {
        const actions = [...keys].flatMap((value) => [
            { type: "keyDown", value },
            { type: "keyUp", value },
        ]);
        await this.ask("/actions", { actions: [{ type: "key", id: "keyboard", actions }] });
    }

    async click(x, y) {
        const actions = [
            { type: "pointerMove", x: Math.round(x), y: Math.round(y) },
            { type: "pointerDown", button: 0 },
            { type: "pointerUp", button: 0 },
        ];
        await this.ask("/actions", { actions: [{ type: "pointer", id: "mouse", actions }] });
    }

    /** Gives the page this size, in CSS pixels, of which each is drawn with `scale` pixels. */
    resize(width, height, scale = 1) {
        return this.ask("/goog/cdp/execute", {
            cmd: "Emulation.setDeviceMetricsOverride",
            params: { width, height, deviceScaleFactor: scale, mobile: false },
        });
    }

    /** The page as a PNG. */
    async picture() {
        return Buffer.from(await this.ask("/screenshot"), "base64");
    }

    /** What the page has complained of. */
    async complaints() {
        const entries = await this.ask("/se/log", { type: "browser" });
        return entries.filter(({ level }) => level === "SEVERE").map(({ message }) => message);
    }

    async end() {
        try {
            await fetch(this.address, { method: "DELETE" });
        } finally {
            this.driver.removeAllListeners("exit");
            this.driver.kill();
            rmSync(this.profile, { recursive: true, force: true, maxRetries: 5 });
        }
    }
}
