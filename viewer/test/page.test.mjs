// What the page of a recording draws, and what clicks and keys do in it.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { after, before, test } from "node:test";
import { Browser } from "./browser.mjs";
import { changed, recorded, robotFile } from "./pages.mjs";

const COURSE = `
modules = 4
shape = "chain"
[world]
slope_degrees = 10
boxes = [{ at_m = [0.4, 0.0], size_mm = [100, 600, 80] }]
[[event]]
at = 0.5
detach = "1.Back"
`;

/** Drawn with half of the pixels each way, for no GPU is at hand. */
const [WIDTH, HEIGHT, SCALE] = [800, 600, 0.5];

let browser, walk, course, native;

before(async () => {
    walk = recorded("walk", "--modules", "10", "--seconds", "2.5", "--loss", "0.05");
    course = recorded("course", robotFile("course", COURSE), "--seconds", "1");
    native = recorded("native", "--engine", "host", "--modules", "18", "--seconds", "6");
    browser = await Browser.start();
    await browser.resize(WIDTH, HEIGHT, SCALE);
});

after(() => browser?.end());

/** The colours of the picture round a place, each as red, green and blue. */
function colours([x, y]) {
    return browser.run(
        `
        const canvas = document.getElementById("scene");
        const copy = document.createElement("canvas");
        copy.width = copy.height = 13;
        const context = copy.getContext("2d");
        context.drawImage(canvas, 6 - arguments[0] * canvas.width, 6 - arguments[1] * canvas.height);
        const { data } = context.getImageData(0, 0, 13, 13);
        return Array.from({ length: 169 }, (_, pixel) => [...data.slice(4 * pixel, 4 * pixel + 3)]);`,
        x,
        y,
    );
}

test("it draws the robot as the run's report has it", async () => {
    await browser.open(walk.page, "#t=2.4&view=whole&theme=dark");
    const scene = await browser.drawn();
    const types = {};
    for (const { type } of scene.modules) types[type] = (types[type] ?? 0) + 1;
    assert.deepEqual(types, walk.report.types);
    assert.equal(scene.links, 9);
    assert.ok(scene.dockError < 1.5, `docks that hold each other are ${scene.dockError} mm apart`);
    assert.ok(scene.triangles > 10_000);
    const ahead = scene.modules.reduce((sum, { at }) => sum + at[0], 0) / 10;
    await browser.run("superbot.seek(0)");
    const began = (await browser.drawn()).modules.reduce((sum, { at }) => sum + at[0], 0) / 10;
    assert.ok(
        Math.abs(ahead - began - walk.report.distance_m) < 0.03,
        `${ahead - began} m: ${walk.report.distance_m}`,
    );
    assert.deepEqual(await browser.complaints(), []);
});

test("modules have the colours of their types, before the ground", async () => {
    await browser.open(walk.page, "#t=2.4&view=above&theme=dark");
    const { modules } = await browser.drawn();
    const round = (type) => colours(modules.find((module) => module.type === type).onScreen);
    const share = (pixels, is) => pixels.filter(is).length / pixels.length;
    const isRed = ([red, green, blue]) => red > 100 && red > 1.5 * green && red > 1.5 * blue;
    const isGreen = ([red, green, blue]) => green > 80 && green > 1.5 * red && green > blue;
    assert.ok(share(await round("Head"), isRed) > 0.15);
    assert.ok(share(await round("LeftLeg"), isGreen) > 0.15);
    assert.equal(share(await round("LeftLeg"), isRed), 0);
    assert.equal(
        share(await colours([0.5, 0.1]), (pixel) => Math.max(...pixel) > 90),
        0,
        "the ground is dark",
    );
});

