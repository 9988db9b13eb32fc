// What a run was like at any time.

import { Matrix4, Quaternion, Vector3 } from "three";

const NUMBERS = 10;

/** How many of `list`, which is in the order of `at`, are not later than `time`. */
export function until(list, time, at = (item) => item.at) {
    let [low, high] = [0, list.length];
    while (low < high) {
        const middle = (low + high) >> 1;
        if (at(list[middle]) <= time) low = middle + 1;
        else high = middle;
    }
    return low;
}

const byModule = (list, modules, of = (item) => item.module) => {
    const lists = Array.from({ length: modules }, () => []);
    for (const item of list) lists[of(item)].push(item);
    return lists;
};

export class Run {
    constructor(about, { placings, hormones, deeds, views, losses }) {
        Object.assign(this, { about, placings, hormones, losses });
        this.modules = about.modules;
        this.seconds = Math.max(0, (about.looks - 1) * about.every);
        const of = (what) =>
            byModule(
                deeds.filter((deed) => deed.what === what),
                this.modules,
            );
        this.actions = of("action");
        this.madeGood = of("made good");
        this.generated = of("generated");
        this.views = byModule(views, this.modules);
        this.leaving = byModule(hormones, this.modules, (passage) => passage.from.module);
        this.wirings = about.wirings.map(({ seconds, pairs }) => {
            const peers = Array.from({ length: this.modules }, () => Array(6).fill(null));
            for (const [one, its, other, others] of pairs) {
                peers[one][its] = { module: other, dock: others };
                peers[other][others] = { module: one, dock: its };
            }
            return { at: seconds, pairs, peers };
        });
        for (const passage of hormones) {
            const { module, dock } = passage.from;
            // What was sent just before the end may have been on its way.
            passage.isLost = passage.arrived === null && passage.sent + about.lost_after < about.seconds;
            passage.to = this.wiring(passage.sent).peers[module][dock];
        }
        this.arriving = byModule(
            hormones.filter((passage) => passage.arrived !== null && passage.to),
            this.modules,
            (passage) => passage.to.module,
        );
        this.arriving.forEach((list) => list.sort((one, other) => one.arrived - other.arrived));
        this.deliveries = hormones.flatMap(({ arrived }) => arrived ?? []).sort((one, other) => one - other);
        this.longest = hormones.reduce(
            (most, { sent, arrived }) => Math.max(most, (arrived ?? sent) - sent),
            0,
        );
    }

    wiring(time) {
        return this.wirings[Math.max(0, until(this.wirings, time) - 1)];
    }

    last(lists, module, time) {
        const list = lists[module];
        return list[until(list, time) - 1];
    }

    type(module, time) {
        return this.last(this.views, module, time)?.type ?? "Starting";
    }

    action(module, time) {
        return this.last(this.actions, module, time)?.of ?? "none yet";
    }

    /** The docks at which a module has found a neighbour, as bits. */
    known(module, time) {
        return this.last(this.views, module, time)?.docks ?? 0;
    }

    /** The last hormone that a module took up. */
    arrived(module, time) {
        const list = this.arriving[module];
        return list[until(list, time, (passage) => passage.arrived) - 1];
    }

    /** How many hormones a module has got and sent on. */
    counts(module, time) {
        return {
            received: until(this.arriving[module], time, (passage) => passage.arrived),
            sent: until(this.leaving[module], time, (passage) => passage.sent),
            madeGood: until(this.madeGood[module], time),
        };
    }

    /** The hormones that are on their way, or were within so many seconds. */
    underWay(time, linger) {
        const first = until(
            this.hormones,
            time - linger - Math.min(this.longest, 0.5),
            (passage) => passage.sent,
        );
        const end = until(this.hormones, time, (passage) => passage.sent);
        const lasts = ({ sent, arrived }) => (arrived ?? sent) + linger >= time;
        return this.hormones.slice(first, end).filter(lasts);
    }

    /** The frames that links lost within so many seconds. */
    lost(time, linger) {
        return this.losses.slice(until(this.losses, time - linger), until(this.losses, time));
    }

    /** Where a module is at a time: between two looks, by their mean. */
    placing(module, time, into = { frame: new Matrix4(), angles: [0, 0, 0] }) {
        const { placings, modules, about } = this;
        const exact = Math.min(Math.max(time / about.every, 0), about.looks - 1);
        const look = Math.floor(exact);
        const share = exact - look;
        const one = (look * modules + module) * NUMBERS;
        const other = (Math.min(look + 1, about.looks - 1) * modules + module) * NUMBERS;
        const mean = (index) => placings[one + index] * (1 - share) + placings[other + index] * share;
        AT.set(mean(0), mean(1), mean(2));
        FROM.fromArray(placings, one + 3).normalize();
        TO.fromArray(placings, other + 3).normalize();
        into.frame.compose(AT, FROM.slerp(TO, share), ONE);
        for (let joint = 0; joint < 3; joint++) into.angles[joint] = mean(7 + joint);
        return into;
    }

    /** Where a module has its middle. */
    place(module, time) {
        return new Vector3().setFromMatrixPosition(this.placing(module, time).frame);
    }
}

const [AT, ONE] = [new Vector3(), new Vector3(1, 1, 1)];
const [FROM, TO] = [new Quaternion(), new Quaternion()];
