// Pages to test, as ./x sim --record makes them.

import { spawn, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const folder = mkdtempSync(join(tmpdir(), "superbot-pages-"));
process.on("exit", () => rmSync(folder, { recursive: true, force: true }));

function simulator() {
    const simulator = process.env.SUPERBOT_SIM;
    if (!simulator) throw new Error("SUPERBOT_SIM has to name the program superbot-sim");
    return simulator;
}

/** Runs a robot; returns its page's path and its report. */
export function recorded(name, ...args) {
    const page = join(folder, `${name}.html`);
    const json = join(folder, `${name}.json`);
    const run = spawnSync(simulator(), ["sim", ...args, "--record", page, "--json", json], {
        encoding: "utf8",
    });
    // 1: the robot did not do as it should, which shows.
    if (run.status !== 0 && run.status !== 1) throw new Error(run.stderr || String(run.error));
    return { page, report: JSON.parse(readFileSync(json, "utf8")) };
}

/** A copy of a page, changed; returns its path. */
export function changed(name, page, change) {
    const path = join(folder, `${name}.html`);
    writeFileSync(path, change(readFileSync(page, "utf8")));
    return path;
}

/** Starts a run that is looked at as it goes on. Returns where its page is, its process, and what waits for
 * its report. */
export async function served(name, ...args) {
    const json = join(folder, `${name}.json`);
    const process = spawn(simulator(), ["sim", ...args, "--view", "--json", json], {
        stdio: ["ignore", "ignore", "pipe"],
    });
    const over = new Promise((resolve) => process.on("exit", resolve));
    const address = await new Promise((resolve, reject) => {
        let said = "";
        process.stderr.setEncoding("utf8").on("data", (text) => {
            said += text;
            const found = /look at (\S+)/.exec(said);
            if (found) resolve(found[1]);
        });
        over.then(() => reject(new Error(said)));
    });
    const report = () => over.then(() => JSON.parse(readFileSync(json, "utf8")));
    return { address, process, report };
}

/** A robot file. */
export function robotFile(name, text) {
    const path = join(folder, `${name}.toml`);
    writeFileSync(path, text);
    return path;
}