test("hormones travel from module to module, and are counted", async () => {
    await browser.open(walk.page, "#t=0&speed=0.01");
    const times = await browser.run("return superbot.hormones.map(({ sent, arrived }) => [sent, arrived])");
    const arrived = times.filter(([, at]) => at !== null);
    assert.equal(arrived.length, walk.report.hormones_delivered + walk.report.hormones_dropped);
    const [sent, came] = arrived[0];
    const lost = await browser.run("return superbot.hormones.filter(({ isLost }) => isLost).length");
    assert.equal(lost, walk.report.hormones_lost);
    await browser.run("superbot.seek(arguments[0])", (sent + came) / 2);
    assert.ok((await browser.drawn()).hormones >= 1);
    await browser.run("superbot.seek(arguments[0])", sent - 0.01);
    assert.equal((await browser.drawn()).hormones, 0);
    await browser.press("\uE010"); // End
    await browser.drawn();
    assert.match(
        await browser.text("facts"),
        new RegExp(`^${arrived.filter(([, at]) => at <= 2.48).length} hormones`),
    );
});

test("frames that links lose are shown where, and counted", async () => {
    await browser.open(walk.page, "#t=0");
    const [first, sum] = await browser.run(
        "return [superbot.losses[0], superbot.losses.reduce((sum, { frames }) => sum + frames, 0)]",
    );
    assert.ok(sum > 10);
    await browser.run("superbot.seek(arguments[0])", first.at - 0.02);
    assert.equal((await browser.drawn()).losing, 0);
    await browser.run("superbot.seek(arguments[0])", first.at + 0.01);
    assert.ok((await browser.drawn()).losing > 0);
    await browser.run("superbot.seek(9)");
    await browser.drawn();
    assert.match(await browser.text("facts"), new RegExp(` ${sum} frames lost`));
});

test("keys play, pause, seek, change speed, select, turn the view and the lights", async () => {
    // Of four modules, for each key is followed by a picture.
    await browser.open(course.page, "#t=0.2&theme=dark");
    const after = async (key) => {
        await browser.press(key);
        return browser.state();
    };
    assert.equal((await browser.state()).isPlaying, false);
    const near = (one, other) => assert.ok(Math.abs(one - other) < 1e-6, `${one} is not ${other}`);
    near((await after(".")).time, 0.24);
    near((await after(",")).time, 0.2);
    near((await after("\uE014")).time, 1); // right
    near((await after("\uE012")).time, 0); // left
    near((await after("\uE010")).time, 1); // End
    near((await after("\uE011")).time, 0); // Home
    assert.equal((await after("-")).speed, 0.5);
    assert.equal((await after("+")).speed, 1);
    assert.equal((await after("n")).selected, 0);
    assert.equal((await after("n")).selected, 1);
    assert.equal((await after("p")).selected, 0);
    assert.equal((await after("p")).selected, 3);
    assert.equal((await after("\uE00C")).selected, null); // Escape
    assert.equal((await after("t")).theme, "light");
    assert.equal((await after("v")).view, 1);
    assert.equal((await after("f")).follows, false);
    await browser.press("----");
    assert.equal((await after(" ")).isPlaying, true);
    await browser.until("return superbot.describe().time > 0.005");
    assert.equal((await after(" ")).isPlaying, false);
    await after("?");
    assert.equal(await browser.run("return document.getElementById('keys').hidden"), false);
});

test("it stops at the end, and plays again from the begin", async () => {
    await browser.open(walk.page, "#t=2.4");
    await browser.press(" ");
    await browser.until("return !superbot.describe().isPlaying");
    assert.equal((await browser.drawn()).time, 2.48);
    await browser.press(" ");
    const { isPlaying, time } = await browser.drawn();
    assert.ok(isPlaying && time < 2, `${time}`);
});

