// The page: plays a recording, or a run as it goes on.

import { THEMES } from "./colours.js";
import { Controls } from "./controls.js";
import { showDetails } from "./details.js";
import { boxes } from "./ground.js";
import { head, showEnd, showFacts, showLegend } from "./head.js";
import { showInside } from "./inside.js";
import { Live } from "./live.js";
import { Map } from "./map.js";
import { Run } from "./run.js";
import { Picture } from "./scene.js";
import { drawBand, drawTime } from "./timeline.js";
import { Tree } from "./tree.js";
import { inflated, unpack } from "./unpack.js";

const SPEEDS = [1 / 300, 1 / 100, 1 / 30, 0.1, 0.25, 0.5, 1, 2, 4, 8];
const by = (id) => document.getElementById(id);
const isNarrow = matchMedia("(width <= 640px)");
const state = { time: 0, isPlaying: false, speed: 1, selected: null, theme: "dark", isDirty: true };
/** The time that is wanted, which may not have come yet. */
state.goal = 0;

function fail(error) {
    by("loading")?.remove();
    by("faults").hidden = false;
    by("faults").textContent = `This can't be shown: ${error.message ?? error}`;
    throw error;
}

/** The run, and the way to it where it goes on: what comes of that is said to `page`, once there is one. */
async function load(page) {
    if (!by("about"))
        throw new Error("there is no recording in this page; make one with ./x sim --record FILE.html");
    const read = (name) => JSON.parse(by(name).textContent);
    const run = new Run(read("about"));
    if (!by("recording")) return { run, live: await present(run, page) };
    if (!("DecompressionStream" in window))
        throw new Error("the browser is too old: it has no DecompressionStream");
    const part = read("part");
    try {
        run.append(part, unpack(await inflated(by("recording").textContent), run.about, part.looks));
    } catch {
        throw new Error("the recording is not whole: copy the file anew, or make it again");
    }
    return { run, live: null };
}

/** The way to a run that goes on, of which something has come. */
function present(run, page) {
    return new Promise((resolve) => {
        const live = new Live(run, {
            news: () => (page.news ? page.news() : resolve(live)),
            ended: (ended) => page.ended?.(ended),
            said: (text) => page.tell?.(text),
            connected: (isThere) => {
                by("lost").textContent = isThere
                    ? ""
                    : "The connection is lost: trying again. If the program has ended, start it anew.";
            },
        });
        live.listen();
    });
}

