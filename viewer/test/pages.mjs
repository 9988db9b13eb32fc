// Pages to test, as ./x sim --record makes them.

import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const folder = mkdtempSync(join(tmpdir(), "superbot-pages-"));
process.on("exit", () => rmSync(folder, { recursive: true, force: true }));

/** Runs a robot; returns its page's path and its report. */
export function recorded(name, ...args) {
    const simulator = process.env.SUPERBOT_SIM;
    if (!simulator) throw new Error("SUPERBOT_SIM has to name the program superbot-sim");
    const page = join(folder, `${name}.html`);
    const json = join(folder, `${name}.json`);
    const run = spawnSync(simulator, ["sim", ...args, "--record", page, "--json", json], {
        encoding: "utf8",
    });
    // 1: the robot did not do as it should, which shows.
    if (run.status !== 0 && run.status !== 1) throw new Error(run.stderr || String(run.error));
    return { page, report: JSON.parse(readFileSync(json, "utf8")) };
}

/** A robot file. */
export function robotFile(name, text) {
    const path = join(folder, `${name}.toml`);
    writeFileSync(path, text);
    return path;
}