test("a click selects a module and shows what it is, and one beside it none", async () => {
    await browser.open(walk.page, "#t=2.4&view=whole");
    await browser.press("f");
    const { modules } = await browser.drawn();
    const head = modules.findIndex(({ type }) => type === "Head");
    const [x, y] = modules[head].onScreen;
    await browser.click(x * WIDTH, y * HEIGHT);
    assert.equal((await browser.drawn()).selected, head);
    const details = await browser.text("details");
    assert.match(details, /Module 0\s+Type\s+Head\s+Action\s+\w+\s+Motor0\s+-?\d+\.\d°/);
    assert.match(details, /Back\s+1\.Front ● found/);
    await browser.click(WIDTH / 2, 20);
    assert.equal((await browser.drawn()).selected, null);
});

test("a click on the map selects the nearest module", async () => {
    await browser.open(walk.page, "#t=0&view=whole");
    const box = await browser.run(
        "const { right, top, height } = document.getElementById('map').getBoundingClientRect();" +
            "return { right, middle: top + height / 2 }",
    );
    await browser.click(box.right - 60, box.middle);
    assert.notEqual((await browser.drawn()).selected, null);
});

test("who listens and types has all modules in a tree, and the time as a slider", async () => {
    await browser.open(walk.page, "#t=2.4");
    await browser.run("document.getElementById('list').open = true");
    await browser.drawn(); // the list says what modules are once it has been drawn
    const computed = async (selector) => {
        const element = await browser.find(selector);
        return [
            await browser.ask(`/element/${element}/computedrole`),
            await browser.ask(`/element/${element}/computedlabel`),
        ];
    };
    assert.deepEqual(await computed("#tree"), ["tree", "Modules of the robot"]);
    const levels = await browser.run(
        "return [...document.querySelectorAll('[role=treeitem]')]" +
            ".map((item) => [item.innerText.trim(), item.ariaLevel])",
    );
    assert.equal(levels.length, 10);
    for (const [name, level] of levels) assert.equal(level, /Leg/.test(name) ? "2" : "1", name);
    await browser.run("document.querySelector('[role=treeitem]').focus()");
    await browser.press("\uE015"); // down
    const { selected } = await browser.drawn();
    assert.deepEqual(await computed("[aria-selected=true]"), [
        "treeitem",
        `${selected} ${levels[1][0].split(" ")[1]}`,
    ]);
    assert.match(
        await browser.run("return document.getElementById('said').textContent"),
        new RegExp(`^Module ${selected}, `),
    );
    assert.deepEqual(await computed("#seek"), ["slider", "Time"]);
    assert.equal(await browser.run("return document.getElementById('seek').ariaValueText"), "2.40 of 2.48 s");
    assert.match((await computed("#scene"))[1], /^The robot in 3D: Module \d, /);
    assert.deepEqual(await computed("#play"), ["button", "Play"]);
});

test("obstacles stand on the ground, a slope is steep, and what happens is said and done", async () => {
    await browser.open(course.page, "#t=0.4&view=side&theme=light");
    const scene = await browser.drawn();
    assert.equal(scene.links, 3);
    assert.deepEqual(scene.standing, [{ at: [0.4, 0, 0.04], size: [0.1, 0.6, 0.08], turn: 0 }]);
    assert.equal(scene.slope, 10);
    // The tail is drawn below the head.
    assert.ok(scene.modules[3].onScreen[1] > scene.modules[0].onScreen[1] + 0.05);
    await browser.run("superbot.seek(0.6)");
    assert.equal((await browser.drawn()).links, 2);
    assert.match(await browser.text("facts"), /1\.Back is detached$/);
});

test("without a world it says so, and walks where it stands", async () => {
    await browser.open(native.page, "#t=5");
    const scene = await browser.drawn();
    assert.deepEqual([scene.modules.length, scene.links], [18, 17]);
    assert.ok(scene.dockError < 1.5, `${scene.dockError} mm`);
    assert.match(await browser.text("facts"), /no world: joints alone$/);
    assert.doesNotMatch(await browser.text("facts"), /frames lost/);
});