function begin({ run, live }, page) {
    const canvas = by("scene");
    const redraw = () => (state.isDirty = true);
    let picture;
    try {
        const isSmooth = new URLSearchParams(location.hash.slice(1)).has("smooth") || undefined;
        picture = new Picture(canvas, run, redraw, isSmooth);
    } catch {
        throw new Error("the browser draws no 3D here: WebGL 2 is switched off or missing");
    }
    const map = new Map(by("map"), run);
    const tree = new Tree(by("tree"), run, select);
    let band = null;
    let shownDetails = -1;

    function say(text) {
        by("said").textContent = text;
    }

    function describe(module = state.selected) {
        if (module === null) return `${run.modules} modules at ${state.time.toFixed(2)} s`;
        return `Module ${module}, ${run.type(module, state.time)}, ${run.action(module, state.time)}`;
    }

    /** Where it ends, as far as that is known. */
    function end() {
        return live && !live.isOver ? run.about.seconds : run.seconds;
    }

    function seek(time) {
        state.goal = Math.min(Math.max(time, 0), end());
        state.time = Math.min(state.goal, run.seconds);
        if (state.goal > run.seconds) live?.ask(state.goal);
        redraw();
    }

    function play(isPlaying) {
        if (isPlaying && state.time >= end()) state.time = 0;
        if (!isPlaying && state.isPlaying) live?.ask(run.seconds);
        state.goal = state.time;
        state.isPlaying = isPlaying;
        by("play").textContent = isPlaying ? "❚❚" : "▶";
        by("play").setAttribute("aria-label", isPlaying ? "Pause" : "Play");
        say(isPlaying ? "plays" : `pauses at ${state.time.toFixed(2)} s`);
        redraw();
    }

    function pace(speed) {
        state.speed = speed;
        by("speed").value = speed;
        redraw();
    }

    function faster(step) {
        pace(SPEEDS[Math.min(Math.max(SPEEDS.indexOf(state.speed) + step, 0), SPEEDS.length - 1)]);
    }

    function select(module) {
        state.selected = module;
        picture.view.last = null;
        if (module !== null) {
            if (!tree.element.contains(document.activeElement)) tree.reveal(module);
            if (picture.view.follows)
                picture.view.lookAt(run.place(module, state.time).applyMatrix4(picture.world.matrixWorld));
        }
        say(module === null ? "no module selected" : describe());
        live?.inspect(module);
        shownDetails = -1;
        redraw();
    }

    function step(by) {
        const count = run.modules;
        select(state.selected === null ? (by > 0 ? 0 : count - 1) : (state.selected + by + count) % count);
    }

    function follow(follows) {
        picture.view.follows = follows;
        by("follow").setAttribute("aria-pressed", follows);
        redraw();
    }

    function theme(name) {
        state.theme = name;
        document.documentElement.classList.toggle("light", name === "light");
        by("theme").textContent = name === "light" ? "Dark" : "Light";
        picture.setTheme(name);
        band = null;
        redraw();
    }

    function help() {
        by("keys").hidden = !by("keys").hidden;
        by("help").setAttribute("aria-expanded", !by("keys").hidden);
    }

    const keys = {
        " ": () => play(!state.isPlaying),
        ArrowLeft: () => seek(state.time - 1),
        ArrowRight: () => seek(state.time + 1),
        ",": () => seek(state.time - run.about.every),
        ".": () => seek(Math.max(state.goal, state.time) + run.about.every),
        "-": () => faster(-1),
        "+": () => faster(1),
        "=": () => faster(1),
        Home: () => seek(0),
        End: () => seek(run.seconds),
        n: () => step(1),
        p: () => step(-1),
        Escape: () => select(null),
        f: () => follow(!picture.view.follows),
        v: () => say(`view: ${picture.view.show(run, state.time)}`),
        t: () => theme(state.theme === "light" ? "dark" : "light"),
        "?": help,
    };
    addEventListener("keydown", (event) => {
        const { target, key } = event;
        if (event.ctrlKey || event.metaKey || event.altKey || target.matches("select, input[type=number]"))
            return;
        // A button takes its own Space, and the slider its own arrows.
        if (target.matches("button, summary") && (key === " " || key === "Enter")) return;
        if (target.matches("input") && /^(Arrow|Home|End)/.test(key)) return;
        const act = keys[key.length === 1 ? key.toLowerCase() : key];
        if (!act) return;
        event.preventDefault();
        act();
    });
    by("play").onclick = () => play(!state.isPlaying);
    by("step").hidden = !live;
    by("step").onclick = keys["."];
    by("follow").onclick = () => follow(!picture.view.follows);
    by("view").onclick = keys.v;
    by("theme").onclick = keys.t;
    by("help").onclick = help;
    by("speed").onchange = () => pace(Number(by("speed").value));
    by("seek").oninput = () => seek(Number(by("seek").value));

    // A click is no drag.
    let pressed = null;
    canvas.addEventListener("pointerdown", ({ offsetX, offsetY }) => (pressed = [offsetX, offsetY]));
    canvas.addEventListener("pointerup", ({ offsetX, offsetY }) => {
        if (!pressed || Math.hypot(offsetX - pressed[0], offsetY - pressed[1]) > 5) return;
        select(picture.pick(offsetX, offsetY, canvas.clientWidth, canvas.clientHeight));
    });
    by("map").addEventListener("click", ({ offsetX, offsetY }) => {
        const module = map.pick(offsetX, offsetY);
        if (module !== null) select(module);
    });

    function resize() {
        const isBare = document.body.classList.contains("bare");
        const height = canvas.clientHeight;
        document.documentElement.style.setProperty("--footer", `${by("footer").offsetHeight}px`);
        const lowest = isNarrow.matches ? by("side") : by("footer");
        const right = isBare || isNarrow.matches ? 0 : by("side").offsetWidth;
        picture.resize(
            canvas.clientWidth,
            height,
            right,
            isBare ? 0 : height - lowest.getBoundingClientRect().top,
        );
        band = null;
        redraw();
    }
    addEventListener("resize", resize);
    new ResizeObserver(resize).observe(by("side"));

    function show() {
        const { time, selected } = state;
        const colours = THEMES[state.theme];
        picture.view.follow(run, time, selected);
        picture.draw(time, state.speed, selected);
        map.draw(time, selected, colours);
        band ??= drawBand(by("raster"), run, colours);
        drawTime(by("raster"), band, run, time, colours);
        by("seek").max = run.seconds;
        by("seek").value = time;
        by("seek").setAttribute("aria-valuetext", `${time.toFixed(2)} of ${run.seconds.toFixed(2)} s`);
        by("time").textContent = `${time.toFixed(state.speed < 0.1 ? 4 : 2)} of ${run.seconds.toFixed(2)} s`;
        showFacts(run, time);
        // Text for people need not change with each picture.
        if (!state.isPlaying || performance.now() - shownDetails > 120) {
            shownDetails = performance.now();
            showDetails(by("details"), run, time, selected);
            tree.show(time, selected);
            controls?.show();
            showInside(by("inside"), selected === null ? null : run.inside(selected, time));
            canvas.setAttribute("aria-label", `The robot in 3D: ${describe()}`);
        }
        showLabel(selected);
    }

    function showLabel(selected) {
        const at = selected === null ? null : picture.onScreen(selected, 0.11);
        by("label").hidden = !at;
        if (!at) return;
        by("label").textContent = `${selected} ${run.type(selected, state.time)}`;
        const [x, y] = [at[0] * canvas.clientWidth, at[1] * canvas.clientHeight];
        by("label").style.transform =
            `translate(-50%, -100%) translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    }

    let last = performance.now();
    function tick(now) {
        const passed = Math.min((now - last) / 1000, 0.25);
        last = now;
        if (state.isPlaying) {
            const pace = Math.min(state.speed, live?.pace(state.time) ?? Infinity);
            state.time = Math.min(state.time + passed * pace, run.seconds);
            live?.play(state.time, state.speed);
            redraw();
            if (state.time >= end()) play(false);
        }
        if (state.isDirty) {
            state.isDirty = false;
            show();
        }
        requestAnimationFrame(tick);
    }

    /** What an address asks for, as in FILE.html#t=4.1&view=side&module=3&speed=0.1&theme=light&ui=off. */
    function obey(address) {
        const wishes = new URLSearchParams(address);
        const prefers = matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark";
        theme(Object.hasOwn(THEMES, wishes.get("theme")) ? wishes.get("theme") : prefers);
        document.body.classList.toggle("bare", wishes.get("ui") === "off");
        resize();
        seek(Number(wishes.get("t")) || 0);
        const speed = Number(wishes.get("speed")) || 1;
        pace(SPEEDS.reduce((one, other) => (Math.abs(other - speed) < Math.abs(one - speed) ? other : one)));
        picture.view.show(run, state.time, wishes.get("view") ?? "head");
        follow(true);
        const module = Number(wishes.get("module") || -1);
        const isOne = Number.isInteger(module) && module >= 0 && module < run.modules;
        state.selected = isOne ? module : null;
        live?.inspect(state.selected);
        play(!wishes.has("t") && !matchMedia("(prefers-reduced-motion: reduce)").matches);
    }

    function tell(text) {
        by("note").textContent = text;
        say(text);
    }

    const controls =
        live &&
        new Controls(run, live, {
            selected: () => state.selected,
            tell,
            arrive: () => seek(run.seconds),
        });

    let drawnNews = 0;
    Object.assign(page, {
        tell,
        news() {
            if (!state.isPlaying && state.goal > state.time) seek(state.goal);
            controls.pass();
            redraw();
            // These look at the whole run.
            if (performance.now() - drawnNews < 250 && run.seconds < end()) return;
            drawnNews = performance.now();
            band = null;
            map.measure();
            showLegend(run);
        },
        ended(ended) {
            showEnd(ended);
            tell("the run is over");
            page.news();
        },
    });

    by("loading").remove();
    head(run, SPEEDS);
    showLegend(run);
    obey(location.hash.slice(1));
    addEventListener("hashchange", () => obey(location.hash.slice(1)));
    requestAnimationFrame(tick);

    // What is drawn, for tests and for the curious.
    window.superbot = {
        describe: () => ({
            time: state.time,
            isPlaying: state.isPlaying,
            speed: state.speed,
            selected: state.selected,
            present: run.seconds,
            isThere: live?.isThere ?? null,
            isOver: live?.isOver ?? null,
            happenings: run.happenings,
            theme: state.theme,
            view: picture.view.view,
            follows: picture.view.follows,
            hormones: picture.travelling,
            losing: picture.losing,
            links: picture.links.count,
            dockError: picture.dockError(state.time),
            standing: run.about.ground ? boxes(run.about.ground) : [],
            slope: run.about.ground?.slope ?? null,
            triangles: picture.renderer.info.render.triangles,
            modules: Array.from({ length: run.modules }, (_, module) => ({
                type: run.type(module, state.time),
                action: run.action(module, state.time),
                at: run.place(module, state.time).toArray(),
                onScreen: picture.onScreen(module),
            })),
        }),
        inside: () => (state.selected === null ? null : run.inside(state.selected, state.time)),
        hormones: run.hormones,
        losses: run.losses,
        seek,
        play,
        select,
        pace,
        obey,
    };
}

const page = {};
load(page)
    .then((loaded) => begin(loaded, page))
    .catch(fail);
