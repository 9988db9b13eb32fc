// What the page of a run that goes on draws, and what keys, clicks and a lost program do in it.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { Browser } from "./browser.mjs";
import { recorded, robotFile, served } from "./pages.mjs";

let browser;
const runs = [];

before(async () => {
    browser = await Browser.start();
    await browser.resize(800, 600, 0.5);
});

after(async () => {
    await browser?.end();
    runs.forEach(({ process }) => process.kill("SIGKILL"));
});

/** Opens a robot that runs natively. It waits. */
const opened = (name, ...args) => watched(name, "--engine", "host", ...args);

async function watched(name, ...args) {
    const run = await served(name, ...args);
    runs.push(run);
    await browser.open(run.address, "#t=0&view=whole&theme=dark");
    return run;
}

const press = async (key) => {
    await browser.press(key);
    return browser.state();
};

const click = (text) =>
    browser.run(
        `const buttons = [...document.querySelectorAll("button")];
        buttons.find((button) => button.textContent === arguments[0]).click();`,
        text,
    );

/** Runs it to a time, which the page shows then. */
const runTo = async (time) => {
    await browser.run("superbot.seek(arguments[0])", time);
    await browser.until("return Math.abs(superbot.describe().time - arguments[0]) < 1e-6", time);
};

test("it plays, pauses, steps and seeks, and runs no further than one looks", async () => {
    await opened("walk", "--modules", "10", "--seconds", "30");
    assert.deepEqual([(await browser.state()).time, (await browser.state()).isPlaying], [0, false]);
    await press(".");
    await browser.until("return superbot.describe().time === 0.04");
    assert.equal((await browser.state()).present, 0.04);
    await click("Step");
    await browser.until("return superbot.describe().time === 0.08");
    await press(" ");
    await browser.until("return superbot.describe().time > 1");
    const { time } = await press(" ");
    const { present } = await new Promise((done) => setTimeout(() => done(browser.state()), 300));
    assert.ok(present < time + 1, `${present} is far ahead of ${time}`);
    const later = await browser.state();
    assert.deepEqual([later.time, later.present], [time, present], "it waits");
    await runTo(3);
    const scene = await browser.drawn();
    assert.equal(scene.links, 9);
    assert.equal(scene.modules.filter(({ type }) => type === "LeftLeg").length, 2);
    assert.match(await browser.text("facts"), /^[1-9]\d* hormones arrived/);
    assert.match(await browser.text("legend"), /LeftLeg/);
    const back = await press("\uE012"); // left
    assert.deepEqual([back.time, back.present], [2, 3], "what was seen is still there");
    assert.deepEqual(await browser.complaints(), []);
});

test("what is done by hand is seen and said, and done again by the robot file of it", async () => {
    const { report } = await opened("hand", "--modules", "10", "--seconds", "4", "--seed", "7");
    await runTo(1);
    await browser.run("superbot.select(4)");
    await browser.drawn();
    await click("Pull off Front");
    await browser.until("return superbot.describe().links === 8");
    assert.match(await browser.text("facts"), /4\.Front is detached$/);
    assert.match(await browser.text("note"), /^done: detach = "4\.Front"$/);
    await runTo(2);
    await click("Put back Front");
    await browser.until("return superbot.describe().links === 9");
    await click("Stop");
    await browser.until("return superbot.describe().happenings.length === 3");
    assert.match((await browser.state()).happenings[2][1], /^an order to stop at 4\./);
    await browser.run("document.getElementById('loss').value = 150");
    await click("Lose");
    await browser.until("return document.getElementById('note').textContent.startsWith('not done')");
    assert.match(await browser.text("note"), /give a probability from 0 to 1/);
    const file = await browser.run(
        `const asked = fetch("ask", { method: "POST", body: '{"timeline":null}' });
        return asked.then((answer) => answer.text());`,
    );
    assert.match(file, /\[\[event\]\]\nat = 1\.0\ndetach = "4\.Front"\n/);
    await runTo(4);
    await browser.until("return superbot.describe().isOver");
    assert.match(await browser.run("return document.getElementById('summary').textContent"), /^10 modules/);
    await browser.blank();
    const { state_hash } = await report();
    const args = ["--engine", "host", "--seconds", "4", "--seed", "7"];
    const again = recorded("again", robotFile("again", file), ...args);
    assert.equal(again.report.state_hash, state_hash);
});