test("it fits a phone", async () => {
    await browser.resize(390, 780, SCALE);
    try {
        await browser.open(walk.page, "#t=2.4&module=1&view=whole");
        const { width, outside, modules } = await browser.run(`
            const controls = [...document.querySelectorAll("button, select, input, #title")]
                .filter((control) => control.checkVisibility());
            const outside = controls.filter((control) => {
                const { left, right, top, bottom, width } = control.getBoundingClientRect();
                return left < 0 || right > innerWidth || top < 0 || bottom > innerHeight || width < 20;
            });
            return { width: document.documentElement.scrollWidth, outside: outside.map(({ id }) => id),
                modules: superbot.describe().modules };`);
        assert.equal(width, 390);
        assert.deepEqual(outside, []);
        const seen = modules.filter(({ onScreen: [x, y] }) => x > 0 && x < 1 && y > 0 && y < 0.55);
        assert.ok(seen.length >= 8, `${seen.length} modules are above what covers the picture`);
    } finally {
        await browser.resize(WIDTH, HEIGHT, SCALE);
    }
});

test("an address that asks for no module that is there selects none", async () => {
    await browser.complaints();
    for (const module of ["1.5", "10", "-1", "Infinity", "head", ""]) {
        await browser.open(walk.page, `#t=1&module=${module}`);
        assert.equal((await browser.drawn()).selected, null, module);
    }
    await browser.open(walk.page, "#t=1&module=9");
    assert.equal((await browser.drawn()).selected, 9);
    assert.deepEqual(await browser.complaints(), []);
});

test("it is as light or dark as the system", async () => {
    for (const theme of ["light", "dark"]) {
        const features = [{ name: "prefers-color-scheme", value: theme }];
        await browser.ask("/goog/cdp/execute", { cmd: "Emulation.setEmulatedMedia", params: { features } });
        await browser.open(walk.page, "#t=0");
        assert.equal((await browser.drawn()).theme, theme);
        const isBright = ([red]) => red > 150;
        assert.equal((await colours([0.5, 0.1])).every(isBright), theme === "light");
    }
});

test("it fetches nothing, and may not", async () => {
    await browser.open(walk.page, "#t=0");
    assert.deepEqual(
        await browser.run("return performance.getEntriesByType('resource').map(({ name }) => name)"),
        [],
    );
    const answer = await browser.run(
        "return fetch('data:text/plain,1').then(() => 'fetched', () => 'refused')",
    );
    assert.equal(answer, "refused");
});

test("a page without a recording says how to come by one", async () => {
    await browser.open(fileURLToPath(new URL("../page.html", import.meta.url)));
    assert.match(
        await browser.run("return document.getElementById('faults').textContent"),
        /\.\/x sim --record FILE\.html/,
    );
});

test("a page that has not come whole says so", async () => {
    const recording = /(<script[^>]* id="?recording"?[^>]*>)([^<]+)/;
    const begin = (text) => text.slice(0, 4 * Math.floor(text.length / 8));
    for (const [name, change] of [
        ["shorter", (page) => page.replace(recording, (_, tag, text) => tag + begin(text))],
        ["garbled", (page) => page.replace(recording, (_, tag, text) => `${tag}?${text}`)],
        ["other", (page) => page.replace(recording, (_, tag, text) => tag + begin(text) + begin(text))],
    ]) {
        const page = changed(name, walk.page, change);
        assert.notEqual(readFileSync(page, "utf8"), readFileSync(walk.page, "utf8"));
        await browser.open(page);
        const said = await browser.run("return document.getElementById('faults').textContent");
        assert.match(said, /the recording is not whole: copy the file anew/, name);
    }
    const cut = changed("cut", walk.page, (page) => page.slice(0, page.search(recording) + 1000));
    await browser.blank();
    await browser.ask("/url", { url: `file://${cut}` });
    assert.match(await browser.text("loading"), /^Loading\. If this stays, .* the file is not whole/);
    await browser.open(walk.page, "#t=0");
    assert.equal(await browser.run("return document.getElementById('loading')"), null);
});
