// What a robot that runs is told to do, and what is done to it: in the words of a robot file.

const by = (id) => document.getElementById(id);

/** A course is forgotten after 2 s: it is said again before. In s of the run. */
const REPEAT = 1.5;
const COURSES = ["ahead", "left", "right"];
/** On the wire: the gait's own Period, that of no gait, and as many modules as there may be. */
const [OWN, STOP, ALL] = [255, 0, 255];
const UNIT = 50;
/** In N along x, y and z of the ground. */
const PUSHES = [
    ["left", [0, 30, 0]],
    ["right", [0, -30, 0]],
    ["up", [0, 0, 30]],
];
const [WALK, STEER] = [0xd0, 0xe0];

export class Controls {
    /** `tell` says something to who looks; `arrive` brings them to the present. */
    constructor(run, live, { selected, tell, arrive }) {
        Object.assign(this, { run, live, selected, tell, arrive, course: 0, steered: -Infinity });
        by("controls").hidden = false;
        by("gait").replaceChildren(
            ...Object.entries(run.about.gaits).map(([code, name]) => new Option(spaced(name), code)),
        );
        by("walk").onclick = () => this.walk(Number(by("gait").value));
        // Whatever stands in the field for the Period.
        by("stop").onclick = () => this.order(WALK + STOP, OWN);
        for (const name of COURSES) by(name).onclick = () => this.steer(COURSES.indexOf(name));
        by("lose").onclick = () => this.do(`loss = ${(Number(by("loss").value) / 100).toFixed(4)}`);
        by("turn").onclick = () => this.do(`roll = ${Number(by("roll").value)}`);
        by("save").onclick = () => this.save();
        by("module").onclick = ({ target }) => target.dataset.event && this.do(target.dataset.event);
        this.showCourse();
    }

    /** Lets something happen now, which is shown unless it is said again and again. */
    async do(event, isRepeated = false) {
        if (!isRepeated) this.arrive();
        try {
            await this.live.send({ event });
            this.tell(`done: ${event.replaceAll("\n", ", ")}`);
        } catch (error) {
            this.tell(`not done: ${error.message}`);
        }
    }

    /** An order goes in by a free dock: of the module that is selected, or else of the first that has one.
     * Only a module that runs hears it. */
    order(first, last, isRepeated = false) {
        const { run } = this;
        const { peers } = run.wirings.at(-1);
        const hears = (module) => run.runs(module, run.seconds) && peers[module].includes(null);
        const module = [this.selected() ?? 0, ...peers.keys()].find(hears);
        if (module === undefined)
            return this.tell("not done: no module that runs has a free dock, by which an order could come");
        const dock = run.about.docks[peers[module].indexOf(null)];
        // It grows from order to order, also when the page is loaded anew.
        const number = (run.happenings.length + 1) % 256;
        return this.do(`command = [${first}, ${number}, ${last}]\nto = "${module}.${dock}"`, isRepeated);
    }

    walk(gait) {
        const { validity, value } = by("period");
        if (validity.valid) return this.order(WALK + gait, value ? Number(value) / UNIT : OWN);
        this.tell("not done: give a Period from 250 to 4000 ms in steps of 50, or none for the gait's own");
    }

    steer(course, isRepeated = false) {
        this.course = course;
        this.steered = this.run.seconds;
        this.showCourse();
        return this.order(STEER + course, ALL, isRepeated);
    }

    showCourse() {
        COURSES.forEach((name, course) => by(name).setAttribute("aria-pressed", course === this.course));
    }

    /** Time has passed. */
    pass() {
        if (this.course && !this.live.isOver && this.run.seconds > this.steered + REPEAT)
            this.steer(this.course, true);
    }

    async save() {
        try {
            const file = new Blob([await this.live.send({ timeline: null })], { type: "application/toml" });
            const link = Object.assign(document.createElement("a"), {
                href: URL.createObjectURL(file),
                download: `${this.run.about.robot}-by-hand.toml`,
            });
            link.click();
            URL.revokeObjectURL(link.href);
            this.tell("saved");
        } catch (error) {
            this.tell(`not saved: ${error.message}`);
        }
    }

    /** Shows what can be done to the module that is selected. */
    show() {
        const module = this.selected();
        const wiring = this.run.wirings.at(-1);
        const key = `${module} ${this.run.wirings.length}`;
        if (this.key === key) return;
        this.key = key;
        const button = (text, event) => {
            const element = Object.assign(document.createElement("button"), { textContent: text });
            element.dataset.event = event;
            return element;
        };
        const buttons = [];
        if (module !== null) {
            this.run.about.docks.forEach((name, dock) => {
                const here = `"${module}.${name}"`;
                if (wiring.peers[module][dock])
                    return buttons.push(button(`Pull off ${name}`, `detach = ${here}`));
                const there = this.was(module, dock);
                if (there) buttons.push(button(`Put back ${name}`, `attach = [${here}, "${there}"]`));
            });
            if (this.run.about.ground)
                for (const [name, newtons] of PUSHES)
                    buttons.push(button(`Push ${name}`, `push = ${module}\nnewtons = [${newtons}]`));
            const free = wiring.peers[module].indexOf(null);
            if (free >= 0 && this.run.about.engine === "simavr")
                buttons.push(
                    button("Ask its console", `console = "${module}.${this.run.about.docks[free]}"`),
                );
            buttons.push(button("Reset", `reset = ${module}`));
            buttons.push(button("Power off", `kill = ${module}`));
        }
        by("module").replaceChildren(...buttons);
    }

    /** What was at a free dock last, if that is free too. */
    was(module, dock) {
        const { peers } = this.run.wirings.at(-1);
        const before = this.run.wirings.findLast((wiring) => wiring.peers[module][dock]);
        const there = before?.peers[module][dock];
        return (
            there && !peers[there.module][there.dock] && `${there.module}.${this.run.about.docks[there.dock]}`
        );
    }
}

const spaced = (name) => name[0] + name.slice(1).replace(/[A-Z]/g, (letter) => ` ${letter.toLowerCase()}`);