test("a stop takes no Period, and a walk only one that can be ordered", async () => {
    await opened("orders", "--modules", "3", "--seconds", "30");
    await runTo(1);
    const field = "const field = document.getElementById('period');";
    for (const period of ["", "10", "260", "4050"]) {
        await browser.run(`${field} field.value = arguments[0]; field.focus()`, period);
        // The beginning of a number alone is none.
        if (!period) await browser.press("1e");
        await click("Walk");
        assert.match(await browser.text("note"), /^not done: give a Period from 250 to 4000 ms/);
        await browser.run("document.getElementById('note').textContent = ''");
    }
    const done = (order) =>
        browser.until(
            `return document.getElementById("note").textContent.startsWith(arguments[0]) &&
                superbot.describe().happenings.length === arguments[1]`,
            `done: command = [${order}], `,
            Number(order.split(", ")[1]),
        );
    await click("Stop");
    await done("208, 1, 255");
    assert.match((await browser.state()).happenings[0][1], /^an order to stop/);
    await browser.run(`${field} field.value = 500; document.getElementById("gait").value = 2`);
    await click("Walk");
    await done("210, 2, 10");
    await browser.run(`${field} field.value = ""`);
    await click("Walk");
    await done("210, 3, 255");
});

test("an order goes in by a module that runs", async () => {
    await opened("dark", "chain", "--modules", "2", "--seconds", "30");
    await click("Stop");
    assert.match(await browser.text("note"), /^not done: no module that runs has a free dock/, "none has begun");
    await runTo(1);
    const off = async (module) => {
        await browser.run("superbot.select(arguments[0])", module);
        await browser.drawn();
        await click("Power off");
        await runTo(module + 2);
    };
    await off(0);
    await click("Stop");
    await browser.until("return superbot.describe().happenings.length === 2");
    assert.match(await browser.text("note"), /^done: command = \[208, 2, 255\], to = "1\./);
    await off(1);
    await click("Stop");
    assert.match(await browser.text("note"), /^not done: no module that runs has a free dock/);
});

test("it goes on while another page pauses, and for no page that has gone", async () => {
    const robot = ["chain", "--modules", "2", "--world", "none"];
    const { address } = await watched("two", ...robot, "--seconds", "600");
    const ask = async (wish, query = "") => {
        const answer = await fetch(`${address}ask${query}`, { method: "POST", body: JSON.stringify(wish) });
        assert.ok(answer.ok);
        return answer.text();
    };
    await browser.run("superbot.seek(600)");
    const other = await fetch(`${address}live?had=0`);
    await ask({ until: 0 }, `?stream=${other.headers.get("stream")}`);
    const { present } = await browser.state();
    await browser.until("return superbot.describe().present > arguments[0] + 0.5", present);
    await browser.blank();
    const now = async () => {
        await ask({ event: "loss = 0" });
        return (await ask({ timeline: null })).match(/^at = .+$/gm).at(-1);
    };
    let [before, waits] = [null, false];
    for (let tries = 0; tries < 20 && !waits; tries++) {
        const time = await now();
        waits = time === before;
        before = time;
        await new Promise((resolve) => setTimeout(resolve, 300));
    }
    assert.ok(waits, "it goes on for a page that has gone");
    await other.body.cancel();
});

test("a lost connection is said and mended, and what was seen outlasts the program", async () => {
    const { process } = await opened("lost", "--modules", "5", "--seconds", "30");
    await runTo(1);
    assert.equal(await browser.text("lost"), "");
    process.kill("SIGSTOP");
    await browser.until("return !superbot.describe().isThere");
    assert.match(await browser.text("lost"), /^The connection is lost: trying again/);
    await browser.run("superbot.seek(1.6)");
    process.kill("SIGCONT");
    await browser.until("return superbot.describe().isThere");
    assert.equal(await browser.text("lost"), "");
    await browser.until("return superbot.describe().time === 1.6");
    await runTo(2);
    process.kill("SIGKILL");
    await browser.until("return !superbot.describe().isThere");
    await runTo(0.6);
    assert.equal((await browser.drawn()).modules.length, 5);
});

test("inside of a module are its tasks, as its own console has them, links, sensors and counts", async () => {
    const { address } = await watched("inside", "chain", "--modules", "2", "--world", "none", "--seconds", "30");
    // Of what was refused and lost before: the page of a run that was killed tries again until it is left.
    const before = await browser.complaints();
    assert.ok(!before.some((complaint) => complaint.includes(new URL(address).host)), before.join("\n"));
    await browser.run("superbot.select(1)");
    await runTo(0.4);
    await browser.drawn();
    await click("Ask its console");
    await browser.until("return superbot.describe().happenings.length === 1");
    await runTo(3);
    const inside = await browser.until("return superbot.inside()?.at === 3 && superbot.inside()");
    const [{ text, is_complete: isComplete }] = inside.consoles;
    assert.ok(isComplete, text);
    // Priority, bytes of stack, and how many of them were never used: the console lists them in an order of its own.
    const [tasks] = text.split("\nlinks");
    const bySize = (one, other) => one[0] - other[0] || one[1] - other[1];
    const told = [...tasks.matchAll(/^.+ (\d) +(\d+) +(\d+)$/gm)].map((row) => row.slice(2).map(Number));
    const usedThen = told.map(([stack, unused]) => [stack, stack - unused]).sort(bySize);
    const seen = inside.mcus.flatMap(({ tasks }) => tasks);
    assert.ok(seen.length > 15, `${seen.length} tasks`);
    const usedNow = seen.map(({ stack, used }) => [stack, used]).sort(bySize);
    assert.deepEqual(
        usedNow.map(([stack]) => stack),
        usedThen.map(([stack]) => stack),
    );
    usedNow.forEach(([stack, used], index) => {
        assert.ok(used >= usedThen[index][1] && used <= stack, `${used} of ${stack}`);
    });
    assert.equal(seen.find(({ name }) => name === "HORMONE").state, "waits for HORMONE");
    assert.ok(inside.mcus.every(({ awake_percent: awake }) => awake > 1 && awake < 60));
    await browser.run("document.querySelectorAll('#inside details').forEach((part) => (part.open = true))");
    await browser.drawn();
    assert.match(await browser.text("inside"), /HORMONE\s+waits for HORMONE\s+\d+ of \d+/);
    const front = inside.links.find(({ dock }) => dock === "Front");
    assert.ok(front.sent > 20 && front.received > 20 && inside.acceleration[2] > 0.9);
    await browser.press("\uE00C"); // Escape
    await browser.drawn();
    assert.equal(await browser.text("inside"), "");
    assert.deepEqual(await browser.complaints(), []);
});

test("on a phone's width nothing is cut off at a side", async () => {
    await browser.resize(390, 780, 0.5);
    try {
        await opened("phone", "--modules", "3", "--seconds", "30");
        await browser.run("superbot.select(1)");
        await browser.drawn();
        const wide = await browser.run(`
            return [document.documentElement, document.getElementById("side")]
                .filter(({ scrollWidth, clientWidth }) => scrollWidth > clientWidth).map(({ id }) => id);`);
        assert.deepEqual(wide, []);
    } finally {
        await browser.resize(800, 600, 0.5);
    }
});

test("in a world a push moves a module", async () => {
    await watched("push", "chain", "--modules", "1", "--seconds", "30");
    await browser.run("superbot.select(0)");
    await runTo(1);
    const [, before] = (await browser.drawn()).modules[0].at;
    await click("Push left");
    await browser.until("return superbot.describe().happenings.length === 1");
    await runTo(2);
    const { modules, happenings } = await browser.drawn();
    assert.equal(happenings.at(-1)[1], "module 0 is pushed by 0, 30 and 0 N");
    assert.ok(modules[0].at[1] - before > 0.3, `${modules[0].at[1] - before} m`);
});
